// kernels/depthwise_u8.hpp with vpmaddubsw and vpmaddwd.
//
// The kernel interleaves the bytes of three rows: four bytes contain one channel of one column (rows 0, 1, 2 and row 1 again).
// One column of a window then costs two multiplications and an addition for 8 channels. The weight of row 1 is split between
// its two places, so that vpmaddubsw cannot saturate (detail/unsaturated_pairs.hpp). If this does not suffice, packing splits
// the weights of a unit (a range of channels, stretches.hpp) into several terms, and the kernel adds the products of all terms.
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

/// Number of existing channels in each group of 16.
using depthwise_lanes = std::size_t;

inline depthwise_lanes existing_lanes(std::size_t channels) { return channels < 16 ? channels : 16; }

/// Loads 16 channels, or all channels if there are fewer.
[[gnu::always_inline]] inline __m128i load_half(const std::uint8_t* from, depthwise_lanes lanes) {
    if (lanes == 16) return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
    if (lanes == 8) return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
    alignas(16) std::uint8_t bytes[16] = {};
    std::memcpy(bytes, from, lanes);
    return _mm_load_si128(reinterpret_cast<const __m128i*>(bytes));
}

/// Loads 32 bytes of one row: from one stretch, or 16 from each of two stretches (stretches.hpp).
template <std::size_t channels>
[[gnu::always_inline]] inline __m256i load_stretches(const detail::depthwise_position<32 / channels>& position, std::size_t row,
                                                     std::size_t offset, depthwise_lanes lanes) {
    if constexpr (channels == 32)
        return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(position.find(row, 0, offset)));
    else
        return _mm256_inserti128_si256(_mm256_castsi128_si256(load_half(position.find(row, 0, offset), lanes)),
                                       load_half(position.find(row, 1, offset), lanes), 1);
}

/// Stores results at one address per stretch.
template <std::size_t channels>
[[gnu::always_inline]] inline void store_stretches(std::uint8_t* const* to, std::size_t offset, depthwise_lanes lanes,
                                                   __m256i bytes) {
    if constexpr (channels == 32) return store(to[0] + offset, bytes);
    store_first(to[0] + offset, bytes, lanes);
    store_first(to[1] + offset, _mm256_permute2x128_si256(bytes, bytes, 1), lanes);
}

#define LDI_LANES(operation) _mm256_##operation
#include <ldi/kernels/depthwise_u8/generic/vectors_x86.hpp>
#undef LDI_LANES

#include <ldi/kernels/depthwise_u8/generic/walk.hpp>

/// The weights of one unit.
template <bool has_further_terms>
struct depthwise_sums : depthwise_results {
    const std::int8_t* weights;
    const std::int32_t* bias;
    std::size_t terms;

    [[gnu::always_inline]] four_vectors start() const { return load_sums(bias); }
    template <std::size_t k>
    [[gnu::always_inline]] four_vectors add(const four_vectors& sum, const four_vectors& column) const {
        four_vectors result = sum;
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

inline void depthwise_u8(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const detail::depthwise_call call(weights, rows, width, repeat, result);
    const std::int8_t* values = weights.narrow.data();
    const std::int32_t* bias = weights.bias.data();
    const std::uint32_t* terms = weights.order.data();
    for (std::size_t done = 0; done < weights.channels; bias += 32, ++terms) {
        const detail::depthwise_unit unit(weights.channels, done, depthwise_max_channels);
        if (*terms == 1)
            depthwise_u8_unit(call, depthwise_sums<false>{{}, values, bias, 1}, unit);
        else
            depthwise_u8_unit(call, depthwise_sums<true>{{}, values, bias, *terms}, unit);
        values += *terms * 3 * 128;
        done = unit.end();
    }
}

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
