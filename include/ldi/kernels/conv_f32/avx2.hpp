// kernels/conv_f32.hpp with AVX2 and FMA.
//
// The processor starts two fused multiply-adds per cycle, each with a latency of 4 cycles, so at least 8 independent sums are
// necessary to hide the latency. Tiles have 12 sums: 12, 6 or 4 pixels with 1, 2 or 3 vectors. Two loads can start per cycle. A
// tile of 12 pixels with one vector needs 13 loads for 12 multiply-adds, so the loads limit its speed.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

inline constexpr std::size_t conv_width = 8, conv_max_vectors = 3;

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m256* sums, const float* input,
                                                const __m256* weights) {
    const __m256 x = _mm256_set1_ps(*input);
    ((sums[v] = _mm256_fmadd_ps(x, weights[v], sums[v])), ...);
}

[[gnu::always_inline]] inline void store_outputs(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                                 __m256 values) {
    const __m256 finite = _mm256_max_ps(_mm256_set1_ps(out.lowest), values);
    const __m256 activated = _mm256_max_ps(_mm256_mul_ps(finite, _mm256_set1_ps(out.negative_slope)), finite);
    float* const to = out.values + pixel * out.stride + from;
    if (out.count >= from + conv_width) return _mm256_storeu_ps(to, activated);
    const int count = out.count > from ? static_cast<int>(out.count - from) : 0;
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    _mm256_maskstore_ps(to, _mm256_cmpgt_epi32(_mm256_set1_epi32(count), lane), activated);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void finish(std::index_sequence<v...>, const __m256* sums,
                                          const detail::conv_panel_output<float>& out, std::size_t pixel) {
    const __m256 ratio = _mm256_set1_ps(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
    (store_outputs(out, pixel, v * conv_width, _mm256_fmadd_ps(sums[v], ratio, _mm256_loadu_ps(out.bias + v * conv_width))), ...);
}

struct conv_f32_tiles {
    static constexpr std::size_t group = 1, width = conv_width, max_vectors = conv_max_vectors, rest_pixels = 4;
    static constexpr std::size_t pixels[] = {12, 6, 4};

    template <std::size_t... p, std::size_t... v>
    static void tile(std::index_sequence<p...>, std::index_sequence<v...> vectors, const detail::conv_panel_input<float>& input,
                     std::size_t first_pixel, const detail::conv_panel_output<float>& out) {
        __m256 sums[sizeof...(p) * sizeof...(v)] = {};
        const std::size_t stride = input.pixel_stride;
        const float* weights = input.weights;
        // number of values to prefetch per input, as in detail/conv_avx512.hpp
        const std::size_t fetch = sizeof...(p) * stride / input.inputs;
        for (std::size_t r = 0; r < input.row_count; ++r) {
            const float* x = input.rows[r] + first_pixel * stride;
            const float* next_tile = x + sizeof...(p) * stride;
            for (std::size_t i = 0; i < input.inputs; ++i) {
                const __m256 w[] = {_mm256_loadu_ps(weights + v * conv_width)...};
                _mm_prefetch(reinterpret_cast<const char*>(next_tile), _MM_HINT_T0);
                (multiply_add(vectors, sums + p * sizeof...(v), x + p * stride, w), ...);
                ++x;
                next_tile += fetch;
                weights += sizeof...(v) * conv_width;
            }
        }
        (finish(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
    }
};

#include <ldi/kernels/conv_f32/generic/conv_f32.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
