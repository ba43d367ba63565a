// kernels/conv_u8.hpp in portable C++.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/kernels/conv_u8/contract.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Number of outputs that are adjacent in memory, so that compilers vectorize the loop over them.
inline constexpr std::size_t conv_u8_panel = 8;
inline constexpr detail::panel_layout conv_u8_layout{1, conv_u8_panel, 1};

/// Converts a sum, from which the zero points are already subtracted, to a result.
template <class Result>
Result finish_conv_u8(std::int32_t sum, float scale, float bias, float negative_slope, float zero_point) {
    const float value =
        (std::max)(detail::fused_multiply_add(detail::nearest_float(sum), scale, bias), detail::lowest_before(negative_slope));
    // The multiply-add is fused on every machine, so that the result does not depend on the compiler.
    const float activated = value > 0.0F ? value + zero_point : detail::fused_multiply_add(value, negative_slope, zero_point);
    if constexpr (std::is_same_v<Result, float>)
        return activated;
    else
        return activated > 0.0F ? static_cast<Result>(std::nearbyint((std::min)(activated, 255.0F))) : Result{0};  // 0 for NaN
}

/// Computes `pixels` pixels with one panel of weights.
template <std::size_t pixels, class Result>
void conv_u8_tile(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t first_pixel,
                  std::size_t pixel_stride, std::size_t first_output, const detail::conv_u8_panel_output<Result>& out) {
    std::int32_t sums[pixels][conv_u8_panel] = {};
    const std::int8_t* values = weights.values.data() + first_output * weights.rows * weights.inputs;
    for (std::size_t r = 0; r < weights.rows; ++r) {
        const std::uint8_t* const input = rows[r] + first_pixel * pixel_stride;
        for (std::size_t i = 0; i < weights.inputs; ++i, values += conv_u8_panel)
            for (std::size_t p = 0; p < pixels; ++p) {
                const std::int32_t x = input[p * pixel_stride + i];
                for (std::size_t o = 0; o < conv_u8_panel; ++o) sums[p][o] += x * std::int32_t{values[o]};
            }
    }
    const std::size_t count = (std::min)(conv_u8_panel, out.count);
    for (std::size_t p = 0; p < pixels; ++p) {
        const float ratio = out.ratios == nullptr ? 1.0F : out.ratios[first_pixel + p];
        for (std::size_t o = 0; o < count; ++o)
            out.values[(first_pixel + p) * out.stride + o] = finish_conv_u8<Result>(
                sums[p][o] + out.offsets[o], out.scales[o] * ratio, out.bias[o], out.negative_slope, out.zero_point);
    }
}

/// Same parameters as conv_u8() of kernels/conv_u8.hpp.
///
/// Result  float or std::uint8_t
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    constexpr std::size_t tile = 4;
    detail::conv_u8_panel_output<Result> out(weights, ratios, result);
    for (std::size_t o = 0; o < weights.outputs; o += conv_u8_panel, out.skip(conv_u8_panel)) {
        std::size_t p = 0;
        for (; p + tile <= pixels; p += tile) conv_u8_tile<tile>(weights, rows, p, pixel_stride, o, out);
        for (; p < pixels; ++p) conv_u8_tile<1>(weights, rows, p, pixel_stride, o, out);
    }
}

}}}  // namespace ldi::scalar
