// kernels/gemm_u8.hpp with vpmaddwd, which adds two products of 16 bits to each of 8 sums, exactly. (vpmaddubsw multiplies twice
// as much at a time but saturates: 255 * 127 * 2 does not fit into 16 bits.)
//
// Four inputs at a time are spread over the lanes and split into the even and the odd ones, which are 16-bit values where they
// stand: one AND, one shift for every pixel, shared by the vectors of the panel. Multiplication and addition take two of three
// vector ports a cycle; 12 sums are under way, the weights come from memory.
#pragma once

#include <ldi/kernels/detail/gemm_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::avx2 {

inline constexpr std::size_t gemm_lanes = 8, gemm_most_vectors = 3, gemm_group = 4;

/// A single output would use one lane of 8: its weights lie as the inputs do, segment by segment in whole vectors.
inline void pack_single_output(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const std::size_t padded = (packed.inputs + 15) / 16 * 16;
    for (std::size_t s = 0; s < packed.segments; ++s)
        for (std::size_t i = 0; i < padded; ++i)
            packed.wide.push_back(
                static_cast<std::int16_t>(i < packed.inputs ? weights[s * packed.inputs + i] - int{weight_zero_point} : 0));
}

/// Panel by panel, segment by segment, four inputs by four inputs, vector by vector: of 8 outputs the inputs 0 and 2, then of
/// the same 8 outputs the inputs 1 and 3.
inline void pack_gemm_u8(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    if (packed.outputs == 1) return pack_single_output(packed, weights, weight_zero_point);
    const detail::panel_cut cut(packed.outputs, gemm_lanes, gemm_most_vectors);
    const std::size_t groups = (packed.inputs + gemm_group - 1) / gemm_group;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t outputs = cut.vectors_in(panel) * gemm_lanes;
        for (std::size_t s = 0; s < packed.segments; ++s)
            for (std::size_t g = 0; g < groups; ++g)
                for (std::size_t v = first; v < first + outputs; v += gemm_lanes)
                    for (std::size_t odd = 0; odd < 2; ++odd)
                        for (std::size_t o = v; o < v + gemm_lanes; ++o)
                            for (std::size_t i = g * gemm_group + odd; i < (g + 1) * gemm_group; i += 2) {
                                const bool exists = o < packed.outputs && i < packed.inputs;
                                const int weight =
                                    exists ? weights[(o * packed.segments + s) * packed.inputs + i] - int{weight_zero_point} : 0;
                                packed.wide.push_back(static_cast<std::int16_t>(weight));
                            }
        first += outputs;
    }
}

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

struct gemm_tile_input {
    const std::uint8_t* const* segments;
    std::size_t segment_count, groups, pixel_stride;
};

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m256i* sums, const std::uint8_t* inputs,
                                                const __m256i* weights) {
    std::int32_t four = 0;
    std::memcpy(&four, inputs, sizeof four);
    const __m256i values = _mm256_set1_epi32(four);
    const __m256i even = _mm256_and_si256(values, _mm256_set1_epi32(0x00FF00FF)), odd = _mm256_srli_epi16(values, 8);
    ((sums[v] = _mm256_add_epi32(sums[v], _mm256_madd_epi16(even, _mm256_load_si256(weights + 2 * v)))), ...);
    ((sums[v] = _mm256_add_epi32(sums[v], _mm256_madd_epi16(odd, _mm256_load_si256(weights + 2 * v + 1)))), ...);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void copy(std::index_sequence<v...>, __m256i* to, const __m256i* from) {
    ((to[v] = from[v]), ...);
}

template <std::size_t vectors>
[[gnu::always_inline]] inline void store_pixel(const __m256i* sums, const requantizer& requantize, std::size_t held,
                                               std::uint8_t* result) {
    const __m256i a = requantize(sums[0]);
    const __m256i b = vectors > 1 ? requantize(sums[vectors > 1 ? 1 : 0]) : a;
    const __m256i c = vectors > 2 ? requantize(sums[vectors > 2 ? 2 : 0]) : a;
    store_first(result, gather_lanes(requantize.pack_lanes(a, b, c, a)), held);
}

template <std::size_t... p, std::size_t... v>
inline void gemm_u8_tile(std::index_sequence<p...>, std::index_sequence<v...> vectors, const gemm_tile_input& input,
                         std::size_t first_pixel, const std::int16_t* weights, const std::int32_t* bias,
                         const requantizer& requantize, std::size_t outputs, std::size_t held, std::uint8_t* result) {
    __m256i sums[sizeof...(p) * sizeof...(v)];
    const __m256i start[] = {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(bias + v * gemm_lanes))...};
    (copy(vectors, sums + p * sizeof...(v), start), ...);
    const std::size_t stride = input.pixel_stride;
    for (std::size_t s = 0; s < input.segment_count; ++s) {
        const std::uint8_t* x = input.segments[s] + first_pixel * stride;
        for (std::size_t g = 0; g < input.groups; ++g) {
            const __m256i* const w = reinterpret_cast<const __m256i*>(weights);
            (multiply_add(vectors, sums + p * sizeof...(v), x + p * stride, w), ...);
            x += gemm_group;
            weights += sizeof...(v) * gemm_lanes * gemm_group;
        }
    }
    (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, held, result + p * outputs), ...);
}

