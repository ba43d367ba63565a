// kernels/conv_u8.hpp with AVX-512 VNNI: vpdpbusd computes four products per lane.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/conv_avx512.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct conv_u8_sums {
    static constexpr std::size_t group = 4;  // inputs per multiplication

    [[gnu::always_inline]] static std::int32_t load(const std::uint8_t* input) { return load_rest(input, group); }

    [[gnu::always_inline]] static std::int32_t load_rest(const std::uint8_t* input, std::size_t count) {
        std::int32_t four = 0;
        std::memcpy(&four, input, count);
        return four;
    }

    /// Adds the products of one group. Lanes contain integers, although their type is float.
    template <std::size_t half, std::size_t... v>
    [[gnu::always_inline]] static void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums,
                                                    std::int32_t inputs, const conv_lanes<sizeof...(v), half>& weights) {
        __m512i x = _mm512_set1_epi32(inputs);
        // Hides the origin of x, because clang would load it again for the half vector.
        if constexpr (half == 1 && sizeof...(v) > 0) asm("" : "+v"(x));
        ((sums.whole[v] = _mm512_castsi512_ps(
              _mm512_dpbusd_epi32(_mm512_castps_si512(sums.whole[v]), x, _mm512_castps_si512(weights.whole[v])))),
         ...);
        if constexpr (half == 1)
            sums.rest = _mm256_castsi256_ps(_mm256_dpbusd_epi32(_mm256_castps_si256(sums.rest), _mm512_castsi512_si256(x),
                                                                _mm256_castps_si256(weights.rest)));
    }

    [[gnu::always_inline]] static void store(float* to, __mmask16 existing, __m512 values) {
        _mm512_mask_storeu_ps(to, existing, values);
    }
    [[gnu::always_inline]] static void store(std::uint8_t* to, __mmask16 existing, __m512 values) {
        const __m512 clamped = _mm512_min_ps(_mm512_max_ps(values, _mm512_setzero_ps()), _mm512_set1_ps(255.0F));
        _mm_mask_storeu_epi8(to, existing, _mm512_cvtepi32_epi8(_mm512_cvtps_epi32(clamped)));
    }

    template <class Result>
    [[gnu::noinline]] static void finish(const conv_tile_sums& sums, std::size_t vectors, std::size_t first_pixel,
                                         std::size_t pixels, const detail::conv_u8_panel_output<Result>& out) {
        const __m512 slope = _mm512_set1_ps(out.negative_slope), zero_point = _mm512_set1_ps(out.zero_point);
        const __m512 lowest = _mm512_set1_ps(out.lowest);
        const float* const ratios = out.ratios == nullptr ? &conv_ratio_of_one : out.ratios + first_pixel;
        const std::size_t stride = out.stride, ratio_stride = out.ratios == nullptr ? 0 : 1;
        for (std::size_t v = 0; v < vectors; ++v) {
            const std::size_t from = v * conv_whole;
            const __mmask16 existing = existing_outputs(out, from);
            const __m512i offsets = _mm512_maskz_loadu_epi32(existing, out.offsets + from);
            const __m512 scales = _mm512_maskz_loadu_ps(existing, out.scales + from);
            const __m512 bias = _mm512_maskz_loadu_ps(existing, out.bias + from);
            const float *sum = sums.lanes + from, *ratio = ratios;
            Result* to = out.values + first_pixel * stride + from;
            for (std::size_t p = 0; p < pixels; ++p, sum += vectors * conv_whole, ratio += ratio_stride, to += stride) {
                const __m512 exact = _mm512_cvtepi32_ps(_mm512_add_epi32(_mm512_load_si512(sum), offsets));
                const __m512 scaled = _mm512_fmadd_ps(exact, _mm512_mul_ps(scales, _mm512_set1_ps(*ratio)), bias);
                const __m512 value = _mm512_max_ps(lowest, scaled);
                const __m512 activated =
                    _mm512_max_ps(_mm512_fmadd_ps(value, slope, zero_point), _mm512_add_ps(value, zero_point));
                store(to, existing, activated);
            }
        }
    }

    template <std::size_t half, class Pixels, class Vectors>
    [[gnu::noinline]] static void sum(Pixels pixels, Vectors vectors, const detail::conv_panel_input<std::uint8_t>& input,
                                      std::size_t first_pixel, conv_tile_sums& sums) {
        conv_tile<conv_u8_sums, half>(pixels, vectors, input, first_pixel, sums);
    }
};
using conv_u8_tiles = conv_tiles<conv_u8_sums>;

#include <ldi/kernels/conv_u8/generic/conv_u8.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
