// kernels/gemm_u8.hpp with vpdpbusd, which adds four products of a byte and a signed byte to each of 16 sums, exactly.
//
// Each sum waits 5 cycles (Intel) or 4 (Zen 4) for the one before it, and two instructions can start a cycle, so at least 10 sums
// have to be under way: tiles have 16 to 24. A tile of 6 pixels and 4 vectors loads 10 times for 24 multiplications; the loads
// are the second limit, and they favour wide tiles.
#pragma once

#include <ldi/kernels/detail/gemm_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::avx512vnni {

inline constexpr std::size_t gemm_lanes = 16, gemm_most_vectors = 4, gemm_group = 4;

/// A single output would use one lane of 16: its weights lie as the inputs do, segment by segment in whole vectors.
inline void pack_single_output(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    const std::size_t padded = (packed.inputs + 63) / 64 * 64;
    for (std::size_t s = 0; s < packed.segments; ++s)
        for (std::size_t i = 0; i < padded; ++i)
            packed.narrow.push_back(static_cast<std::int8_t>(
                i < packed.inputs ? sign * (weights[s * packed.inputs + i] - int{weight_zero_point}) : 0));
}

/// Panel by panel, segment by segment, four inputs by four inputs: vectors of 16 outputs x 4 inputs.
inline void pack_gemm_u8(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    if (packed.outputs == 1) return pack_single_output(packed, weights, weight_zero_point);
    const detail::panel_cut cut(packed.outputs, gemm_lanes, gemm_most_vectors);
    const std::size_t groups = (packed.inputs + gemm_group - 1) / gemm_group;
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t outputs = cut.vectors_in(panel) * gemm_lanes;
        for (std::size_t s = 0; s < packed.segments; ++s)
            for (std::size_t g = 0; g < groups; ++g)
                for (std::size_t o = first; o < first + outputs; ++o)
                    for (std::size_t i = g * gemm_group; i < (g + 1) * gemm_group; ++i) {
                        const bool exists = o < packed.outputs && i < packed.inputs;
                        const int weight =
                            exists ? weights[(o * packed.segments + s) * packed.inputs + i] - int{weight_zero_point} : 0;
                        packed.narrow.push_back(static_cast<std::int8_t>(sign * weight));
                    }
        first += outputs;
    }
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct gemm_tile_input {
    const std::uint8_t* const* segments;
    std::size_t segment_count, groups, pixel_stride;
};

[[gnu::always_inline]] inline __m512i spread_four(const std::uint8_t* inputs) {
    std::int32_t four = 0;
    std::memcpy(&four, inputs, sizeof four);
    return _mm512_set1_epi32(four);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m512i* sums, __m512i inputs,
                                                const __m512i* weights) {
    ((sums[v] = _mm512_dpbusd_epi32(sums[v], inputs, weights[v])), ...);
}

/// Four inputs of every pixel, with all vectors of weights.
template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m512i* sums,
                                                const std::uint8_t* inputs, std::size_t stride, const std::int8_t* weights) {
    const __m512i w[] = {_mm512_load_si512(weights + v * gemm_lanes * gemm_group)...};
    (multiply_add(vectors, sums + p * sizeof...(v), spread_four(inputs + p * stride), w), ...);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void copy(std::index_sequence<v...>, __m512i* to, const __m512i* from) {
    ((to[v] = from[v]), ...);
}

template <std::size_t vectors>
[[gnu::always_inline]] inline void store_pixel(const __m512i* sums, const requantizer& requantize, __mmask64 mask,
                                               std::uint8_t* result) {
    const __m512i a = requantize(sums[0]);
    const __m512i b = vectors > 1 ? requantize(sums[vectors > 1 ? 1 : 0]) : a;
    const __m512i c = vectors > 2 ? requantize(sums[vectors > 2 ? 2 : 0]) : a;
    const __m512i d = vectors > 3 ? requantize(sums[vectors > 3 ? 3 : 0]) : a;
    _mm512_mask_storeu_epi8(result, mask, swap_lanes(requantize.pack_lanes(a, b, c, d)));
}

[[gnu::always_inline]] inline void store_four(const __m512i* sums, const requantizer& requantize, std::uint8_t* result) {
    const __m512i bytes =
        requantize.pack_lanes(requantize(sums[0]), requantize(sums[1]), requantize(sums[2]), requantize(sums[3]));
    _mm512_storeu_si512(result, swap_lanes(bytes));
}

template <std::size_t... i>
[[gnu::always_inline]] inline void store_filled(std::index_sequence<i...>, const __m512i* sums, const requantizer& requantize,
                                                std::uint8_t* result) {
    (store_four(sums + 4 * i, requantize, result + 64 * i), ...);
}

template <std::size_t... p, std::size_t... v>
inline void gemm_u8_tile(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors, const gemm_tile_input& input,
                         std::size_t first_pixel, const std::int8_t* weights, const std::int32_t* bias,
                         const requantizer& requantize, std::size_t outputs, __mmask64 mask, std::uint8_t* result) {
    __m512i sums[sizeof...(p) * sizeof...(v)];
    const __m512i start[] = {_mm512_loadu_si512(bias + v * gemm_lanes)...};
    (copy(vectors, sums + p * sizeof...(v), start), ...);
    const std::size_t stride = input.pixel_stride;
    for (std::size_t s = 0; s < input.segment_count; ++s) {
        const std::uint8_t* x = input.segments[s] + first_pixel * stride;
        for (std::size_t g = 0; g < input.groups; ++g) {
            multiply_add(pixels, vectors, sums, x, stride, weights);
            x += gemm_group;
            weights += sizeof...(v) * gemm_lanes * gemm_group;
        }
    }
    // Where the outputs fill the panel, the pixels' results lie side by side, and four vectors at a time fill a store.
    constexpr bool can_fill = sizeof...(p) * sizeof...(v) % 4 == 0 && sizeof...(v) < 4;
    if constexpr (can_fill)
        if (outputs == sizeof...(v) * gemm_lanes)
            return store_filled(std::make_index_sequence<sizeof...(p) * sizeof...(v) / 4>{}, sums, requantize, result);
    (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, mask, result + p * outputs), ...);
}

