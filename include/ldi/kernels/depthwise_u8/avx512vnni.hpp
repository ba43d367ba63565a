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

/// Packs weights by unit (up to 64 channels), then by column of the window: 4 vectors of 16 channels x 4 rows each. Vector i
/// contains channels 4 i to 4 i + 3 of every 16, because unpacking interleaves the inputs in this order. Packing the four vectors
/// of sums restores the channels' order.
inline void pack_depthwise_u8(depthwise_u8_weights& packed, const detail::depthwise_source& source) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    for (std::size_t done = 0; done < packed.channels;) {
        const detail::depthwise_unit unit(packed.channels, done, depthwise_max_channels);
        std::size_t channel[64];
        for (std::size_t i = 0; i < 64; ++i) channel[i] = unit.first + (i % 16 / 4 * 16 + i / 16 * 4 + i % 4) % unit.channels;
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t c : channel)
                for (std::size_t row = 0; row < 4; ++row)
                    packed.narrow.push_back(
                        static_cast<std::int8_t>(row < 3 && c < packed.channels ? sign * source.weight(c, row * 3 + column) : 0));
        for (std::size_t c : channel) packed.bias.push_back(c < packed.channels ? sign * source.folded_bias(c) : 0);
        done = unit.end();
    }
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

/// One interleaved column of the window, or one sum for each of 64 channels.
struct depthwise_vectors {
    __m512i v[4];
};

/// Mask of the existing channels in each group of 16.
using depthwise_lanes = __mmask16;

inline depthwise_lanes existing_lanes(std::size_t channels) {
    return static_cast<__mmask16>(first_bytes(channels < 16 ? channels : 16));
}

/// Reads `channels` channels of three rows at the same place of 64 / channels stretches.
template <std::size_t channels>
struct depthwise_rows {
    detail::depthwise_position<64 / channels> position;
    depthwise_lanes mask;

    /// Loads 64 bytes of one row, an equal part from each stretch.
    [[gnu::always_inline]] __m512i load(std::size_t row, std::size_t offset) const {
        if constexpr (channels == 64) {
            return _mm512_loadu_si512(position.find(row, 0, offset));
        } else if constexpr (channels == 32) {
            const __m256i low = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 0, offset))),
                          high = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 1, offset)));
            return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
        } else {
            const __m128i a = _mm_maskz_loadu_epi8(mask, position.find(row, 0, offset)),
                          b = _mm_maskz_loadu_epi8(mask, position.find(row, 1, offset)),
                          c = _mm_maskz_loadu_epi8(mask, position.find(row, 2, offset)),
                          d = _mm_maskz_loadu_epi8(mask, position.find(row, 3, offset));
            const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(a), b, 1),
                          high = _mm256_inserti128_si256(_mm256_castsi128_si256(c), d, 1);
            return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
        }
    }

    /// Loads and interleaves the column at `offset` bytes after the position.
    [[gnu::always_inline]] depthwise_vectors column(std::size_t offset) const {
        const __m512i a = load(0, offset), b = load(1, offset), c = load(2, offset);
        const __m512i ab_low = _mm512_unpacklo_epi8(a, b), ab_high = _mm512_unpackhi_epi8(a, b);
        const __m512i c_low = _mm512_unpacklo_epi8(c, c), c_high = _mm512_unpackhi_epi8(c, c);
        return {{_mm512_unpacklo_epi16(ab_low, c_low), _mm512_unpackhi_epi16(ab_low, c_low),
                 _mm512_unpacklo_epi16(ab_high, c_high), _mm512_unpackhi_epi16(ab_high, c_high)}};
    }
};

/// The weights of one unit.
struct depthwise_sums {
    __m512i weights[12];
    const std::int32_t* bias;

    [[gnu::always_inline]] depthwise_sums(const std::int8_t* values, const std::int32_t* biases)
        : depthwise_sums(values, biases, std::make_index_sequence<12>{}) {}

    [[gnu::always_inline]] depthwise_vectors start() const {
        return {
            {_mm512_load_si512(bias), _mm512_load_si512(bias + 16), _mm512_load_si512(bias + 32), _mm512_load_si512(bias + 48)}};
    }
    template <std::size_t k>
    [[gnu::always_inline]] depthwise_vectors add(const depthwise_vectors& sum, const depthwise_vectors& column) const {
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

/// Stores results at one address per stretch.
template <std::size_t channels>
struct depthwise_result {
    std::uint8_t* at[64 / channels];
    depthwise_lanes mask;
    requantizer requantize;

    [[gnu::always_inline]] void store(const depthwise_vectors& sums, std::size_t offset) const {
        const __m512i bytes =
            requantize.pack_lanes(requantize(sums.v[0]), requantize(sums.v[1]), requantize(sums.v[2]), requantize(sums.v[3]));
        if constexpr (channels == 64) {
            _mm512_storeu_si512(at[0] + offset, bytes);
        } else if constexpr (channels == 32) {
            _mm256_storeu_si256(reinterpret_cast<__m256i*>(at[0] + offset), _mm512_castsi512_si256(bytes));
            _mm256_storeu_si256(reinterpret_cast<__m256i*>(at[1] + offset), _mm512_extracti64x4_epi64(bytes, 1));
        } else {
            _mm_mask_storeu_epi8(at[0] + offset, mask, _mm512_castsi512_si128(bytes));
            _mm_mask_storeu_epi8(at[1] + offset, mask, _mm512_extracti32x4_epi32(bytes, 1));
            _mm_mask_storeu_epi8(at[2] + offset, mask, _mm512_extracti32x4_epi32(bytes, 2));
            _mm_mask_storeu_epi8(at[3] + offset, mask, _mm512_extracti32x4_epi32(bytes, 3));
        }
    }
};

#include <ldi/kernels/depthwise_u8/generic/walk.hpp>

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const detail::depthwise_call call(weights, rows, width, repeat, result);
    const std::int8_t* values = weights.narrow.data();
    const std::int32_t* bias = weights.bias.data();
    for (std::size_t done = 0; done < weights.channels; values += 12 * 64, bias += 64) {
        const detail::depthwise_unit unit(weights.channels, done, depthwise_max_channels);
        depthwise_u8_unit(call, depthwise_sums(values, bias), unit);
        done = unit.end();
    }
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
