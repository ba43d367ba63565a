// Convolution on layered depth images, plain and partial (paper, section "Mapping the PConv Network to LDI"; partial
// convolution after Liu et al., ECCV 2018). Inputs and results are tensors of float32 or bytes: pixels x channels, row-major,
// with the pixels in the graph's order.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/detail/convolution_block.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Transposes outputs x inputs x k x k to outputs x k x k x inputs. Raises invalid_option unless the kernel size is 1, 3, ..., or
/// max_kernel_size. Raises mismatch unless the number of weights is a positive multiple of outputs * k * k.
inline buffer<float> channels_last(std::span<const float> weights, std::size_t outputs, std::int32_t kernel_size) {
    check_kernel_size(kernel_size);
    const std::size_t elements = static_cast<std::size_t>(kernel_size) * static_cast<std::size_t>(kernel_size);
    if (outputs == 0 || weights.empty() || weights.size() % (outputs * elements) != 0)
        raise(error_code::mismatch, "convolution", "outputs x inputs x " + std::to_string(elements) + " weights",
              std::to_string(weights.size()) + " weights for " + std::to_string(outputs) + " outputs");
    const std::size_t inputs = weights.size() / (outputs * elements);
    buffer<float> result(weights.size());
    for (std::size_t o = 0; o < outputs; ++o)
        for (std::size_t c = 0; c < inputs; ++c)
            for (std::size_t e = 0; e < elements; ++e)
                result[(o * elements + e) * inputs + c] = weights[(o * inputs + c) * elements + e];
    return result;
}

/// Raises invalid_option unless the slope of an activation is in [0, 1].
inline void check_activation(activation after) {
    if (!(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F))
        raise(error_code::invalid_option, "convolution", "an activation with a slope from 0 to 1", to_text(after.negative_slope));
}

}  // namespace detail

/// Packs PyTorch weights for conv_f32().
///
/// target   instruction set for which to pack; must be available (is_available()), else raises invalid_option
/// weights  outputs x inputs x kernel_size x kernel_size, row-major, finite; batch normalization folded in. `inputs` is the total
///          number of channels of all sources, concatenated in order
/// bias     outputs, 1 or more
/// after    applied to the sums; its slope must be in [0, 1]
///
/// Raises invalid_option unless the slope is in [0, 1] and the kernel size is 1, 3, ..., or max_kernel_size. Raises mismatch
/// unless the number of weights is a positive multiple of outputs * kernel_size * kernel_size.
inline conv_f32_weights pack_convolution(isa target, std::span<const float> weights, std::span<const float> bias,
                                         std::int32_t kernel_size, activation after) {
    detail::check_activation(after);
    return pack_conv_f32(target, detail::channels_last(weights, bias.size(), kernel_size), bias,
                         static_cast<std::size_t>(kernel_size), after);
}

/// Number of channels and quantization of an 8-bit source.
struct quantized_source {
    std::size_t channels = 0;
    quantization values;
};

