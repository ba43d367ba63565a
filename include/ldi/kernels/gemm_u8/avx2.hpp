// kernels/gemm_u8.hpp with vpmaddubsw, which adds two products of a byte and a signed byte in 16 bits, and vpmaddwd, which adds
// two of these sums in 32 bits. avx2_packing.hpp selects products that may share a 16-bit sum. 64 products cost 5 instructions.
// vpmaddwd on inputs widened to 16 bits never saturates, but costs 8 instructions. Only layers with a single output use this
// method.
#pragma once

#include <ldi/kernels/detail/lanes_avx2.hpp>
#include <ldi/kernels/gemm_u8/avx2_packing.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

/// A position in the weights of a layer: the order of the terms, and their values.
struct gemm_terms {
    const std::uint32_t* order;
    const std::int8_t* values;

    /// Advances to the next panel.
    void skip(std::size_t segment_count, std::size_t lanes) {
        for (std::size_t s = 0; s < segment_count; ++s) {
            const std::size_t terms = 2 * order[0] + order[1];
            order += 2 + terms;
            values += terms * lanes * gemm_group;
        }
    }
};

using gemm_panel = detail::gemm_panel_of<std::uint8_t, gemm_terms, gemm_group>;
using gemm_vector = __m256i;
[[gnu::always_inline]] inline __m256i load_bias(const std::int32_t* from) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

[[gnu::always_inline]] inline __m256i spread_four(const std::uint8_t* inputs) {
    std::int32_t four = 0;
    std::memcpy(&four, inputs, sizeof four);
    return _mm256_set1_epi32(four);
}

[[gnu::always_inline]] inline __m256i widen(__m256i sum, __m256i products) {
    return _mm256_add_epi32(sum, _mm256_madd_epi16(products, _mm256_set1_epi16(1)));
}

template <std::size_t... v>
[[gnu::always_inline]] inline void add_term(std::index_sequence<v...>, __m256i* sums, __m256i inputs, const __m256i* weights) {
    ((sums[v] = widen(sums[v], _mm256_maddubs_epi16(inputs, weights[v]))), ...);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void add_pair(std::index_sequence<v...>, __m256i* sums, __m256i a, __m256i b,
                                            const __m256i* a_weights, const __m256i* b_weights) {
    ((sums[v] = widen(sums[v], _mm256_add_epi16(_mm256_maddubs_epi16(a, a_weights[v]), _mm256_maddubs_epi16(b, b_weights[v])))),
     ...);
}

template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void add_term(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                            const std::uint8_t* x, std::size_t stride, const __m256i* weights) {
    const __m256i w[] = {_mm256_load_si256(weights + v)...};
    (add_term(vectors, sums + p * sizeof...(v), spread_four(x + p * stride), w), ...);
}

template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void add_pair(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                            const std::uint8_t* a, const std::uint8_t* b, std::size_t stride,
                                            const __m256i* weights) {
    const __m256i a_weights[] = {_mm256_load_si256(weights + v)...};
    const __m256i b_weights[] = {_mm256_load_si256(weights + sizeof...(v) + v)...};
    (add_pair(vectors, sums + p * sizeof...(v), spread_four(a + p * stride), spread_four(b + p * stride), a_weights, b_weights),
     ...);
}

/// Stores the results of four vectors: 4 pixels with 8 outputs each, or 2 pixels with 16.
///
/// outputs  distance between the results of adjacent pixels: the number of outputs of the layer
template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_four(const __m256i* sums, const Requantizer& requantize, std::uint8_t* result,
                                              std::size_t outputs) {
    const __m256i bytes =
        gather_lanes(requantize.pack_lanes(requantize(sums[0]), requantize(sums[1]), requantize(sums[2]), requantize(sums[3])));
    const __m128i low = _mm256_castsi256_si128(bytes), high = _mm256_extracti128_si256(bytes, 1);
    if constexpr (vectors == 2) {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(result), low);
        _mm_storeu_si128(reinterpret_cast<__m128i*>(result + outputs), high);
    } else {
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result), low);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + outputs), _mm_unpackhi_epi64(low, low));
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + 2 * outputs), high);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + 3 * outputs), _mm_unpackhi_epi64(high, high));
    }
}

