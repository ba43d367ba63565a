// kernels/depthwise_u8.hpp with vpdpbusd.
//
// The kernel interleaves the bytes of three rows: four bytes contain one channel of one column (the fourth has weight 0). One
// column of a window then costs one vpdpbusd for 16 channels. Each column is interleaved only once, in registers, and
// immediately added to all windows that contain it. Weights and the sums of incomplete windows (two at a time) stay in
// registers. 64 channels of a pixel cost 8 shuffles, 12 multiplications and 22 instructions of requantization.
//
// Channels are split into units of 64, 32 or 16. A unit with fewer than 64 channels fills its vectors from two or four
// stretches of the row (stretches.hpp).
#pragma once

#include <ldi/kernels/depthwise_u8/stretches.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

inline constexpr std::size_t depthwise_max_channels = 64;  ///< maximum per unit

inline void pack_depthwise_u8(depthwise_u8_data& packed, const detail::depthwise_source& source) {
    detail::pack_columns<depthwise_max_channels>(packed, source, detail::is_negated(packed.fast) ? -1 : 1);
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

/// Mask of the existing channels in each group of 16.
using depthwise_lanes = __mmask16;

inline depthwise_lanes existing_lanes(std::size_t channels) {
    return static_cast<__mmask16>(first_bytes(channels < 16 ? channels : 16));
}

/// Loads 64 bytes of one row, an equal part from each stretch.
template <std::size_t channels>
[[gnu::always_inline]] inline __m512i load_stretches(const detail::depthwise_position<64 / channels>& position, std::size_t row,
                                                     std::size_t offset, depthwise_lanes lanes) {
    if constexpr (channels == 64) {
        return _mm512_loadu_si512(position.find(row, 0, offset));
    } else if constexpr (channels == 32) {
        const __m256i low = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 0, offset))),
                      high = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 1, offset)));
        return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
    } else {
        const __m128i a = _mm_maskz_loadu_epi8(lanes, position.find(row, 0, offset)),
                      b = _mm_maskz_loadu_epi8(lanes, position.find(row, 1, offset)),
                      c = _mm_maskz_loadu_epi8(lanes, position.find(row, 2, offset)),
                      d = _mm_maskz_loadu_epi8(lanes, position.find(row, 3, offset));
        const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1),
                      high = _mm256_inserti128_si256(_mm256_castsi128_si256(c), d, 1);
        return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
    }
}

/// Stores results at one address per stretch.
template <std::size_t channels>
[[gnu::always_inline]] inline void store_stretches(std::uint8_t* const* to, std::size_t offset, depthwise_lanes lanes,
                                                   __m512i bytes) {
    if constexpr (channels == 64) {
        store(to[0] + offset, bytes);
    } else if constexpr (channels == 32) {
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to[0] + offset), _mm512_castsi512_si256(bytes));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to[1] + offset), _mm512_extracti64x4_epi64(bytes, 1));
    } else {
        _mm_mask_storeu_epi8(to[0] + offset, lanes, _mm512_castsi512_si128(bytes));
        _mm_mask_storeu_epi8(to[1] + offset, lanes, _mm512_extracti32x4_epi32(bytes, 1));
        _mm_mask_storeu_epi8(to[2] + offset, lanes, _mm512_extracti32x4_epi32(bytes, 2));
        _mm_mask_storeu_epi8(to[3] + offset, lanes, _mm512_extracti32x4_epi32(bytes, 3));
    }
}

#define LDI_LANES(operation) _mm512_##operation
#include <ldi/kernels/depthwise_u8/generic/vectors_x86.hpp>
#undef LDI_LANES

#include <ldi/kernels/depthwise_u8/generic/walk.hpp>

/// The weights of one unit.
struct depthwise_sums : depthwise_results {
    __m512i weights[12];
    const std::int32_t* bias;

    [[gnu::always_inline]] depthwise_sums(const std::int8_t* values, const std::int32_t* biases)
        : depthwise_sums(values, biases, std::make_index_sequence<12>{}) {}

    [[gnu::always_inline]] four_vectors start() const { return load_sums(bias); }
    template <std::size_t k>
    [[gnu::always_inline]] four_vectors add(const four_vectors& sum, const four_vectors& column) const {
        return {{_mm512_dpbusd_epi32(sum.v[0], column.v[0], weights[4 * k]),
                 _mm512_dpbusd_epi32(sum.v[1], column.v[1], weights[4 * k + 1]),
                 _mm512_dpbusd_epi32(sum.v[2], column.v[2], weights[4 * k + 2]),
                 _mm512_dpbusd_epi32(sum.v[3], column.v[3], weights[4 * k + 3])}};
    }

private:
    template <std::size_t... i>
    [[gnu::always_inline]] depthwise_sums(const std::int8_t* values, const std::int32_t* biases, std::index_sequence<i...>)
        : weights{_mm512_load_si512(values + i * 64)...}, bias(biases) {}
};

inline void depthwise_u8(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    depthwise_u8_units<depthwise_sums>(detail::depthwise_call(weights, rows, width, repeat, result));
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
