// The silhouette network decides which of the two surfaces a pixel near a sharp disparity step belongs to. It is a small U-Net
// in 8-bit arithmetic that computes only the region around the steps. examples/training/silhouettes/README.md defines its input
// and its layers; io/weight_files.hpp loads it from a file; depth/network_decider.hpp runs it on a photo.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/detail/network_tensors.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/region_plan.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>
#include <ldi/nn/weights.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The network with packed weights. All member functions are const and keep no state, so any number of threads may share an
/// object.
class silhouette_network {
public:
    static constexpr std::size_t input_channels = 8, output_channels = 2;
    static constexpr std::size_t level_count = 4;

    /// Checks and packs the weights.
    ///
    /// weights  for each layer, `NAME.weight` (outputs x inputs x 3 x 3) and `NAME.bias`, with batch normalization folded in.
    ///          Also `input.range`, and `NAME.range` for every layer that another layer reads: minimum and maximum of the values
    /// target   the instruction set for which to pack the weights; results do not depend on it
    ///
    /// Raises mismatch, with the name of the tensor, if a tensor is missing, unexpected, or of the wrong type or shape;
    /// invalid_data for weights that are not finite or a range without 0; unsupported for weights whose quantization is not
    /// finite; and invalid_option for a target that is not available.
    explicit silhouette_network(const named_tensors& weights, isa target = best_isa());

    /// Returns the results of the last layer, K x 2. Channel 0 is the logit of the front surface's share of the pixel;
    /// depth/network_decider.hpp adds a prior to it. Channel 1 is the logit of the probability that this share is on the correct
    /// side of 0.5. The results of unwanted pixels are uninitialized.
    ///
    /// region  K pixels
    /// input   K x 8; examples/training/silhouettes/README.md defines the channels
    /// wanted  K; nonzero for pixels whose results are required
    ///
    /// Time and memory are proportional to the number of pixels of the region. Memory is about 130 bytes per pixel.
    template <executor Executor = const serial_executor>
    buffer<float> logits(const pixel_region& region, buffer<std::uint8_t> input, std::span<const std::uint8_t> wanted,
                         Executor&& threads = {}) const;

private:
    using map = basic_feature_map<std::uint8_t>;
    using view = basic_feature_view<std::uint8_t>;

    /// Index of a layer in `shapes`.
    enum layer : std::size_t {
        fine,
        half_down,
        half,
        quarter_down,
        quarter,
        eighth_down,
        eighth,
        quarter_up,
        half_up,
        fine_up,
        out
    };
    struct layer_shape {
        std::string_view name;
        std::array<std::string_view, 2> reads;  ///< one or two sources; if there are two, the first is upsampled
        std::size_t inputs, outputs;            ///< channels of each source, and of the result
    };
    static constexpr std::array<layer_shape, 11> shapes{{{"fine", {"input", ""}, input_channels, 16},
                                                         {"half.down", {"fine", ""}, 16, 32},
                                                         {"half", {"half.down", ""}, 32, 32},
                                                         {"quarter.down", {"half", ""}, 32, 32},
                                                         {"quarter", {"quarter.down", ""}, 32, 32},
                                                         {"eighth.down", {"quarter", ""}, 32, 32},
                                                         {"eighth", {"eighth.down", ""}, 32, 32},
                                                         {"quarter.up", {"eighth", "quarter"}, 32, 32},
                                                         {"half.up", {"quarter.up", "half"}, 32, 16},
                                                         {"fine.up", {"half.up", "fine"}, 16, 16},
                                                         {"out", {"fine.up", ""}, 16, output_channels}}};

    /// A resolution level: its pixels, its convolutions with stride 1 (`same`) and 2 (`down`), and each pixel's parent on the
    /// next coarser level.
    struct level {
        pixel_region region;
        convolution_plan same, down;
        buffer<std::int32_t> parent;
    };
    static std::array<level, level_count> plan_levels(const pixel_region& region);

    template <class Result, executor Executor>
    void run(layer l, const convolution_plan& plan, std::initializer_list<view> sources, Result& result,
             Executor& threads) const {
        convolve(plan, layers_[l], std::span<const view>(sources.begin(), sources.size()), result, threads);
    }
    template <executor Executor>
    map run(layer l, const convolution_plan& plan, std::initializer_list<view> sources, Executor& threads) const {
        map result(plan.output_count(), layers_[l]->outputs, layers_[l]->result_zero_point);
        run(l, plan, sources, result.values, threads);
        return result;
    }