template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_pixel(const __m256i* sums, const Requantizer& requantize, std::size_t held,
                                               std::uint8_t* result) {
    const __m256i a = requantize(sums[0]), b = vectors > 1 ? requantize(sums[vectors - 1]) : a;
    store_first(result, gather_lanes(requantize.pack_lanes(a, b, a, b)), held);
}

template <std::size_t vectors, class Requantizer, std::size_t... i>
[[gnu::always_inline]] inline void store_filled(std::index_sequence<i...>, const __m256i* sums, const Requantizer& requantize,
                                                std::uint8_t* result, std::size_t outputs) {
    (store_four<vectors>(sums + 4 * i, requantize, result + 4 / vectors * i * outputs, outputs), ...);
}

/// Stores the results of a tile.
struct gemm_results {
    template <class Panel, class Requantizer, std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void store(std::index_sequence<p...>, std::index_sequence<v...>, const __m256i* sums,
                                             const Panel& panel, const Requantizer& requantize, std::uint8_t* result) {
        constexpr std::size_t count = sizeof...(p) * sizeof...(v);
        if constexpr (count % 4 == 0)
            if (panel.held == sizeof...(v) * gemm_lanes)
                return store_filled<sizeof...(v)>(std::make_index_sequence<count / 4>{}, sums, requantize, result, panel.outputs);
        (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, panel.held, result + p * panel.outputs), ...);
    }
};

struct gemm_kernel : gemm_results {
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_segment(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                   __m256i* sums, const std::uint8_t* x, const gemm_panel& panel,
                                                   gemm_terms& weights) {
        const std::size_t stride = panel.pixel_stride;
        const std::uint32_t* order = weights.order;
        const __m256i* values = reinterpret_cast<const __m256i*>(weights.values);
        const std::uint32_t *const singles = order + 2 + 2 * order[0], *const end = singles + order[1];
        for (order += 2; order != singles; order += 2, values += 2 * sizeof...(v))
            add_pair(pixels, vectors, sums, x + order[0], x + order[1], stride, values);
        for (; order != end; ++order, values += sizeof...(v)) add_term(pixels, vectors, sums, x + *order, stride, values);
        weights = {order, reinterpret_cast<const std::int8_t*>(values)};
    }
};
using gemm_half_kernel = gemm_kernel;

#include <ldi/kernels/gemm_u8/generic/rectifier_x86.hpp>
#include <ldi/kernels/gemm_u8/generic/walk.hpp>

inline constexpr std::size_t single_output_inputs = 16, single_output_pixels = 1;

[[gnu::always_inline]] inline __m256i add_inputs(__m256i sums, const std::uint8_t* from, const std::int16_t* weights) {
    const __m256i inputs = _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
    return _mm256_add_epi32(sums, _mm256_madd_epi16(inputs, load(weights)));
}
[[gnu::always_inline]] inline void store_totals(const __m256i* sums, std::int32_t start, std::int32_t* to) {
    const __m128i half = _mm_add_epi32(_mm256_castsi256_si128(*sums), _mm256_extracti128_si256(*sums, 1));
    const __m128i pair = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4E));
    *to = start + _mm_cvtsi128_si32(_mm_add_epi32(pair, _mm_shuffle_epi32(pair, 0xB1)));
}

#include <ldi/kernels/gemm_u8/generic/single_output.hpp>

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    if (weights.is_single_output())
        return gemm_u8_single_output(weights, weights.wide.data(), requantizer(weights.fast), segments, pixel_stride, pixels,
                                     result);
    gemm_u8_panels<rectifier, requantizer>(
        weights.outputs, weights.fast,
        gemm_panel(weights, {weights.order.data(), weights.narrow.data()}, segments, pixel_stride, pixels, result));
}

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
