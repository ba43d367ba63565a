// Loops of gemm_u8, conv_f32 and conv_u8 in portable C++.
#pragma once

#include <ldi/kernels/detail/panel_cut.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Number of outputs whose weights are adjacent for each input, so that compilers vectorize the loop over outputs.
inline constexpr std::size_t panel_outputs = 8;
inline constexpr detail::panel_layout panels{1, panel_outputs, 1};

/// Returns a * b + c, fused on targets with an instruction for it. Without this function, the compiler would fuse
/// multiplication and addition in some tiles only, and the bits of a pixel's result would depend on the pixel's tile.
inline float multiply_add(float a, float b, float c) {
#if defined(__FP_FAST_FMAF) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return std::fma(a, b, c);
#else
    return a * b + c;
#endif
}
inline std::int32_t multiply_add(std::int16_t a, std::int16_t b, std::int32_t c) { return std::int32_t{a} * std::int32_t{b} + c; }

/// Computes `pixels` pixels with one panel of weights.
template <std::size_t pixels, class Value, class Weight, class Start, class Store>
void compute_tile(const detail::weight_shape& shape, const Value* const* pieces, std::size_t first_pixel,
                  std::size_t pixel_stride, const Weight* weights, Start start, std::size_t first_output, Store store) {
    decltype(start(0)) sums[pixels][panel_outputs];
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < panel_outputs; ++o) sums[p][o] = start(first_output + o);
    weights += first_output * shape.pieces * shape.inputs;
    for (std::size_t piece = 0; piece < shape.pieces; ++piece) {
        const Value* const input = pieces[piece] + first_pixel * pixel_stride;
        for (std::size_t i = 0; i < shape.inputs; ++i, weights += panel_outputs)
            for (std::size_t p = 0; p < pixels; ++p) {
                const auto x = input[p * pixel_stride + i];
                for (std::size_t o = 0; o < panel_outputs; ++o) sums[p][o] = multiply_add(x, weights[o], sums[p][o]);
            }
    }
    const std::size_t count = (std::min)(panel_outputs, shape.outputs - first_output);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < count; ++o) store(first_pixel + p, first_output + o, sums[p][o]);
}

/// Computes all outputs of all pixels.
///
/// pieces  addresses of the first pixel's pieces
/// start   start(output) returns the start value of a sum; also called for the outputs that pad the last panel
/// store   store(pixel, output, sum) converts a sum to a result and stores it
template <class Value, class Weight, class Start, class Store>
void compute_tiles(const detail::weight_shape& shape, const Value* const* pieces, std::size_t pixel_stride, std::size_t pixels,
                   const Weight* weights, Start start, Store store) {
    constexpr std::size_t tile = 4;
    for (std::size_t o = 0; o < shape.outputs; o += panel_outputs) {
        std::size_t p = 0;
        for (; p + tile <= pixels; p += tile) compute_tile<tile>(shape, pieces, p, pixel_stride, weights, start, o, store);
        for (; p < pixels; ++p) compute_tile<1>(shape, pieces, p, pixel_stride, weights, start, o, store);
    }
}

}}}  // namespace ldi::scalar
