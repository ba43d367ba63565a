// What kernels/conv_f32.hpp and kernels/conv_bf16.hpp have in common in portable C++.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>

namespace ldi::inline LDI_CONFIGURATION::scalar {

/// Outputs that lie side by side in memory. Compilers make vectors of them.
inline constexpr std::size_t conv_panel = 8;

/// a * b + c, fused where the compiler's target does that in one instruction: left to itself, the compiler fuses in one tile and
/// not in another, and a pixel's bits would depend on the tile that it falls into.
inline float multiply_add(float a, float b, float c) {
#if defined(__FP_FAST_FMAF) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return std::fma(a, b, c);
#else
    return a * b + c;
#endif
}

/// The sums of `pixels` pixels with one panel of weights.
template <std::size_t pixels, class Value, class Result>
inline void conv_tile(const conv_weights<Value>& weights, const Value* const* rows, std::size_t offset, std::size_t pixel_stride,
                      std::size_t first_output, const float* ratios, Result* result) {
    float sums[pixels][conv_panel] = {};
    const Value* values = weights.values.data() + first_output * weights.rows * weights.inputs;
    for (std::size_t r = 0; r < weights.rows; ++r) {
        const Value* const input = rows[r] + offset;
        for (std::size_t i = 0; i < weights.inputs; ++i, values += conv_panel)
            for (std::size_t p = 0; p < pixels; ++p) {
                const float x = to_float(input[p * pixel_stride + i]);
                for (std::size_t o = 0; o < conv_panel; ++o) sums[p][o] = multiply_add(x, to_float(values[o]), sums[p][o]);
            }
    }
    const std::size_t count = (std::min)(conv_panel, weights.outputs - first_output);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < count; ++o) {
            const float ratio = ratios == nullptr ? 1.0F : ratios[p];
            const float value = multiply_add(sums[p][o], ratio, weights.bias[first_output + o]);
            const float activated = value > 0.0F ? value : value * weights.negative_slope;
            if constexpr (std::is_same_v<Result, bfloat16>)
                result[p * weights.outputs + first_output + o] = to_bfloat16(activated);
            else
                result[p * weights.outputs + first_output + o] = activated;
        }
}

template <class Value, class Result>
inline void conv_by_panels(const conv_weights<Value>& weights, const Value* const* rows, std::size_t pixel_stride,
                           std::size_t pixels, const float* ratios, Result* result) {
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

}  // namespace ldi::scalar