/// Rounds PyTorch weights to 7 bits and packs them for conv_u8(). First multiplies each weight by the scale of its input. Then
/// scales the products of each output so that the largest absolute value is 63. Raises the errors of pack_convolution(). Raises
/// mismatch unless the channels of all sources add up to the inputs of the weights. Raises invalid_data if a weight times its
/// scale is NaN. Raises unsupported if the scale or the bias of an output is not finite in units of result.scale, or if
/// kernel_size * kernel_size * channels exceeds max_conv_u8_inputs (2^17), because sums would overflow.
///
/// target, weights, bias and kernel_size are as in pack_convolution().
///
/// after    applied to the sums, before they are quantized; its slope must be in [0, 1]
/// sources  channels and quantization of each source that the convolution will read, in order. The zero point must equal
///          basic_feature_view::zero of the source. No function checks this. A different zero point changes the results of
///          windows with missing pixels
/// result   quantization of byte results; float results are in units of result.scale
inline conv_u8_weights pack_byte_convolution(isa target, std::span<const float> weights, std::span<const float> bias,
                                             std::int32_t kernel_size, activation after,
                                             std::span<const quantized_source> sources, quantization result) {
    detail::check_activation(after);
    const std::size_t k = static_cast<std::size_t>(kernel_size), outputs = bias.size();
    buffer<float> scaled = detail::channels_last(weights, outputs, kernel_size);
    buffer<float> input_scales;
    buffer<std::uint8_t> zero_points;
    for (std::size_t x = 0; x < k; ++x)
        for (const quantized_source& source : sources) {
            input_scales.resize(input_scales.size() + source.channels, source.values.scale);
            zero_points.resize(zero_points.size() + source.channels, source.values.zero_point);
        }
    if (scaled.size() != outputs * k * input_scales.size())
        raise(error_code::mismatch, "convolution", std::to_string(scaled.size() / (outputs * k * k)) + " channels in all sources",
              std::to_string(input_scales.size() / k));
    const std::size_t inputs = k * input_scales.size();
    if (inputs > max_conv_u8_inputs)
        raise(error_code::unsupported, "convolution",
              "at most " + std::to_string(max_conv_u8_inputs) + " inputs of a convolution of bytes", std::to_string(inputs));
    buffer<std::int8_t> rounded(scaled.size());
    buffer<float> scales(outputs), result_bias(outputs);
    for (std::size_t o = 0; o < outputs; ++o) {
        const std::span<float> row = std::span(scaled).subspan(o * inputs, inputs);
        float largest = 0.0F;
        for (std::size_t i = 0; i < inputs; ++i) {
            largest = (std::max)(largest, std::abs(row[i] *= input_scales[i % input_scales.size()]));
            if (std::isnan(row[i])) raise(error_code::invalid_data, "convolution", "finite weights and scales", "NaN");
        }
        const float step = largest / detail::nearest_float(max_conv_u8_weight);
        const bool is_zero = step < (std::numeric_limits<float>::min)();  // if step is subnormal, row[i] / step may exceed 63
        scales[o] = (is_zero ? 1.0F : step) / result.scale, result_bias[o] = bias[o] / result.scale;
        if (!std::isfinite(scales[o]) || !std::isfinite(result_bias[o]))
            raise(error_code::unsupported, "convolution, output " + std::to_string(o),
                  "a finite scale and bias after division by the result's scale",
                  "a scale of " + detail::to_text(scales[o]) + " and a bias of " + detail::to_text(result_bias[o]));
        for (std::size_t i = 0; i < inputs; ++i)
            rounded[o * inputs + i] = is_zero ? std::int8_t{0} : static_cast<std::int8_t>(detail::nearest_whole(row[i] / step));
    }
    return pack_conv_u8(target, rounded, zero_points, scales, result_bias, k, after, result.zero_point);
}

/// Computes result = activation(weights * window + bias); missing pixels count as zero.
///
/// sources  maps whose channels, concatenated, are the inputs; their masks must be empty
/// result   plan.output_count() x weights->outputs, a vector or span of float or of the sources' type. Rows of outputs that the
///          plan omits stay unchanged. Must not overlap a source
///
/// Raises mismatch for a plan of a different kernel size, and for sources or a result of the wrong size. The bits of an output
/// depend on its window alone, not on the plan (full or restricted) or on the executor.
template <class Weights, class Result, executor Executor = const serial_executor>
void convolve(const convolution_plan& plan, const Weights& weights,
              std::span<const basic_feature_view<typename Weights::value_type>> sources, Result&& result,
              Executor&& threads = {}) {
    LDI_ASSERT(std::all_of(sources.begin(), sources.end(), [](const auto& s) { return s.mask.empty(); }));
    detail::run_convolution(plan, weights, sources, false, std::span(result), {}, threads);
}

/// Computes result = activation(weights * (window . mask) * (C k^2 / sum of mask) + bias) where the mask's sum is positive, else
/// 0.
///
/// In a source, a pixel's channels are masked if the pixel does not exist, its row is no_pixel, or its mask is 0. The mask's
/// sum runs over all channels of all sources. C is the number of these channels, and k is the kernel size. Without masks, only
/// missing pixels are excluded.
///
/// sources, result  as in convolve(), but sources may have masks
/// result_mask      plan.output_count(): set to 1 where the mask's sum is positive, else to 0; may be empty
///
/// Raises mismatch as convolve() does, and for a nonempty result_mask of the wrong size.
template <class Weights, class Result, executor Executor = const serial_executor>
void convolve_partially(const convolution_plan& plan, const Weights& weights,
                        std::span<const basic_feature_view<typename Weights::value_type>> sources, Result&& result,
                        std::span<std::uint8_t> result_mask = {}, Executor&& threads = {}) {
    detail::run_convolution(plan, weights, sources, true, std::span(result), result_mask, threads);
}

}}  // namespace ldi
