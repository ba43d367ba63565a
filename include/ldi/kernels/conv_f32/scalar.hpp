// kernels/conv_f32.hpp in portable C++.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Number of outputs that are adjacent in memory. Compilers vectorize the loop over them.
inline constexpr std::size_t conv_panel = 8;
inline constexpr detail::panel_layout conv_f32_layout{1, conv_panel, 1};

/// Returns a * b + c, fused on targets with an instruction for it. Without this function, the compiler would fuse only in some
/// tiles, and a pixel's bits would depend on its tile.
inline float multiply_add(float a, float b, float c) {
#if defined(__FP_FAST_FMAF) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return std::fma(a, b, c);
#else
    return a * b + c;
#endif
}

/// Computes `pixels` pixels with one panel of weights.
template <std::size_t pixels>
inline void conv_tile(const conv_f32_weights& weights, const float* const* rows, std::size_t offset, std::size_t pixel_stride,
                      std::size_t first_output, const float* ratios, float* result) {
    float sums[pixels][conv_panel] = {};
    const float* values = weights.values.data() + first_output * weights.rows * weights.inputs;
    for (std::size_t r = 0; r < weights.rows; ++r) {
        const float* const input = rows[r] + offset;
        for (std::size_t i = 0; i < weights.inputs; ++i, values += conv_panel)
            for (std::size_t p = 0; p < pixels; ++p)
                for (std::size_t o = 0; o < conv_panel; ++o)
                    sums[p][o] = multiply_add(input[p * pixel_stride + i], values[o], sums[p][o]);
    }
    const std::size_t count = (std::min)(conv_panel, weights.outputs - first_output);
    const float lowest = detail::lowest_before(weights.negative_slope);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < count; ++o) {
            const float ratio = ratios == nullptr ? 1.0F : ratios[p];
            const float value = multiply_add(sums[p][o], ratio, weights.bias[first_output + o]);
            result[p * weights.outputs + first_output + o] =
                value > 0.0F ? value : (std::max)(value, lowest) * weights.negative_slope;
        }
}

inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    constexpr std::size_t tile = 4;
    const auto ratios_from = [&](std::size_t p) { return ratios == nullptr ? nullptr : ratios + p; };
    for (std::size_t o = 0; o < weights.outputs; o += conv_panel) {
        std::size_t p = 0;
        for (; p + tile <= pixels; p += tile)
            conv_tile<tile>(weights, rows, p * pixel_stride, pixel_stride, o, ratios_from(p), result + p * weights.outputs);
        for (; p < pixels; ++p)
            conv_tile<1>(weights, rows, p * pixel_stride, pixel_stride, o, ratios_from(p), result + p * weights.outputs);
    }
}

}}}  // namespace ldi::scalar