template <std::size_t pixels, std::size_t vectors>
inline void gemm_u8_panel(const gemm_tile_input& input, std::size_t count, const std::int8_t* weights, const std::int32_t* bias,
                          const requantizer& requantize, std::size_t outputs, __mmask64 mask, std::uint8_t* result) {
    constexpr std::make_index_sequence<pixels> tile{};
    constexpr std::make_index_sequence<vectors> wide{};
    std::size_t p = 0;
    for (; p + pixels <= count; p += pixels)
        gemm_u8_tile(tile, wide, input, p, weights, bias, requantize, outputs, mask, result + p * outputs);
    if (p < count && count >= pixels) {  // the last tile overlaps the one before and gives the same values once more
        p = count - pixels;
        gemm_u8_tile(tile, wide, input, p, weights, bias, requantize, outputs, mask, result + p * outputs);
        return;
    }
    for (; p < count; ++p)
        gemm_u8_tile(std::index_sequence<0>{}, wide, input, p, weights, bias, requantize, outputs, mask, result + p * outputs);
}

/// The 16 sums of one pixel and one output, still to be added up.
[[gnu::always_inline]] inline __m512i single_output_sums(const gemm_u8_weights& weights, const std::uint8_t* const* segments,
                                                         std::size_t offset) {
    __m512i sums = _mm512_setzero_si512();
    const std::int8_t* w = weights.narrow.data();
    for (std::size_t s = 0; s < weights.segments; ++s)
        for (std::size_t i = 0; i < weights.inputs; i += 64, w += 64) {
            const __m512i x = _mm512_maskz_loadu_epi8(first_bytes(weights.inputs - i), segments[s] + offset + i);
            sums = _mm512_dpbusd_epi32(sums, x, _mm512_load_si512(w));
        }
    return sums;
}

[[gnu::always_inline]] inline __m128i add_quarters(__m512i sums) {
    const __m256i half = _mm256_add_epi32(_mm512_castsi512_si256(sums), _mm512_extracti64x4_epi64(sums, 1));
    return _mm_add_epi32(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
}

inline void gemm_u8_single_output(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                                  std::size_t pixels, std::uint8_t* result) {
    const requantizer requantize(weights.fast);
    const __m512i bias = _mm512_set1_epi32(weights.bias[0]);
    for (std::size_t first = 0; first < pixels; first += 16) {
        alignas(64) std::int32_t sums[16] = {};
        for (std::size_t i = 0; i < 16 && first + i < pixels; i += 4) {
            __m128i four[4];
            for (std::size_t p = 0; p < 4; ++p) {  // behind the last pixel, the last once more
                const std::size_t pixel = first + i + p < pixels ? first + i + p : pixels - 1;
                four[p] = add_quarters(single_output_sums(weights, segments, pixel * pixel_stride));
            }
            const __m128i pairs[2] = {_mm_hadd_epi32(four[0], four[1]), _mm_hadd_epi32(four[2], four[3])};
            _mm_store_si128(reinterpret_cast<__m128i*>(sums + i), _mm_hadd_epi32(pairs[0], pairs[1]));
        }
        const __m512i values = requantize(_mm512_add_epi32(_mm512_load_si512(sums), bias));
        const __m512i bytes = swap_lanes(requantize.pack_lanes(values, values, values, values));
        const std::size_t rest = pixels - first;
        _mm512_mask_storeu_epi8(result + first, first_bytes(rest < 16 ? rest : 16), bytes);
    }
}

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    if (weights.outputs == 1) return gemm_u8_single_output(weights, segments, pixel_stride, pixels, result);
    const detail::panel_cut cut(weights.outputs, gemm_lanes, gemm_most_vectors);
    const gemm_tile_input input{segments, weights.segments, (weights.inputs + gemm_group - 1) / gemm_group, pixel_stride};
    const requantizer requantize(weights.fast);
    const std::int8_t* values = weights.narrow.data();
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t vectors = cut.vectors_in(panel);
        const std::int32_t* const bias = weights.bias.data() + first;
        const std::size_t outputs = weights.outputs;
        const std::size_t rest = outputs - first, held = vectors * gemm_lanes;
        const __mmask64 mask = first_bytes(rest < held ? rest : held);
        std::uint8_t* const to = result + first;
        switch (vectors) {
            case 1: gemm_u8_panel<8, 1>(input, pixels, values, bias, requantize, outputs, mask, to); break;
            case 2: gemm_u8_panel<6, 2>(input, pixels, values, bias, requantize, outputs, mask, to); break;
            case 3: gemm_u8_panel<4, 3>(input, pixels, values, bias, requantize, outputs, mask, to); break;
            default: gemm_u8_panel<4, 4>(input, pixels, values, bias, requantize, outputs, mask, to); break;
        }
        first += held;
        values += input.segment_count * input.groups * held * gemm_group;
    }
}

LDI_END_TARGET

}  // namespace ldi::avx512vnni

#endif
