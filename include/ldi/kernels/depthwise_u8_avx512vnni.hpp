// kernels/depthwise_u8.hpp with vpdpbusd.
//
// The bytes of three rows are first interleaved, so that four bytes hold one channel of one column (the fourth has weight 0);
// then each of the three columns of a window is one vpdpbusd for 16 channels. Interleaving 64 channels takes 8 shuffles for 12
// multiplications; it pays because the sums of a channel need no shuffles any more. The interleaved columns stay in the
// first-level cache, the 12 vectors of weights in registers.
//
// Two arrangements: with many channels, blocks of 64 channels; with fewer than 64 and stride 1, rows are flat sequences of bytes
// in which the windows of a whole vector lie `channels` bytes apart, and the weights repeat with the period of both.
#pragma once

#include <ldi/kernels/detail/depthwise_columns.hpp>
#include <ldi/kernels/detail/depthwise_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <utility>

namespace ldi::avx512vnni {

inline constexpr std::size_t depthwise_block = 64, depthwise_slot = 256, depthwise_most_flat_blocks = 8;

inline bool is_flat(const depthwise_u8_weights& weights) {
    return weights.stride == 1 && weights.channels < depthwise_block &&
           weights.channels / std::gcd(weights.channels, depthwise_block) <= depthwise_most_flat_blocks;
}

inline std::size_t depthwise_blocks(const depthwise_u8_weights& weights) {
    return is_flat(weights) ? weights.channels / std::gcd(weights.channels, depthwise_block)
                            : (weights.channels + depthwise_block - 1) / depthwise_block;
}

/// The first channel of a block that is not flat: the last one overlaps the one before.
inline std::size_t block_start(std::size_t channels, std::size_t block) {
    if (channels < depthwise_block) return 0;
    return block * depthwise_block + depthwise_block <= channels ? block * depthwise_block : channels - depthwise_block;
}

/// Block by block, column by column of the window, 4 vectors of 16 channels x 4 rows; in the order in which interleave() leaves
/// the channels.
inline void pack_depthwise_u8(depthwise_u8_weights& packed, const detail::depthwise_source& source) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    const bool flat = is_flat(packed);
    for (std::size_t b = 0; b < depthwise_blocks(packed); ++b) {
        std::size_t channel[depthwise_block];
        for (std::size_t i = 0; i < depthwise_block; ++i) {
            const std::size_t vector = i / 16, lane = i % 16 / 4;
            channel[i] = flat ? (b * depthwise_block + i) % packed.channels
                              : block_start(packed.channels, b) + lane * 16 + vector * 4 + i % 4;
        }
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t c : channel)
                for (std::size_t row = 0; row < 4; ++row)
                    packed.narrow.push_back(
                        static_cast<std::int8_t>(row < 3 && c < packed.channels ? sign * source.weight(c, row * 3 + column) : 0));
        for (std::size_t c : channel) packed.bias.push_back(c < packed.channels ? sign * source.folded_bias(c) : 0);
    }
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

/// The three rows, at some position of each; a row outside the image is one vector of padding that never moves on.
struct depthwise_rows {
    alignas(64) std::uint8_t padding[64];
    const std::uint8_t* rows[3];
    std::size_t moves[3];

    depthwise_rows(const std::uint8_t* const from[3], std::uint8_t padding_value) {
        std::memset(padding, padding_value, sizeof padding);
        for (int r = 0; r < 3; ++r) {
            rows[r] = from[r] == nullptr ? padding : from[r];
            moves[r] = from[r] == nullptr ? 0 : ~std::size_t{0};
        }
    }
    const std::uint8_t* at(int r, std::size_t offset) const { return rows[r] + (offset & moves[r]); }
};

