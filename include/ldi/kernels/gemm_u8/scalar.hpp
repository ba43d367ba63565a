// kernels/gemm_u8.hpp in portable C++.
#pragma once

#include <ldi/kernels/gemm_u8/contract.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Number of outputs whose weights are adjacent for each input, so that compilers vectorize the loop over them.
inline constexpr std::size_t gemm_panel = 8;

inline void pack_gemm_u8(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    detail::append_weights(packed.wide, packed, weights, weight_zero_point, 1, {1, gemm_panel, 1});
}

/// Computes and requantizes `pixels` pixels with one panel of weights.
template <std::size_t pixels>
inline void gemm_u8_tile(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t first_pixel,
                         std::size_t pixel_stride, std::size_t first_output, std::uint8_t* result) {
    std::int32_t sums[pixels][gemm_panel];
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < gemm_panel; ++o) sums[p][o] = weights.bias[first_output + o];
    const std::int16_t* values = weights.wide.data() + first_output * weights.segments * weights.inputs;
    for (std::size_t s = 0; s < weights.segments; ++s) {
        const std::uint8_t* const input = segments[s] + first_pixel * pixel_stride;
        for (std::size_t i = 0; i < weights.inputs; ++i, values += gemm_panel)
            for (std::size_t p = 0; p < pixels; ++p) {
                const std::int16_t x = input[p * pixel_stride + i];
                for (std::size_t o = 0; o < gemm_panel; ++o) sums[p][o] += std::int32_t{x} * std::int32_t{values[o]};
            }
    }
    const std::size_t count = (std::min)(gemm_panel, weights.outputs - first_output);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < count; ++o)
            result[(first_pixel + p) * weights.outputs + first_output + o] = requantize(sums[p][o], weights.output);
}

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    constexpr std::size_t tile = 4;
    for (std::size_t o = 0; o < weights.outputs; o += gemm_panel) {
        std::size_t p = 0;
        for (; p + tile <= pixels; p += tile) gemm_u8_tile<tile>(weights, segments, p, pixel_stride, o, result);
        for (; p < pixels; ++p) gemm_u8_tile<1>(weights, segments, p, pixel_stride, o, result);
    }
}

}}}  // namespace ldi::scalar
