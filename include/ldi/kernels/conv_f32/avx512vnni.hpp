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

    struct finisher {
        __m512 slope, lowest, bias;

        [[gnu::always_inline]] finisher(const detail::conv_panel_output<float>& out, std::size_t from, __mmask16 existing)
            : slope(_mm512_set1_ps(out.negative_slope)),
              lowest(_mm512_set1_ps(out.lowest)),
              bias(_mm512_maskz_loadu_ps(existing, out.bias + from)) {}

        [[gnu::always_inline]] __m512 operator()(__m512 sums, __m512 ratio) const {
            const __m512 values = _mm512_max_ps(lowest, _mm512_fmadd_ps(sums, ratio, bias));
            return _mm512_max_ps(_mm512_mul_ps(values, slope), values);
        }
    };
};
using conv_f32_tiles = conv_tiles<conv_f32_sums>;

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
