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

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

struct conv_f32_set {
    static constexpr detail::panel_layout layout{1, 8, 3};
    static constexpr std::size_t pixels[] = {12, 6, 4}, rest_pixels = 4;
    using sums_type = __m256;
    using weights_type = __m256;

    [[gnu::always_inline]] static __m256 add_products(__m256 sums, __m256 inputs, __m256 weights) {
        return _mm256_fmadd_ps(inputs, weights, sums);
    }

    template <std::size_t... p, std::size_t... v, class Input>
    [[gnu::always_inline]] static void add_piece(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256* sums,
                                                 const float* inputs, const Input& from, std::size_t fetch,
                                                 const float*& weights) {
        const std::size_t stride = from.pixel_stride;
        const float* next_tile = inputs + sizeof...(p) * stride;
        for (std::size_t i = 0; i < from.inputs; ++i) {
            const __m256 w[] = {_mm256_loadu_ps(weights + v * layout.lanes)...};
            _mm_prefetch(reinterpret_cast<const char*>(next_tile), _MM_HINT_T0);
            (add_group<conv_f32_set>(vectors, sums + p * sizeof...(v), _mm256_set1_ps(inputs[p * stride]), w), ...);
            ++inputs;
            next_tile += fetch;
            weights += sizeof...(v) * layout.lanes;
        }
    }

    [[gnu::always_inline]] static void finish(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                              __m256 sums, float ratio) {
        const __m256 value = _mm256_fmadd_ps(sums, _mm256_set1_ps(ratio), _mm256_loadu_ps(out.bias + from));
        const __m256 finite = _mm256_max_ps(_mm256_set1_ps(out.lowest), value);
        const __m256 activated = _mm256_max_ps(_mm256_mul_ps(finite, _mm256_set1_ps(out.negative_slope)), finite);
        store_first(out.values + pixel * out.stride + from, activated, out.count - from);
    }
};
using conv_f32_tiles = conv_tiles<conv_f32_set>;

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
