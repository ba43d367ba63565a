// Convolution on layered depth images, plain and partial (paper, section "Mapping the PConv Network to LDI"; partial convolution
// after Liu et al., ECCV 2018). Values are float32 tensors of pixels x channels, row-major, pixels in the graph's order.
#pragma once

#include <ldi/core/executor.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/nn/convolution_plan.hpp>
#include <ldi/nn/detail/convolution_block.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ldi {

/// Weights as PyTorch stores them, in the order that conv_f32() reads.
///
/// weights  outputs x inputs x kernel_size x kernel_size, row-major, finite; batch normalisation folded in
/// bias     outputs
/// inputs   channels; where a convolution reads several sources, of all of them, one after the other
inline conv_f32_weights pack_convolution(isa target, std::span<const float> weights, std::span<const float> bias,
                                         std::int32_t kernel_size, activation after) {
    const std::size_t k = static_cast<std::size_t>(kernel_size), elements = k * k;
    LDI_ASSERT(!bias.empty() && weights.size() % (bias.size() * elements) == 0);
    const std::size_t inputs = weights.size() / (bias.size() * elements);
    std::vector<float> channels_last(weights.size());
    for (std::size_t o = 0; o < bias.size(); ++o)
        for (std::size_t c = 0; c < inputs; ++c)
            for (std::size_t e = 0; e < elements; ++e)
                channels_last[(o * elements + e) * inputs + c] = weights[(o * inputs + c) * elements + e];
    return pack_conv_f32(target, channels_last, bias, k, after);
}

/// result = activation(weights * window + bias); what does not exist counts as zero.
///
/// sources  what a pixel holds: the channels of the first, then those of the next. Their masks must be empty
/// result   plan.output_count x weights.outputs; rows of outputs that are not in the plan are left as they are. Must not overlap
/// a source
///
/// The bits of an output depend on its window alone: not on the plan (whole or restricted) and not on the executor.
template <executor Executor>
void convolve(const convolution_plan& plan, const conv_f32_weights& weights, std::span<const convolution_source> sources,
              std::span<float> result, Executor& threads) {
    LDI_ASSERT(std::all_of(sources.begin(), sources.end(), [](const convolution_source& s) { return s.mask.empty(); }));
    detail::run_convolution(plan, weights, sources, false, result, {}, threads);
}

/// result = activation(weights * (window . mask) * (C k^2 / sum of mask) + bias) where the mask's sum is positive, else 0.
///
/// Where a pixel does not exist, or its row is no_pixel, or its mask is 0, its channels count as masked. The sum runs over all
/// channels of all sources: a pixel counts C of a source's channels where that source has it. Without masks this is partial
/// convolution by existence.
///
/// result_mask  plan.output_count: 1 where the mask's sum is positive, else 0; may be empty
template <executor Executor>
void convolve_partially(const convolution_plan& plan, const conv_f32_weights& weights,
                        std::span<const convolution_source> sources, std::span<float> result, std::span<std::uint8_t> result_mask,
                        Executor& threads) {
    detail::run_convolution(plan, weights, sources, true, result, result_mask, threads);
}

}  // namespace ldi
