// kernels/gemm_u8.hpp with vpdpbusd, which adds four products of a byte and a signed byte to each of 16 sums, exactly.
//
// An instruction has a latency of 5 cycles (Intel) or 4 (Zen 4), and two can start per cycle, so at least 10 independent sums are
// necessary to hide the latency. Tiles have 12 to 16 sums. A tile of 4 pixels and 4 vectors costs 8 loads for 16 multiplications;
// larger tiles are not faster.
#pragma once

#include <ldi/kernels/detail/lanes_avx512vnni.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

inline constexpr std::size_t gemm_lanes = 16, gemm_max_vectors = 4, gemm_tile_pixels[] = {12, 6, 4, 4};
using detail::gemm_group;
using gemm_panel = detail::gemm_panel_of<std::uint8_t, const std::int8_t*, gemm_group>;

inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    const detail::panel_layout panels{gemm_group, gemm_lanes, gemm_max_vectors};
    detail::append_weights(packed.narrow, packed, weights, weight_zero_point, sign,
                           packed.is_single_output() ? detail::single_output_layout(64) : panels);
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

using gemm_vector = __m512i;
[[gnu::always_inline]] inline __m512i load_bias(const std::int32_t* from) { return _mm512_loadu_si512(from); }

[[gnu::always_inline]] inline __m512i spread_four(const std::uint8_t* inputs) {
    std::int32_t four = 0;
    std::memcpy(&four, inputs, sizeof four);
    return _mm512_set1_epi32(four);
}

/// Multiply-adds one vector. If `half` is true, computes only its first 8 sums: Zen 4 needs two cycles for a 512-bit instruction.
template <bool half>
[[gnu::always_inline]] inline __m512i multiply_add(__m512i sums, __m512i inputs, __m512i weights) {
    if constexpr (half)
        return _mm512_castsi256_si512(
            _mm256_dpbusd_epi32(_mm512_castsi512_si256(sums), _mm512_castsi512_si256(inputs), _mm512_castsi512_si256(weights)));
    else
        return _mm512_dpbusd_epi32(sums, inputs, weights);
}

template <bool last_is_half, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m512i* sums, __m512i inputs,
                                                const __m512i* weights) {
    ((sums[v] = multiply_add < last_is_half && v + 1 == sizeof...(v) > (sums[v], inputs, weights[v])), ...);
}

/// Multiply-adds four inputs of every pixel and all vectors of weights.
template <bool last_is_half, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m512i* sums,
                                                const std::uint8_t* inputs, std::size_t stride, const std::int8_t* weights) {
    const __m512i w[] = {_mm512_load_si512(weights + v * gemm_lanes * gemm_group)...};
    (multiply_add<last_is_half>(vectors, sums + p * sizeof...(v), spread_four(inputs + p * stride), w), ...);
}

template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_pixel(const __m512i* sums, const Requantizer& requantize, std::size_t held,
                                               std::uint8_t* result) {
    const __m512i a = requantize(sums[0]);
    const __m512i b = vectors > 1 ? requantize(sums[vectors > 1 ? 1 : 0]) : a;
    const __m512i c = vectors > 2 ? requantize(sums[vectors > 2 ? 2 : 0]) : a;
    const __m512i d = vectors > 3 ? requantize(sums[vectors > 3 ? 3 : 0]) : c;
    _mm512_mask_storeu_epi8(result, first_bytes(held), gather_lanes(requantize.pack_lanes(a, b, c, d)));
}

template <class Requantizer>
[[gnu::always_inline]] inline void store_four(const __m512i* sums, const Requantizer& requantize, std::uint8_t* result) {
    const __m512i bytes =
        requantize.pack_lanes(requantize(sums[0]), requantize(sums[1]), requantize(sums[2]), requantize(sums[3]));
    _mm512_storeu_si512(result, gather_lanes(bytes));
}

template <class Requantizer, std::size_t... i>
[[gnu::always_inline]] inline void store_filled(std::index_sequence<i...>, const __m512i* sums, const Requantizer& requantize,
                                                std::uint8_t* result) {
    (store_four(sums + 4 * i, requantize, result + 64 * i), ...);
}

template <bool last_is_half>
struct gemm_kernel_of {
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_segment(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                   __m512i* sums, const std::uint8_t* x, const gemm_panel& panel,
                                                   const std::int8_t*& weights) {
        for (std::size_t g = 0; g < panel.groups; ++g) {
            multiply_add<last_is_half>(pixels, vectors, sums, x, panel.pixel_stride, weights);
            x += gemm_group;
            weights += sizeof...(v) * gemm_lanes * gemm_group;
        }
    }

    template <class Requantizer, std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void store(std::index_sequence<p...>, std::index_sequence<v...>, const __m512i* sums,
                                             const gemm_panel& panel, const Requantizer& requantize, std::uint8_t* result) {
        // If the layer has one panel and fills it, adjacent pixels' results are contiguous, and four vectors fill one store.
        constexpr bool can_fill = sizeof...(p) * sizeof...(v) % 4 == 0 && sizeof...(v) < 4 && !last_is_half;
        if constexpr (can_fill)
            if (panel.outputs == sizeof...(v) * gemm_lanes)
                return store_filled(std::make_index_sequence<sizeof...(p) * sizeof...(v) / 4>{}, sums, requantize, result);
        (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, panel.held, result + p * panel.outputs), ...);
    }
};

using gemm_kernel = gemm_kernel_of<false>;
using gemm_half_kernel = gemm_kernel_of<true>;

#include <ldi/kernels/gemm_u8/generic/rectifier_x86.hpp>
#include <ldi/kernels/gemm_u8/generic/walk.hpp>

inline constexpr std::size_t single_output_inputs = 64, single_output_pixels = 4;

[[gnu::always_inline]] inline __m512i add_inputs(__m512i sums, const std::uint8_t* from, const std::int8_t* weights) {
    return _mm512_dpbusd_epi32(sums, _mm512_loadu_si512(from), load(weights));
}
[[gnu::always_inline]] inline __m512i add_rest(__m512i sums, const std::uint8_t* from, std::size_t count,
                                               const std::int8_t* weights) {
    return _mm512_dpbusd_epi32(sums, _mm512_maskz_loadu_epi8(first_bytes(count), from), load(weights));
}
[[gnu::always_inline]] inline __m128i add_quarters(__m512i sums) {
    const __m256i half = _mm256_add_epi32(_mm512_castsi512_si256(sums), _mm512_extracti64x4_epi64(sums, 1));
    return _mm_add_epi32(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
}
[[gnu::always_inline]] inline void store_totals(const __m512i* sums, std::int32_t start, std::int32_t* to) {
    const __m128i low = _mm_hadd_epi32(add_quarters(sums[0]), add_quarters(sums[1]));
    const __m128i high = _mm_hadd_epi32(add_quarters(sums[2]), add_quarters(sums[3]));
    _mm_store_si128(reinterpret_cast<__m128i*>(to), _mm_add_epi32(_mm_hadd_epi32(low, high), _mm_set1_epi32(start)));
}

#include <ldi/kernels/gemm_u8/generic/single_output.hpp>

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    if (weights.is_single_output())
        return gemm_u8_single_output(weights, weights.narrow.data(), requantizer(weights.fast), segments, pixel_stride, pixels,
                                     result);
    gemm_u8_panels<rectifier, requantizer>(weights.outputs, weights.fast,
                                           gemm_panel(weights, weights.narrow.data(), segments, pixel_stride, pixels, result));
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