/// 64 channels of three rows to 64 x 4 bytes: in order if `ordered`, else as packing four vectors of sums puts them in order.
template <bool ordered>
[[gnu::always_inline]] inline void interleave(const depthwise_rows& rows, std::size_t offset, __mmask64 mask, std::uint8_t* to) {
    __m512i a = _mm512_maskz_loadu_epi8(mask, rows.at(0, offset)), b = _mm512_maskz_loadu_epi8(mask, rows.at(1, offset)),
            c = _mm512_maskz_loadu_epi8(mask, rows.at(2, offset));
    if (ordered) a = swap_lanes(a), b = swap_lanes(b), c = swap_lanes(c);
    const __m512i ab_low = _mm512_unpacklo_epi8(a, b), ab_high = _mm512_unpackhi_epi8(a, b);
    const __m512i c_low = _mm512_unpacklo_epi8(c, c), c_high = _mm512_unpackhi_epi8(c, c);
    _mm512_storeu_si512(to, _mm512_unpacklo_epi16(ab_low, c_low));
    _mm512_storeu_si512(to + 64, _mm512_unpackhi_epi16(ab_low, c_low));
    _mm512_storeu_si512(to + 128, _mm512_unpacklo_epi16(ab_high, c_high));
    _mm512_storeu_si512(to + 192, _mm512_unpackhi_epi16(ab_high, c_high));
}

/// The weights and biases of one block: of each column of the window 4 vectors.
struct depthwise_block_weights {
    __m512i columns[12], bias[4];

    [[gnu::always_inline]] depthwise_block_weights(const depthwise_u8_weights& weights, std::size_t block)
        : depthwise_block_weights(weights.narrow.data() + block * 12 * 64, weights.bias.data() + block * depthwise_block,
                                  std::make_index_sequence<12>{}, std::make_index_sequence<4>{}) {}

private:
    template <std::size_t... i, std::size_t... v>
    [[gnu::always_inline]] depthwise_block_weights(const std::int8_t* weights, const std::int32_t* biases,
                                                   std::index_sequence<i...>, std::index_sequence<v...>)
        : columns{_mm512_load_si512(weights + i * 64)...}, bias{_mm512_load_si512(biases + v * 16)...} {}
};

template <std::size_t v>
[[gnu::always_inline]] inline __m512i depthwise_sum(const depthwise_block_weights& w, const std::uint8_t* left,
                                                    const std::uint8_t* middle, const std::uint8_t* right) {
    __m512i sum = _mm512_dpbusd_epi32(w.bias[v], _mm512_loadu_si512(left + v * 64), w.columns[v]);
    sum = _mm512_dpbusd_epi32(sum, _mm512_loadu_si512(middle + v * 64), w.columns[4 + v]);
    return _mm512_dpbusd_epi32(sum, _mm512_loadu_si512(right + v * 64), w.columns[8 + v]);
}

[[gnu::always_inline]] inline __m512i depthwise_pixel(const depthwise_block_weights& w, const requantizer& requantize,
                                                      const std::uint8_t* left, const std::uint8_t* middle,
                                                      const std::uint8_t* right) {
    return requantize.pack_lanes(
        requantize(depthwise_sum<0>(w, left, middle, right)), requantize(depthwise_sum<1>(w, left, middle, right)),
        requantize(depthwise_sum<2>(w, left, middle, right)), requantize(depthwise_sum<3>(w, left, middle, right)));
}

inline void depthwise_u8_blocks(const depthwise_u8_weights& weights, const depthwise_rows& rows, std::size_t width,
                                std::size_t repeat, std::uint8_t* result) {
    const std::size_t channels = weights.channels, result_width = (width * repeat - 1) / weights.stride + 1;
    const std::size_t most = detail::depthwise_columns::most_pixels(weights.stride, repeat);
    const __mmask64 mask = first_bytes(channels);
    const requantizer requantize(weights.fast);
    alignas(64) std::uint8_t slots[detail::depthwise_columns::most_slots * depthwise_slot];
    for (std::size_t first = 0; first < result_width; first += most) {
        const std::size_t rest = result_width - first;
        const detail::depthwise_columns columns(first, rest < most ? rest : most, weights.stride, repeat);
        for (std::size_t block = 0; block < depthwise_blocks(weights); ++block) {
            const std::size_t start = block_start(channels, block);
            for (std::size_t s = 0; s < columns.slots; ++s) {
                const std::size_t column = columns.first_column + s;  // plus one
                if (column == 0 || column > width)
                    std::memset(slots + s * depthwise_slot, weights.padding, depthwise_slot);
                else
                    interleave<false>(rows, (column - 1) * channels + start, mask, slots + s * depthwise_slot);
            }
            const depthwise_block_weights w(weights, block);
            std::uint8_t* to = result + first * channels + start;
            const std::uint16_t* slot = columns.slot_of;
            for (std::size_t x = 0; x < columns.count; ++x, to += channels, slot += weights.stride)
                _mm512_mask_storeu_epi8(to, mask,
                                        depthwise_pixel(w, requantize, slots + slot[0] * depthwise_slot,
                                                        slots + slot[1] * depthwise_slot, slots + slot[2] * depthwise_slot));
        }
    }
}

