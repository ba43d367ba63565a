// kernels/conv_u8.hpp with AVX2: vpmaddubsw adds two products in 16 bits, vpmaddwd two of these sums in 32.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION::avx2 {

inline constexpr std::size_t conv_u8_width = 8, conv_u8_most_vectors = 3, conv_u8_group = 4;

inline void pack_conv_u8(conv_u8_weights& packed, std::span<const std::int8_t> weights, std::span<const std::uint8_t> zero_points,
                         std::span<const float> scales, std::span<const float> bias) {
    detail::append_conv_u8_panels<conv_u8_group>(packed, weights, zero_points, scales, bias, conv_u8_width, conv_u8_most_vectors);
}

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

[[gnu::always_inline]] inline std::int32_t load_inputs(const std::uint8_t* input, std::size_t count) {
    std::int32_t four = 0;
    std::memcpy(&four, input, count);
    return four;
}

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m256i* sums, std::int32_t inputs,
                                                const __m256i* weights) {
    const __m256i x = _mm256_set1_epi32(inputs), ones = _mm256_set1_epi16(1);
    ((sums[v] = _mm256_add_epi32(sums[v], _mm256_madd_epi16(_mm256_maddubs_epi16(x, weights[v]), ones))), ...);
}

[[gnu::always_inline]] inline __m256i first_lanes(std::size_t count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}

[[gnu::always_inline]] inline void store_outputs(float* to, std::size_t count, __m256 values) {
    if (count >= conv_u8_width) return _mm256_storeu_ps(to, values);
    _mm256_maskstore_ps(to, first_lanes(count), values);
}
[[gnu::always_inline]] inline void store_outputs(std::uint8_t* to, std::size_t count, __m256 values) {
    const __m256 clamped = _mm256_min_ps(_mm256_max_ps(values, _mm256_setzero_ps()), _mm256_set1_ps(255.0F));
    const __m256i integers = _mm256_cvtps_epi32(clamped);
    const __m128i words = _mm_packus_epi32(_mm256_castsi256_si128(integers), _mm256_extracti128_si256(integers, 1));
    const __m128i bytes = _mm_packus_epi16(words, words);
    if (count >= conv_u8_width) return _mm_storeu_si64(to, bytes);
    std::uint8_t all[conv_u8_width];
    _mm_storeu_si64(all, bytes);
    std::memcpy(to, all, count);
}

template <class Result>
[[gnu::always_inline]] inline void finish_vector(const conv_u8_panel_output<Result>& out, std::size_t pixel, std::size_t from,
                                                 __m256i sums, __m256 ratio) {
    if (out.count <= from) return;
    const __m256i offsets = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(out.offsets + from));
    const __m256 exact = _mm256_cvtepi32_ps(_mm256_add_epi32(sums, offsets));
    const __m256 value =
        _mm256_fmadd_ps(exact, _mm256_mul_ps(_mm256_loadu_ps(out.scales + from), ratio), _mm256_loadu_ps(out.bias + from));
    const __m256 zero_point = _mm256_set1_ps(out.zero_point);
    const __m256 activated =
        _mm256_max_ps(_mm256_fmadd_ps(value, _mm256_set1_ps(out.negative_slope), zero_point), _mm256_add_ps(value, zero_point));
    store_outputs(out.values + pixel * out.stride + from, out.count - from, activated);
}

template <class Result, std::size_t... v>
[[gnu::always_inline]] inline void finish_pixel(std::index_sequence<v...>, const __m256i* sums,
                                                const conv_u8_panel_output<Result>& out, std::size_t pixel) {
    const __m256 ratio = _mm256_set1_ps(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
    (finish_vector(out, pixel, v * conv_u8_width, sums[v], ratio), ...);
}

template <class Result, std::size_t... p, std::size_t... v>
inline void conv_u8_tile(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                         const conv_panel_input<std::uint8_t>& input, std::size_t first_pixel,
                         const conv_u8_panel_output<Result>& out) {
    __m256i sums[sizeof...(p) * sizeof...(v)] = {};
    const std::size_t stride = input.pixel_stride;
    const std::uint8_t* weights = input.weights;
    for (std::size_t r = 0; r < input.row_count; ++r) {
        const std::uint8_t* x = input.rows[r] + first_pixel * stride;
        std::size_t rest = input.inputs;
        for (; rest >= conv_u8_group; rest -= conv_u8_group) {
            const __m256i w[] = {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(weights) + v)...};
            (multiply_add(vectors, sums + p * sizeof...(v), load_inputs(x + p * stride, conv_u8_group), w), ...);
            x += conv_u8_group;
            weights += sizeof...(v) * sizeof(__m256i);
        }
        if (rest != 0) {
            const __m256i w[] = {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(weights) + v)...};
            (multiply_add(vectors, sums + p * sizeof...(v), load_inputs(x + p * stride, rest), w), ...);
            weights += sizeof...(v) * sizeof(__m256i);
        }
    }
    (finish_pixel(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
}

template <std::size_t pixels, std::size_t vectors, class Result>
inline void conv_u8_panel(const conv_panel_input<std::uint8_t>& input, std::size_t first, std::size_t last,
                          const conv_u8_panel_output<Result>& out) {
    for (; first + pixels <= last; first += pixels)
        conv_u8_tile(std::make_index_sequence<pixels>{}, std::make_index_sequence<vectors>{}, input, first, out);
    if constexpr (pixels > 1)
        if (first < last) conv_u8_panel<(pixels > 4 ? 4 : pixels / 2), vectors>(input, first, last, out);
}

/// Result: float or std::uint8_t.
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const detail::panel_cut cut(weights.outputs, conv_u8_width, conv_u8_most_vectors);
    const auto* const values = reinterpret_cast<const std::uint8_t*>(weights.values.data());
    conv_panel_input<std::uint8_t> input{rows, weights.rows, weights.inputs, pixel_stride, values};
    conv_u8_panel_output<Result> out(weights, ratios, result);
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t vectors = cut.vectors_in(panel);
        switch (vectors) {
            case 1: conv_u8_panel<10, 1>(input, 0, pixels, out); break;
            case 2: conv_u8_panel<5, 2>(input, 0, pixels, out); break;
            default: conv_u8_panel<3, 3>(input, 0, pixels, out); break;
        }
        input.weights += weights.rows * detail::groups_of(weights.inputs, conv_u8_group) * vectors * sizeof(__m256i);
        out.skip(vectors * conv_u8_width);
    }
}

LDI_END_TARGET

}  // namespace ldi::avx2

#endif
