// kernels/depthwise_u8.hpp with vpmaddwd, 16 channels at a time.
//
// Rows are first widened to 16 bits and laid out column by column, the first two rows interleaved and the third with zeros; then
// each column of a window is two multiplications for 8 channels.
#pragma once

#include <ldi/kernels/detail/depthwise_columns.hpp>
#include <ldi/kernels/detail/depthwise_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi::avx2 {

inline constexpr std::size_t depthwise_block = 16, depthwise_slot = 64;  // a slot holds so many 16-bit values

inline std::size_t depthwise_blocks(const depthwise_u8_weights& weights) {
    return (weights.channels + depthwise_block - 1) / depthwise_block;
}

/// The first channel of a block: the last one overlaps the one before.
inline std::size_t block_start(std::size_t channels, std::size_t block) {
    if (channels < depthwise_block) return 0;
    return block * depthwise_block + depthwise_block <= channels ? block * depthwise_block : channels - depthwise_block;
}

/// Block by block, column by column of the window, as the slots are: rows 0 and 1 of half of the channels, of the other half,
/// then row 2 and nothing.
inline void pack_depthwise_u8(depthwise_u8_weights& packed, const detail::depthwise_source& source) {
    for (std::size_t b = 0; b < depthwise_blocks(packed); ++b) {
        std::size_t channel[depthwise_block];
        for (std::size_t i = 0; i < depthwise_block; ++i)
            channel[i] = block_start(packed.channels, b) + i % 8 / 4 * 8 + i / 8 * 4 + i % 4;
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t row = 0; row < 4; row += 2)
                for (std::size_t c : channel)
                    for (std::size_t r = row; r < row + 2; ++r)
                        packed.wide.push_back(
                            static_cast<std::int16_t>(r < 3 && c < packed.channels ? source.weight(c, r * 3 + column) : 0));
        for (std::size_t c : channel) packed.bias.push_back(c < packed.channels ? source.folded_bias(c) : 0);
    }
}

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

/// 16 channels, or as many as there are, in 16 bits each; `padding` where there is no row.
[[gnu::always_inline]] inline __m256i widen(const std::uint8_t* row, std::size_t offset, std::size_t channels,
                                            std::uint8_t padding) {
    if (row == nullptr) return _mm256_set1_epi16(padding);
    if (channels >= depthwise_block) return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(row + offset)));
    if (channels == 8) return _mm256_cvtepu8_epi16(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(row + offset)));
    alignas(16) std::uint8_t bytes[depthwise_block] = {};
    std::memcpy(bytes, row + offset, channels);
    return _mm256_cvtepu8_epi16(_mm_load_si128(reinterpret_cast<const __m128i*>(bytes)));
}

[[gnu::always_inline]] inline void fill_slot(__m256i a, __m256i b, __m256i c, std::int16_t* slot) {
    __m256i* const to = reinterpret_cast<__m256i*>(slot);
    _mm256_store_si256(to, _mm256_unpacklo_epi16(a, b));
    _mm256_store_si256(to + 1, _mm256_unpackhi_epi16(a, b));
    _mm256_store_si256(to + 2, _mm256_unpacklo_epi16(c, _mm256_setzero_si256()));
    _mm256_store_si256(to + 3, _mm256_unpackhi_epi16(c, _mm256_setzero_si256()));
}

/// One column of a window for half of the channels of a block.
template <std::size_t half>
[[gnu::always_inline]] inline __m256i depthwise_column(const std::int16_t* slot, const std::int16_t* weights) {
    const __m256i *const x = reinterpret_cast<const __m256i*>(slot) + half, *const w =
                                                                                reinterpret_cast<const __m256i*>(weights) + half;
    return _mm256_add_epi32(_mm256_madd_epi16(_mm256_load_si256(x), _mm256_load_si256(w)),
                            _mm256_madd_epi16(_mm256_load_si256(x + 2), _mm256_load_si256(w + 2)));
}

template <std::size_t half>
[[gnu::always_inline]] inline __m256i depthwise_sum(__m256i bias, const std::int16_t* left, const std::int16_t* middle,
                                                    const std::int16_t* right, const std::int16_t* weights) {
    const __m256i outer =
        _mm256_add_epi32(depthwise_column<half>(left, weights), depthwise_column<half>(right, weights + 2 * depthwise_slot));
    return _mm256_add_epi32(_mm256_add_epi32(bias, depthwise_column<half>(middle, weights + depthwise_slot)), outer);
}

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const std::size_t channels = weights.channels, result_width = (width * repeat - 1) / weights.stride + 1;
    const std::size_t most = detail::depthwise_columns::most_pixels(weights.stride, repeat);
    const std::size_t held = channels < depthwise_block ? channels : depthwise_block;
    const requantizer requantize(weights.fast);
    alignas(64) std::int16_t slots[detail::depthwise_columns::most_slots * depthwise_slot];
    for (std::size_t first = 0; first < result_width; first += most) {
        const std::size_t rest = result_width - first;
        const detail::depthwise_columns columns(first, rest < most ? rest : most, weights.stride, repeat);
        for (std::size_t block = 0; block < depthwise_blocks(weights); ++block) {
            const std::size_t start = block_start(channels, block);
            for (std::size_t s = 0; s < columns.slots; ++s) {
                const std::size_t column = columns.first_column + s;  // plus one
                const bool outside = column == 0 || column > width;
                const std::size_t offset = outside ? 0 : (column - 1) * channels + start;
                fill_slot(widen(outside ? nullptr : rows[0], offset, channels, weights.padding),
                          widen(outside ? nullptr : rows[1], offset, channels, weights.padding),
                          widen(outside ? nullptr : rows[2], offset, channels, weights.padding), slots + s * depthwise_slot);
            }
            const std::int16_t* const w = weights.wide.data() + block * 3 * depthwise_slot;
            const __m256i* const bias = reinterpret_cast<const __m256i*>(weights.bias.data() + block * depthwise_block);
            const __m256i low_bias = _mm256_load_si256(bias), high_bias = _mm256_load_si256(bias + 1);
            std::uint8_t* to = result + first * channels + start;
            const std::uint16_t* slot = columns.slot_of;
            for (std::size_t x = 0; x < columns.count; ++x, to += channels, slot += weights.stride) {
                const std::int16_t *const left = slots + slot[0] * depthwise_slot,
                                          *const middle = slots + slot[1] * depthwise_slot,
                                          *const right = slots + slot[2] * depthwise_slot;
                const __m256i low = requantize(depthwise_sum<0>(low_bias, left, middle, right, w)),
                              high = requantize(depthwise_sum<1>(high_bias, left, middle, right, w));
                // Each lane holds its 8 channels twice.
                store_first(to, _mm256_permute4x64_epi64(requantize.pack_lanes(low, high, low, high), 0x08), held);
            }
        }
    }
}

LDI_END_TARGET

}  // namespace ldi::avx2

#endif
