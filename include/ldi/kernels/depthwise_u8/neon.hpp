// kernels/depthwise_u8.hpp with sdot, 16 channels at a time.
//
// The kernel first interleaves the bytes of three rows: four bytes contain one channel of one column (the fourth has weight 0).
// Each of the three columns of a window then costs one sdot for 4 channels. 16 channels of a pixel (144 products) cost 12 sdot,
// and 11 instructions to interleave the new column; widening multiplications (smlal) would cost 36 and 6. Requantization and
// stores bring the total to about 90.
#pragma once

#include <ldi/kernels/depthwise_u8/blocks.hpp>
#include <ldi/kernels/depthwise_u8/columns.hpp>
#include <ldi/kernels/depthwise_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_neon.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

using detail::block_start, detail::depthwise_block, detail::depthwise_blocks;
inline constexpr std::size_t depthwise_slot = 64;

/// Packs weights block by block, column by column of the window, in 4 vectors of 4 channels x 4 rows.
inline void pack_depthwise_u8(depthwise_u8_weights& packed, const detail::depthwise_source& source) {
    const int sign = detail::range_of(source.weights, source.weight_zero_point).max > 127 ? -1 : 1;
    packed.output.multiplier *= sign;
    detail::depthwise_source from = source;
    from.input_zero_point -= 128;  // see to_signed()
    for (std::size_t b = 0; b < depthwise_blocks(packed); ++b) {
        const std::size_t start = block_start(packed.channels, b);
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t c = start; c < start + depthwise_block; ++c)
                for (std::size_t row = 0; row < 4; ++row)
                    packed.narrow.push_back(static_cast<std::int8_t>(sign * from.weight(c, row * 3 + column)));
        for (std::size_t c = start; c < start + depthwise_block; ++c) packed.bias.push_back(sign * from.folded_bias(c));
    }
}

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

/// Loads 16 channels, or all channels if there are fewer. Returns `padding` for a row outside the image.
[[gnu::always_inline]] inline int8x16_t load_channels(const std::uint8_t* row, std::size_t offset, std::size_t channels,
                                                      std::uint8_t padding) {
    if (row == nullptr) return to_signed(vdupq_n_u8(padding));
    if (channels >= depthwise_block) return to_signed(vld1q_u8(row + offset));
    std::uint8_t bytes[depthwise_block] = {};
    std::memcpy(bytes, row + offset, channels);
    return to_signed(vld1q_u8(bytes));
}

/// Interleaves 16 channels of three rows to 4 bytes per channel. The fourth byte repeats the third row; its weight is 0.
[[gnu::always_inline]] inline void fill_slot(int8x16_t a, int8x16_t b, int8x16_t c, std::int8_t* slot) {
    const int16x8_t ab_low = vreinterpretq_s16_s8(vzip1q_s8(a, b)), ab_high = vreinterpretq_s16_s8(vzip2q_s8(a, b));
    const int16x8_t c_low = vreinterpretq_s16_s8(vzip1q_s8(c, c)), c_high = vreinterpretq_s16_s8(vzip2q_s8(c, c));
    vst1q_s8(slot, vreinterpretq_s8_s16(vzip1q_s16(ab_low, c_low)));
    vst1q_s8(slot + 16, vreinterpretq_s8_s16(vzip2q_s16(ab_low, c_low)));
    vst1q_s8(slot + 32, vreinterpretq_s8_s16(vzip1q_s16(ab_high, c_high)));
    vst1q_s8(slot + 48, vreinterpretq_s8_s16(vzip2q_s16(ab_high, c_high)));
}

/// Weights and biases of one block: 4 vectors for each column of the window.
struct depthwise_block_weights {
    int8x16_t columns[12];
    int32x4_t bias[4];

    [[gnu::always_inline]] depthwise_block_weights(const depthwise_u8_weights& weights, std::size_t block)
        : depthwise_block_weights(weights.narrow.data() + block * 3 * depthwise_slot,
                                  weights.bias.data() + block * depthwise_block, std::make_index_sequence<12>{},
                                  std::make_index_sequence<4>{}) {}

private:
    template <std::size_t... i, std::size_t... v>
    [[gnu::always_inline]] depthwise_block_weights(const std::int8_t* weights, const std::int32_t* biases,
                                                   std::index_sequence<i...>, std::index_sequence<v...>)
        : columns{load(weights + i * 16)...}, bias{load(biases + v * 4)...} {}
};

template <std::size_t v>
[[gnu::always_inline]] inline int32x4_t depthwise_sum(const depthwise_block_weights& w, const std::int8_t* left,
                                                      const std::int8_t* middle, const std::int8_t* right) {
    int32x4_t sum = add_products(w.bias[v], load(left + v * 16), w.columns[v]);
    sum = add_products(sum, load(middle + v * 16), w.columns[4 + v]);
    return add_products(sum, load(right + v * 16), w.columns[8 + v]);
}

template <class Requantizer>
inline void depthwise_u8(const depthwise_u8_weights& weights, const Requantizer& requantize, const std::uint8_t* const rows[3],
                         std::size_t width, std::size_t repeat, std::uint8_t* result) {
    const std::size_t channels = weights.channels, result_width = (width * repeat - 1) / weights.stride + 1;
    const std::size_t max_pixels = detail::depthwise_columns::max_pixels(weights.stride, repeat);
    const std::size_t held = channels < depthwise_block ? channels : depthwise_block;
    alignas(64) std::int8_t slot_values[detail::depthwise_columns::max_slots * depthwise_slot];
    for (std::size_t first = 0; first < result_width; first += max_pixels) {
        const std::size_t rest = result_width - first;
        const detail::depthwise_columns columns(first, rest < max_pixels ? rest : max_pixels, weights.stride, repeat);
        for (std::size_t block = 0; block < depthwise_blocks(weights); ++block) {
            const std::size_t start = block_start(channels, block);
            for (std::size_t s = 0; s < columns.slot_count; ++s) {
                const std::size_t column = columns.first_column + s;  // column index plus one
                const bool outside = column == 0 || column > width;
                const std::size_t offset = outside ? 0 : (column - 1) * channels + start;
                fill_slot(load_channels(outside ? nullptr : rows[0], offset, channels, weights.padding),
                          load_channels(outside ? nullptr : rows[1], offset, channels, weights.padding),
                          load_channels(outside ? nullptr : rows[2], offset, channels, weights.padding),
                          slot_values + s * depthwise_slot);
            }
            const depthwise_block_weights w(weights, block);
            std::uint8_t* to = result + first * channels + start;
            const std::uint16_t* slot = columns.slot_of;
            for (std::size_t x = 0; x < columns.count; ++x, to += channels, slot += weights.stride) {
                const std::int8_t *const left = slot_values + slot[0] * depthwise_slot,
                                         *const middle = slot_values + slot[1] * depthwise_slot,
                                         *const right = slot_values + slot[2] * depthwise_slot;
                store_first(to,
                            requantize(depthwise_sum<0>(w, left, middle, right), depthwise_sum<1>(w, left, middle, right),
                                       depthwise_sum<2>(w, left, middle, right), depthwise_sum<3>(w, left, middle, right)),
                            held);
            }
        }
    }
}

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    if (weights.output.zero_point == 0)
        depthwise_u8(weights, relu_requantizer(weights.output), rows, width, repeat, result);
    else
        depthwise_u8(weights, requantizer(weights.output), rows, width, repeat, result);
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