/// Interleaves columns from .. to - 1 of the enlarged rows, one after the other.
inline void interleave_flat(const depthwise_rows& rows, std::size_t channels, std::size_t repeat, std::size_t from,
                            std::size_t to, std::uint8_t* values) {
    const std::size_t first = from / repeat, end = (to - 1) / repeat + 1, bytes = channels * 4;
    // Enlarged, the columns are first interleaved where the last of them will end up, and from there spread out.
    std::uint8_t* const stored = values + (to - from - (end - first)) * bytes;
    for (std::size_t i = first * channels; i < end * channels; i += depthwise_block)
        interleave<true>(rows, i, first_bytes(end * channels - i), stored + (i - first * channels) * 4);
    if (repeat == 1) return;
    std::size_t repeated = from % repeat;
    const std::uint8_t* column = stored;
    for (std::size_t x = from; x < to; ++x, values += bytes) {
        std::memmove(values, column, bytes);
        if (++repeated == repeat) repeated = 0, column += bytes;
    }
}

inline void depthwise_u8_flat(const depthwise_u8_weights& weights, const depthwise_rows& rows, std::size_t width,
                              std::size_t repeat, std::uint8_t* result) {
    constexpr std::size_t most_values = 4096;  // interleaved at a time: 16 KiB
    const std::size_t channels = weights.channels, blocks = depthwise_blocks(weights), period = blocks * depthwise_block;
    const std::size_t pixels_in_period = period / channels, result_width = width * repeat;
    const std::size_t most = (most_values / channels - 2) / pixels_in_period * pixels_in_period;
    const requantizer requantize(weights.fast);
    alignas(64) std::uint8_t values[(most_values + 2 * depthwise_block) * 4];
    for (std::size_t first = 0; first < result_width; first += most) {
        const std::size_t end = first + most < result_width ? first + most : result_width;
        const std::size_t from = first == 0 ? 0 : first - 1, to = end == result_width ? end : end + 1;
        std::uint8_t* const at = values + (first == 0 ? channels * 4 : 0);
        interleave_flat(rows, channels, repeat, from, to, at);
        if (first == 0) std::memset(values, weights.padding, channels * 4);
        if (end == result_width) std::memset(at + (to - from) * channels * 4, weights.padding, channels * 4);

        const std::size_t bytes = (end - first) * channels;
        for (std::size_t block = 0; block < blocks; ++block) {
            const depthwise_block_weights w(weights, block);
            for (std::size_t i = block * depthwise_block; i < bytes; i += period) {
                const std::uint8_t* const left = values + i * 4;
                const __m512i packed = depthwise_pixel(w, requantize, left, left + channels * 4, left + channels * 8);
                _mm512_mask_storeu_epi8(result + first * channels + i, first_bytes(bytes - i), swap_lanes(packed));
            }
        }
    }
}

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const depthwise_rows from(rows, weights.padding);
    if (is_flat(weights))
        depthwise_u8_flat(weights, from, width, repeat, result);
    else
        depthwise_u8_blocks(weights, from, width, repeat, result);
}

LDI_END_TARGET

}  // namespace ldi::avx512vnni

#endif
