// kernels/depthwise_u8.hpp with vpmaddubsw and vpmaddwd.
//
// The kernel interleaves the bytes of three rows: four bytes contain one channel of one column (rows 0, 1, 2 and row 1 again).
// One column of a window then costs two multiplications and an addition for 8 channels. The weight of row 1 is split between
// its two places, so that vpmaddubsw cannot saturate (detail/unsaturated_pairs.hpp). If this does not suffice, the weights of a
// unit are split into several terms, whose products are added.
//
// Each column is interleaved only once, in registers, and immediately added to all windows that contain it.
#pragma once

#include <ldi/kernels/depthwise_u8/avx2_packing.hpp>
#include <ldi/kernels/depthwise_u8/stretches.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

/// One interleaved column of the window, or one sum for each of 32 channels.
struct depthwise_vectors {
    __m256i v[4];
};

/// Number of existing channels in each group of 16.
using depthwise_lanes = std::size_t;

inline depthwise_lanes existing_lanes(std::size_t channels) { return channels < 16 ? channels : 16; }

/// Reads `channels` channels of three rows at the same place of 32 / channels stretches (stretches.hpp).
template <std::size_t channels>
struct depthwise_rows {
    detail::depthwise_position<32 / channels> position;
    depthwise_lanes held;

    /// Loads 16 channels.
    [[gnu::always_inline]] __m128i load_half(const std::uint8_t* from) const {
        if (held == 16) return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
        if (held == 8) return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
        alignas(16) std::uint8_t bytes[16] = {};
        std::memcpy(bytes, from, held);
        return _mm_load_si128(reinterpret_cast<const __m128i*>(bytes));
    }
    /// Loads 32 bytes of one row: from one stretch, or 16 from each of two stretches.
    [[gnu::always_inline]] __m256i load(std::size_t row, std::size_t offset) const {
        if constexpr (channels == 32)
            return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 0, offset)));
        else
            return _mm256_inserti128_si256(_mm256_castsi128_si256(load_half(position.find(row, 0, offset))),
                                           load_half(position.find(row, 1, offset)), 1);
    }

    /// Loads and interleaves the column at `offset` bytes after the position.
    [[gnu::always_inline]] depthwise_vectors column(std::size_t offset) const {
        const __m256i a = load(0, offset), b = load(1, offset), c = load(2, offset);
        const __m256i ab_low = _mm256_unpacklo_epi8(a, b), ab_high = _mm256_unpackhi_epi8(a, b);
        const __m256i cb_low = _mm256_unpacklo_epi8(c, b), cb_high = _mm256_unpackhi_epi8(c, b);
        return {{_mm256_unpacklo_epi16(ab_low, cb_low), _mm256_unpackhi_epi16(ab_low, cb_low),
                 _mm256_unpacklo_epi16(ab_high, cb_high), _mm256_unpackhi_epi16(ab_high, cb_high)}};
    }
};

/// The weights of one unit.
template <bool has_further_terms>
struct depthwise_sums {
    const std::int8_t* weights;
    const std::int32_t* bias;
    std::size_t terms;

    [[gnu::always_inline]] depthwise_vectors start() const {
        const __m256i* const from = reinterpret_cast<const __m256i*>(bias);
        return {{_mm256_load_si256(from), _mm256_load_si256(from + 1), _mm256_load_si256(from + 2), _mm256_load_si256(from + 3)}};
    }
    template <std::size_t k>
    [[gnu::always_inline]] depthwise_vectors add(const depthwise_vectors& sum, const depthwise_vectors& column) const {
        depthwise_vectors result = sum;
        const std::int8_t* at = weights + k * 128;
        std::size_t rest = has_further_terms ? terms : 1;
        do {
            result.v[0] = add(result.v[0], column.v[0], at), result.v[1] = add(result.v[1], column.v[1], at + 32);
            result.v[2] = add(result.v[2], column.v[2], at + 64), result.v[3] = add(result.v[3], column.v[3], at + 96);
            at += 3 * 128;
        } while (has_further_terms && --rest > 0);
        return result;
    }

private:
    [[gnu::always_inline]] static __m256i add(__m256i sum, __m256i column, const std::int8_t* at) {
        const __m256i pairs = _mm256_maddubs_epi16(column, _mm256_load_si256(reinterpret_cast<const __m256i*>(at)));
        return _mm256_add_epi32(sum, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)));
    }
};

/// Stores results at one address per stretch.
template <std::size_t channels>
struct depthwise_result {
    std::uint8_t* at[32 / channels];
    depthwise_lanes held;
    requantizer requantize;

    [[gnu::always_inline]] void store(const depthwise_vectors& sums, std::size_t offset) const {
        const __m256i bytes =
            requantize.pack_lanes(requantize(sums.v[0]), requantize(sums.v[1]), requantize(sums.v[2]), requantize(sums.v[3]));
        if constexpr (channels == 32) {
            _mm256_storeu_si256(reinterpret_cast<__m256i*>(at[0] + offset), bytes);
        } else {
            store_first(at[0] + offset, bytes, held);
            store_first(at[1] + offset, _mm256_permute2x128_si256(bytes, bytes, 1), held);
        }
    }
};

#include <ldi/kernels/depthwise_u8/generic/walk.hpp>

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const detail::depthwise_call call(weights, rows, width, repeat, result);
    const std::int8_t* values = weights.narrow.data();
    const std::int32_t* bias = weights.bias.data();
    const std::uint32_t* terms = weights.order.data();
    for (std::size_t done = 0; done < weights.channels; bias += 32, ++terms) {
        const detail::depthwise_unit unit(weights.channels, done, depthwise_max_channels);
        if (*terms == 1)
            depthwise_u8_unit(call, depthwise_sums<false>{values, bias, 1}, unit);
        else
            depthwise_u8_unit(call, depthwise_sums<true>{values, bias, *terms}, unit);
        values += *terms * 3 * 128;
        done = unit.end();
    }
}

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
