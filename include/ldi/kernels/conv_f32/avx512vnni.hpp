// kernels/conv_f32.hpp with AVX-512.
#pragma once

#include <ldi/kernels/detail/conv_avx512.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

inline constexpr detail::panel_layout conv_f32_layout{1, conv_half, conv_max_halves};

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct conv_f32_kernel {
    static constexpr std::size_t group = 1;  // inputs per multiplication

    [[gnu::always_inline]] static float load(const float* input) { return *input; }

    template <std::size_t half, std::size_t... v>
    [[gnu::always_inline]] static void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums, float input,
                                                    const conv_lanes<sizeof...(v), half>& weights) {
        if constexpr (sizeof...(v) == 0) {
            sums.rest = _mm256_fmadd_ps(_mm256_set1_ps(input), weights.rest, sums.rest);
        } else {
            __m512 x = _mm512_set1_ps(input);
            if constexpr (half == 1) asm("" : "+v"(x));  // or clang would load x again for the half vector
            ((sums.whole[v] = _mm512_fmadd_ps(x, weights.whole[v], sums.whole[v])), ...);
            if constexpr (half == 1) sums.rest = _mm256_fmadd_ps(_mm512_castps512_ps256(x), weights.rest, sums.rest);
        }
    }

    [[gnu::always_inline]] static void store(float* to, __mmask16 existing, __m512 values) {
        _mm512_mask_storeu_ps(to, existing, values);
    }

    [[gnu::noinline]] static void finish(const conv_tile_sums& sums, std::size_t vectors, std::size_t first_pixel,
                                         std::size_t pixels, const conv_panel_output<float>& out) {
        finish_floats<conv_f32_kernel>(sums, vectors, first_pixel, pixels, out);
    }

    template <std::size_t half, class Pixels, class Vectors>
    [[gnu::noinline]] static void tile(Pixels pixels, Vectors vectors, const conv_panel_input<float>& input,
                                       std::size_t first_pixel, conv_tile_sums& sums) {
        conv_tile<conv_f32_kernel, half>(pixels, vectors, input, first_pixel, sums);
    }
};

inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    conv_panels<conv_f32_kernel>(
        weights, conv_panel_input<float>{rows, weights.rows, weights.inputs, pixel_stride, weights.values.data()}, pixels,
        conv_panel_output<float>{weights.bias.data(), ratios, weights.negative_slope, weights.outputs, weights.outputs, result});
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
