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

    struct finisher {
        __m512 slope, zero_point, lowest, scales, bias;
        __m512i offsets;

        template <class Result>
        [[gnu::always_inline]] finisher(const detail::conv_u8_panel_output<Result>& out, std::size_t from, __mmask16 existing)
            : slope(_mm512_set1_ps(out.negative_slope)),
              zero_point(_mm512_set1_ps(out.zero_point)),
              lowest(_mm512_set1_ps(out.lowest)),
              scales(_mm512_maskz_loadu_ps(existing, out.scales + from)),
              bias(_mm512_maskz_loadu_ps(existing, out.bias + from)),
              offsets(_mm512_maskz_loadu_epi32(existing, out.offsets + from)) {}

        [[gnu::always_inline]] __m512 operator()(__m512 sums, __m512 ratio) const {
            const __m512 exact = _mm512_cvtepi32_ps(_mm512_add_epi32(_mm512_castps_si512(sums), offsets));
            const __m512 value = _mm512_max_ps(lowest, _mm512_fmadd_ps(exact, _mm512_mul_ps(scales, ratio), bias));
            return _mm512_max_ps(_mm512_fmadd_ps(value, slope, zero_point), _mm512_add_ps(value, zero_point));
        }
    };
};
using conv_u8_tiles = conv_tiles<conv_u8_sums>;

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
