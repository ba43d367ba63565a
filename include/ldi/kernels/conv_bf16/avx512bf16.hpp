// kernels/conv_bf16.hpp with AVX512_BF16: vdpbf16ps makes two products for each lane.
#pragma once

#include <ldi/kernels/detail/conv_avx512.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION::avx512bf16 {

using namespace avx512vnni;  // tiles and panels are those of all AVX-512 kernels

inline void pack_conv_bf16(conv_bf16_weights& packed, std::span<const bfloat16> weights, std::span<const float> bias) {
    detail::append_conv_panels<2>(packed, weights, bias, conv_half, conv_most_halves);
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct conv_bf16_store {
    [[gnu::always_inline]] static void store(float* to, __mmask16 existing, __m512 values) {
        _mm512_mask_storeu_ps(to, existing, values);
    }

    /// As to_bfloat16() rounds.
    [[gnu::always_inline]] static void store(bfloat16* to, __mmask16 existing, __m512 values) {
        const __m512i bits = _mm512_castps_si512(values);
        const __m512i last_bit = _mm512_and_si512(_mm512_srli_epi32(bits, 16), _mm512_set1_epi32(1));
        const __m512i rounded = _mm512_add_epi32(_mm512_add_epi32(bits, _mm512_set1_epi32(0x7FFF)), last_bit);
        _mm256_mask_storeu_epi16(to, existing, _mm512_cvtepi32_epi16(_mm512_srli_epi32(rounded, 16)));
    }
};

LDI_END_TARGET

LDI_BEGIN_TARGET(LDI_AVX512BF16_FEATURES)

struct conv_bf16_kernel {
    static constexpr std::size_t group = 2;  // inputs that are multiplied together

    template <std::size_t half, std::size_t... v>
    [[gnu::always_inline]] static void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums,
                                                    std::int32_t pair, const conv_lanes<sizeof...(v), half>& weights) {
        if constexpr (sizeof...(v) == 0) {
            sums.rest = _mm256_dpbf16_ps(sums.rest, (__m256bh)weights.rest, (__m256bh)_mm256_set1_epi32(pair));
        } else {
            __m512i x = _mm512_set1_epi32(pair);
            if constexpr (half == 1) asm("" : "+v"(x));  // clang would load it once more for the half vector
            ((sums.whole[v] = _mm512_dpbf16_ps(sums.whole[v], (__m512bh)weights.whole[v], (__m512bh)x)), ...);
            if constexpr (half == 1)
                sums.rest = _mm256_dpbf16_ps(sums.rest, (__m256bh)weights.rest, (__m256bh)_mm512_castsi512_si256(x));
        }
    }

    [[gnu::always_inline]] static std::int32_t load_pair(const bfloat16* values) {
        std::int32_t pair = 0;
        std::memcpy(&pair, values, sizeof pair);
        return pair;
    }

    template <class Result>
    [[gnu::noinline]] static void finish(const conv_tile_sums& sums, std::size_t vectors, std::size_t first_pixel,
                                         std::size_t pixels, const conv_panel_output<Result>& out) {
        finish_floats<conv_bf16_store>(sums, vectors, first_pixel, pixels, out);
    }

    template <std::size_t half, std::size_t... p, std::size_t... v>
    [[gnu::noinline]] static void tile(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                                       const conv_panel_input<bfloat16>& input, std::size_t first_pixel,
                                       conv_tile_sums& tile_sums) {
        conv_lanes<sizeof...(v), half> sums[sizeof...(p)] = {};
        constexpr std::size_t lanes = sizeof...(v) * conv_whole + half * conv_half;
        const std::size_t stride = input.pixel_stride, pairs = input.inputs / 2;
        const bfloat16* weights = input.weights;
        const std::size_t fetch = sizeof...(p) * stride / detail::groups_of(input.inputs, group);  // as with float32
        for (std::size_t r = 0; r < input.row_count; ++r) {
            const bfloat16* const x = input.rows[r] + first_pixel * stride;
            const bfloat16* next_tile = x + sizeof...(p) * stride;
            conv_tile_pointers<bfloat16, sizeof...(p)> pointers{{}, opaque(stride), opaque(3 * stride)};
            ((p % 4 == 0 ? void(pointers.every_fourth[p / 4] = opaque(x + p * stride)) : void()), ...);
            for (std::size_t i = 0; i < pairs; ++i) {
                const auto w = load_conv_lanes<half>(vectors, weights);
                _mm_prefetch(reinterpret_cast<const char*>(next_tile), _MM_HINT_T0);
                (multiply_add<half>(vectors, sums[p], load_pair(pointers.template at<p>()), w), ...);
                ((p % 4 == 0 ? void(pointers.every_fourth[p / 4] += group) : void()), ...);
                next_tile += fetch;
                weights += group * lanes;
            }
            if (input.inputs % 2 != 0) {  // what lies behind the last input is nobody's, perhaps not even a number
                const auto w = load_conv_lanes<half>(vectors, weights);
                (multiply_add<half>(vectors, sums[p], pointers.template at<p>()->bits, w), ...);
                weights += group * lanes;
            }
        }
        (store_conv_lanes<half>(vectors, sums[p], tile_sums.lanes + p * (sizeof...(v) + half) * conv_whole), ...);
    }
};

LDI_END_TARGET

/// Result: float or bfloat16.
template <class Result>
void conv_bf16(const conv_bf16_weights& weights, const bfloat16* const* rows, std::size_t pixel_stride, std::size_t pixels,
               const float* ratios, Result* result) {
    conv_panels<conv_bf16_kernel>(
        weights, conv_panel_input<bfloat16>{rows, weights.rows, weights.inputs, pixel_stride, weights.values.data()}, pixels,
        conv_panel_output<Result>{weights.bias.data(), ratios, weights.negative_slope, weights.outputs, weights.outputs, result});
}

}  // namespace ldi::avx512bf16

#endif