template <std::size_t pixels, std::size_t vectors>
inline void gemm_u8_panel(const gemm_tile_input& input, std::size_t count, const std::int16_t* weights, const std::int32_t* bias,
                          const requantizer& requantize, std::size_t outputs, std::size_t held, std::uint8_t* result) {
    constexpr std::make_index_sequence<pixels> tile{};
    constexpr std::make_index_sequence<vectors> wide{};
    std::size_t p = 0;
    for (; p + pixels <= count; p += pixels)
        gemm_u8_tile(tile, wide, input, p, weights, bias, requantize, outputs, held, result + p * outputs);
    if (p < count && count >= pixels) {  // the last tile overlaps the one before and gives the same values once more
        p = count - pixels;
        gemm_u8_tile(tile, wide, input, p, weights, bias, requantize, outputs, held, result + p * outputs);
        return;
    }
    for (; p < count; ++p)
        gemm_u8_tile(std::index_sequence<0>{}, wide, input, p, weights, bias, requantize, outputs, held, result + p * outputs);
}

/// The sum of one pixel and one output.
[[gnu::always_inline]] inline std::int32_t single_output_sum(const gemm_u8_weights& weights, const std::uint8_t* const* segments,
                                                             std::size_t offset) {
    __m256i sums = _mm256_setzero_si256();
    const std::int16_t* w = weights.wide.data();
    for (std::size_t s = 0; s < weights.segments; ++s) {
        const std::uint8_t* const x = segments[s] + offset;
        std::size_t i = 0;
        for (; i + 16 <= weights.inputs; i += 16, w += 16) {
            const __m256i inputs = _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(x + i)));
            sums = _mm256_add_epi32(sums, _mm256_madd_epi16(inputs, _mm256_load_si256(reinterpret_cast<const __m256i*>(w))));
        }
        if (i == weights.inputs) continue;
        alignas(16) std::uint8_t rest[16] = {};
        std::memcpy(rest, x + i, weights.inputs - i);
        const __m256i inputs = _mm256_cvtepu8_epi16(_mm_load_si128(reinterpret_cast<const __m128i*>(rest)));
        sums = _mm256_add_epi32(sums, _mm256_madd_epi16(inputs, _mm256_load_si256(reinterpret_cast<const __m256i*>(w))));
        w += 16;
    }
    const __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    const __m128i pair = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4E));
    return _mm_cvtsi128_si32(_mm_add_epi32(pair, _mm_shuffle_epi32(pair, 0xB1)));
}

inline void gemm_u8_single_output(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                                  std::size_t pixels, std::uint8_t* result) {
    const requantizer requantize(weights.fast);
    for (std::size_t first = 0; first < pixels; first += gemm_lanes) {
        alignas(32) std::int32_t sums[gemm_lanes] = {};
        const std::size_t count = pixels - first < gemm_lanes ? pixels - first : gemm_lanes;
        for (std::size_t p = 0; p < count; ++p)
            sums[p] = weights.bias[0] + single_output_sum(weights, segments, (first + p) * pixel_stride);
        const __m256i values = requantize(_mm256_load_si256(reinterpret_cast<const __m256i*>(sums)));
        store_first(result + first, gather_lanes(requantize.pack_lanes(values, values, values, values)), count);
    }
}

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    if (weights.outputs == 1) return gemm_u8_single_output(weights, segments, pixel_stride, pixels, result);
    const detail::panel_cut cut(weights.outputs, gemm_lanes, gemm_most_vectors);
    const gemm_tile_input input{segments, weights.segments, (weights.inputs + gemm_group - 1) / gemm_group, pixel_stride};
    const requantizer requantize(weights.fast);
    const std::int16_t* values = weights.wide.data();
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t vectors = cut.vectors_in(panel), outputs = weights.outputs;
        const std::int32_t* const bias = weights.bias.data() + first;
        const std::size_t all = vectors * gemm_lanes, held = outputs - first < all ? outputs - first : all;
        std::uint8_t* const to = result + first;
        switch (vectors) {
            case 1: gemm_u8_panel<8, 1>(input, pixels, values, bias, requantize, outputs, held, to); break;
            case 2: gemm_u8_panel<6, 2>(input, pixels, values, bias, requantize, outputs, held, to); break;
            default: gemm_u8_panel<4, 3>(input, pixels, values, bias, requantize, outputs, held, to); break;
        }
        first += all;
        values += input.segment_count * input.groups * all * gemm_group;
    }
}

LDI_END_TARGET

}  // namespace ldi::avx2

#endif