    std::array<conv_u8_weights, shapes.size()> layers_;
    std::uint8_t input_zero_ = 0;
};

inline silhouette_network::silhouette_network(const named_tensors& weights, isa target) {
    std::vector<std::string> names{"input.range"};
    for (std::size_t l = 0; l < shapes.size(); ++l) {
        const layer_shape& shape = shapes[l];
        const std::string name(shape.name);
        const bool is_last = l + 1 == shapes.size();
        buffer<quantized_source> sources;
        for (const std::string_view read : shape.reads)
            if (!read.empty()) sources.push_back({shape.inputs, detail::quantization_of(weights, std::string(read))});
        const buffer<float>& values =
            detail::finite_values(weights, name + ".weight", {shape.outputs, sources.size() * shape.inputs, 3, 3});
        const buffer<float>& bias = detail::finite_values(weights, name + ".bias", {shape.outputs});
        names.push_back(name + ".weight"), names.push_back(name + ".bias");
        if (!is_last) names.push_back(name + ".range");
        layers_[l] = pack_byte_convolution(target, values, bias, 3, is_last ? no_activation : relu, sources,
                                           is_last ? quantization{} : detail::quantization_of(weights, name));
    }
    check_no_others(weights, names);
    input_zero_ = detail::quantization_of(weights, "input").zero_point;
}

inline std::array<silhouette_network::level, silhouette_network::level_count> silhouette_network::plan_levels(
    const pixel_region& region) {
    std::array<level, level_count> levels;
    levels[0].region = region;
    for (std::size_t i = 0; i < level_count; ++i) {
        levels[i].same = plan_convolution(levels[i].region, 3);
        if (i + 1 == level_count) break;
        levels[i + 1].region = halved(levels[i].region);
        levels[i].down = plan_convolution(levels[i].region, 3, levels[i + 1].region);
        levels[i].parent = parents(levels[i].region, levels[i + 1].region);
    }
    return levels;
}

template <executor Executor>
buffer<float> silhouette_network::logits(const pixel_region& region, buffer<std::uint8_t> input,
                                         std::span<const std::uint8_t> wanted, Executor&& threads) const {
    LDI_ASSERT(input.size() == input_channels * region.size() && wanted.size() == region.size());
    buffer<float> result(output_channels * region.size(), unset);
    if (region.count() == 0) return result;
    const std::array<level, level_count> levels = plan_levels(region);
    const auto with_coarser = [&](const map& coarser, std::size_t l) {
        return view{coarser.values, coarser.channels, levels[l].parent, {}, coarser.zero};
    };

    map read(0, input_channels, input_zero_);
    read.values = std::move(input);
    const map at_fine = run(fine, levels[0].same, {view(read)}, threads);
    read = {};
    const map at_half = run(half, levels[1].same, {view(run(half_down, levels[0].down, {view(at_fine)}, threads))}, threads);
    map at_quarter = run(quarter, levels[2].same, {view(run(quarter_down, levels[1].down, {view(at_half)}, threads))}, threads);
    const map at_eighth =
        run(eighth, levels[3].same, {view(run(eighth_down, levels[2].down, {view(at_quarter)}, threads))}, threads);
    at_quarter = run(quarter_up, levels[2].same, {with_coarser(at_eighth, 2), view(at_quarter)}, threads);
    const map back_at_half = run(half_up, levels[1].same, {with_coarser(at_quarter, 1), view(at_half)}, threads);

    // The last two layers compute only the wanted pixels and their inputs.
    const pixel_subset computed = pixel_subset::marked(wanted);
    const convolution_plan last = restrict_to(levels[0].same, computed);
    const convolution_plan before = restrict_to(levels[0].same, needed_inputs(last));
    const map back_at_fine = run(fine_up, before, {with_coarser(back_at_half, 0), view(at_fine)}, threads);
    run(out, last, {view(back_at_fine)}, result, threads);
    return result;
}

}}  // namespace ldi
