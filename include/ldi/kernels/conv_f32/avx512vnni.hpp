// kernels/conv_f32.hpp with AVX-512.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/conv_avx512.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct conv_f32_sums {
    static constexpr std::size_t group = 1;  // inputs per multiplication

    [[gnu::always_inline]] static float load(const float* input) { return *input; }

    template <std::size_t half, std::size_t... v>
    [[gnu::always_inline]] static void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums, float input,
                                                    const conv_lanes<sizeof...(v), half>& weights) {
        if constexpr (sizeof...(v) == 0) {
            sums.rest = _mm256_fmadd_ps(_mm256_set1_ps(input), weights.rest, sums.rest);
        } else {
            __m512 x = _mm512_set1_ps(input);
            if constexpr (half == 1) asm("" : "+v"(x));  // otherwise, clang would load x again for the half vector
            ((sums.whole[v] = _mm512_fmadd_ps(x, weights.whole[v], sums.whole[v])), ...);
            if constexpr (half == 1) sums.rest = _mm256_fmadd_ps(_mm512_castps512_ps256(x), weights.rest, sums.rest);
        }
    }

    [[gnu::noinline]] static void finish(const conv_tile_sums& sums, std::size_t vectors, std::size_t first_pixel,
                                         std::size_t pixels, const detail::conv_panel_output<float>& out) {
        const __m512 slope = _mm512_set1_ps(out.negative_slope), lowest = _mm512_set1_ps(out.lowest);
        const float* const ratios = out.ratios == nullptr ? &conv_ratio_of_one : out.ratios + first_pixel;
        const std::size_t stride = out.stride, ratio_stride = out.ratios == nullptr ? 0 : 1;
        for (std::size_t v = 0; v < vectors; ++v) {
            const std::size_t from = v * conv_whole;
            const __mmask16 existing = existing_outputs(out, from);
            const __m512 bias = _mm512_maskz_loadu_ps(existing, out.bias + from);
            const float *sum = sums.lanes + from, *ratio = ratios;
            float* to = out.values + first_pixel * stride + from;
            for (std::size_t p = 0; p < pixels; ++p, sum += vectors * conv_whole, ratio += ratio_stride, to += stride) {
                const __m512 values = _mm512_max_ps(lowest, _mm512_fmadd_ps(_mm512_load_ps(sum), _mm512_set1_ps(*ratio), bias));
                _mm512_mask_storeu_ps(to, existing, _mm512_max_ps(_mm512_mul_ps(values, slope), values));
            }
        }
    }

    template <std::size_t half, class Pixels, class Vectors>
    [[gnu::noinline]] static void sum(Pixels pixels, Vectors vectors, const detail::conv_panel_input<float>& input,
                                      std::size_t first_pixel, conv_tile_sums& sums) {
        conv_tile<conv_f32_sums, half>(pixels, vectors, input, first_pixel, sums);
    }
};
using conv_f32_tiles = conv_tiles<conv_f32_sums>;

#include <ldi/kernels/conv_f32/generic/conv_f32.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
