// A convolution layer with its weights, the building block of networks on layered images. One layer serves any number of
// graphs: the plan selects the graph and, with stride 2, the coarser graph of the result. The layer computes in float32;
// nn/ldi/convolution.hpp also supports bytes, masks, and results in the caller's memory.
//
//     const ldi::coarsened half = ldi::coarsen(g);
//     const ldi::feature_map fine = first(ldi::plan_convolution(g, 3), input);
//     const ldi::feature_map coarse = second(ldi::plan_convolution(g, 3, half.map), fine);                            // stride 2
//     const ldi::feature_map result = third(ldi::plan_convolution(g, 3), {ldi::upsample(coarse, half.map), fine});
#pragma once

#include <ldi/base/executor.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of convolution_layer.
struct convolution_options {
    std::int32_t kernel_size = 3;      ///< odd, 1 to max_kernel_size
    activation after = no_activation;  ///< no_activation, relu, leaky_relu(slope) with a slope in [0, 1]
    bool is_partial = false;           ///< excludes missing pixels from the rescaled sum; if false, counts them as zero
    isa target = best_isa();           ///< the instruction set to pack weights for; changes results only by rounding errors
};

/// A convolution with packed weights and an activation. Immutable, so that several threads can call it at the same time.
class convolution_layer {
public:
    /// Packs the weights.
    ///
    /// weights  outputs x inputs x kernel_size x kernel_size, row-major, finite, as PyTorch stores them
    /// bias     outputs, 1 or more
    ///
    /// Raises invalid_option unless the kernel size is 1, 3, ..., or max_kernel_size, the slope of the activation is in [0, 1],
    /// and the target is available. Raises mismatch unless the number of weights is a positive multiple of outputs * kernel_size
    /// * kernel_size.
    convolution_layer(std::span<const float> weights, std::span<const float> bias, const convolution_options& options = {})
        : weights_(pack_convolution(options.target, weights, bias, options.kernel_size, options.after)),
          is_partial_(options.is_partial) {}

    /// Convolves the inputs. Returns the result at the plan's outputs: the pixels of the graph or, with stride 2, of the
    /// coarser graph. A pixel's bits depend on its window only, not on the executor. Outputs that the plan omits become 0.
    ///
    /// Raises mismatch for a plan of a different kernel size, for maps with the wrong number of pixels or channels, and if the
    /// layer was moved from.
    ///
    /// plan    a plan of this layer's kernel size
    /// inputs  maps whose channels, concatenated, are the layer's inputs; the layer does not copy the maps. Their masks must be
    ///         empty unless the layer is partial
    template <executor Executor = const serial_executor>
    feature_map operator()(const convolution_plan& plan, std::initializer_list<feature_view> inputs,
                           Executor&& threads = {}) const {
        feature_map result(plan.output_count(), weights_->outputs);
        if (!plan.is_full()) std::fill(result.values.begin(), result.values.end(), 0.0F);
        const std::span<const feature_view> sources(inputs.begin(), inputs.size());
        if (is_partial_)
            convolve_partially(plan, weights_, sources, result.values, {}, threads);
        else
            convolve(plan, weights_, sources, result.values, threads);
        return result;
    }

    /// The same for a single input.
    template <executor Executor = const serial_executor>
    feature_map operator()(const convolution_plan& plan, const feature_map& input, Executor&& threads = {}) const {
        return (*this)(plan, {feature_view(input)}, threads);
    }

private:
    conv_f32_weights weights_;
    bool is_partial_;
};

}}  // namespace ldi
