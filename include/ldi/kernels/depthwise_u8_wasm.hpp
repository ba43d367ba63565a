// kernels/depthwise_u8.hpp with i32x4.dot_i16x8_s, 16 channels at a time.
//
// Rows are first widened to 16 bits and laid out column by column, enlarged already: the first two rows interleaved, and of the
// third row the column and the next one. So the 9 products of a window are 5 multiplications for 4 channels.
#pragma once

#include <ldi/kernels/detail/depthwise_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi::wasm_simd128 {

inline constexpr std::size_t depthwise_block = 16;
inline constexpr std::size_t depthwise_slot = 4 * depthwise_block;  // 16-bit values of one column
inline constexpr std::size_t depthwise_most_slots = 66;             // 8 KiB
inline constexpr std::size_t depthwise_dots = 5;                    // for each vector of 4 channels

inline std::size_t depthwise_blocks(const depthwise_u8_weights& weights) {
    return (weights.channels + depthwise_block - 1) / depthwise_block;
}

/// The first channel of a block: the last one overlaps the one before.
inline std::size_t block_start(std::size_t channels, std::size_t block) {
    if (channels < depthwise_block) return 0;
    return block * depthwise_block + depthwise_block <= channels ? block * depthwise_block : channels - depthwise_block;
}

/// Block by block, 4 channels by 4 channels: rows 0 and 1 of each column, then row 2 of columns 0 and 1, and of column 2 alone.
inline void pack_depthwise_u8(depthwise_u8_weights& packed, const detail::depthwise_source& source) {
    constexpr std::size_t none = depthwise_u8_weights::taps;
    constexpr std::size_t taps[depthwise_dots][2] = {{0, 3}, {1, 4}, {2, 5}, {6, 7}, {8, none}};
    for (std::size_t b = 0; b < depthwise_blocks(packed); ++b) {
        const std::size_t start = block_start(packed.channels, b), end = start + depthwise_block;
        for (std::size_t four = start; four < end; four += 4)
            for (const auto& pair : taps)
                for (std::size_t c = four; c < four + 4; ++c)
                    for (std::size_t tap : pair)
                        packed.wide.push_back(
                            static_cast<std::int16_t>(tap != none && c < packed.channels ? source.weight(c, tap) : 0));
        for (std::size_t c = start; c < end; ++c) packed.bias.push_back(c < packed.channels ? source.folded_bias(c) : 0);
    }
}

/// Three rows and what lies outside of them.
struct depthwise_rows {
    std::uint8_t outside[depthwise_block];
    const std::uint8_t* rows[3];
    std::size_t moves[3];  // all bits, or none for a row that is outside
    std::size_t channels, width, repeat;

    depthwise_rows(const depthwise_u8_weights& weights, const std::uint8_t* const from[3], std::size_t stored_width,
                   std::size_t repeated)
        : channels(weights.channels), width(stored_width), repeat(repeated) {
        std::memset(outside, weights.padding, sizeof outside);
        for (std::size_t r = 0; r < 3; ++r) {
            rows[r] = from[r] == nullptr ? outside : from[r];
            moves[r] = from[r] == nullptr ? 0 : ~std::size_t{0};
        }
    }

    /// 16 channels, or as many as there are.
    [[gnu::always_inline]] v128_t load(const std::uint8_t* from) const {
        if (channels >= depthwise_block) return wasm_v128_load(from);
        std::uint8_t bytes[depthwise_block] = {};
        std::memcpy(bytes, from, channels);
        return wasm_v128_load(bytes);
    }
};

/// One after the other the columns of the enlarged rows, for 16 channels.
struct depthwise_column {
    const depthwise_rows& rows;
    std::size_t column, repeated, offset;  // column plus one

    depthwise_column(const depthwise_rows& from, std::size_t first, std::size_t first_channel)
        : rows(from),
          column(first),
          repeated(first == 0 ? 0 : (first - 1) % from.repeat),
          offset((first == 0 ? 0 : (first - 1) / from.repeat) * from.channels + first_channel) {}

    [[gnu::always_inline]] v128_t row(std::size_t r) const {
        if (column == 0 || column > rows.width * rows.repeat) return wasm_v128_load(rows.outside);
        return rows.load(rows.rows[r] + (offset & rows.moves[r]));
    }
    [[gnu::always_inline]] void move_on() {
        if (column++ == 0 || ++repeated < rows.repeat) return;
        repeated = 0;
        offset += rows.channels;
    }
};

/// 16 channels of two rows or columns to pairs of 16-bit values.
[[gnu::always_inline]] inline void store_pairs(v128_t a, v128_t b, std::int16_t* to) {
    const v128_t low = wasm_i8x16_shuffle(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const v128_t high = wasm_i8x16_shuffle(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    wasm_v128_store(to, wasm_u16x8_extend_low_u8x16(low));
    wasm_v128_store(to + 8, wasm_u16x8_extend_high_u8x16(low));
    wasm_v128_store(to + 16, wasm_u16x8_extend_low_u8x16(high));
    wasm_v128_store(to + 24, wasm_u16x8_extend_high_u8x16(high));
}

inline void fill_slots(const depthwise_rows& rows, std::size_t first, std::size_t count, std::size_t first_channel,
                       std::int16_t* slot) {
    depthwise_column column(rows, first, first_channel);
    v128_t third = column.row(2);
    for (const std::int16_t* const end = slot + count * depthwise_slot; slot < end; slot += depthwise_slot) {
        store_pairs(column.row(0), column.row(1), slot);
        column.move_on();
        const v128_t next = column.row(2);
        store_pairs(third, next, slot + depthwise_slot / 2);
        third = next;
    }
}

/// The sums of 4 channels.
[[gnu::always_inline]] inline v128_t depthwise_sum(const std::int16_t* slot, const std::int16_t* weights, v128_t sums) {
    constexpr std::size_t third = depthwise_slot / 2;
    const auto dot = [slot, weights](std::size_t at, std::size_t w) {
        return wasm_i32x4_dot_i16x8(wasm_v128_load(slot + at), wasm_v128_load(weights + w * 8));
    };
    sums = wasm_i32x4_add(sums, dot(0, 0));
    sums = wasm_i32x4_add(sums, dot(depthwise_slot, 1));
    sums = wasm_i32x4_add(sums, dot(2 * depthwise_slot, 2));
    sums = wasm_i32x4_add(sums, dot(third, 3));
    return wasm_i32x4_add(sums, dot(2 * depthwise_slot + third, 4));
}

template <bool positive>
inline void depthwise_u8_row(const depthwise_u8_weights& weights, const depthwise_rows& rows, std::size_t result_width,
                             std::uint8_t* result) {
    const std::size_t channels = weights.channels, stride = weights.stride;
    const std::size_t held = channels < depthwise_block ? channels : depthwise_block;
    const std::size_t most = (depthwise_most_slots - 3) / stride + 1;
    const requantizer<positive> requantize(weights.fast);
    alignas(16) std::int16_t slots[depthwise_most_slots * depthwise_slot];
    for (std::size_t first = 0; first < result_width; first += most) {
        const std::size_t count = result_width - first < most ? result_width - first : most;
        for (std::size_t block = 0; block < depthwise_blocks(weights); ++block) {
            const std::size_t start = block_start(channels, block);
            fill_slots(rows, first * stride, (count - 1) * stride + 3, start, slots);
            const std::int16_t* const w = weights.wide.data() + block * 4 * depthwise_dots * 8;
            const std::int32_t* const bias = weights.bias.data() + block * depthwise_block;
            const std::int16_t* slot = slots;
            std::uint8_t* to = result + first * channels + start;
            for (std::size_t x = 0; x < count; ++x, slot += stride * depthwise_slot, to += channels) {
                const auto four = [&](std::size_t i) {
                    return requantize(depthwise_sum(slot + i * 8, w + i * depthwise_dots * 8, wasm_v128_load(bias + i * 4)));
                };
                store_first(to, narrow(four(0), four(1), four(2), four(3)), held);
            }
        }
    }
}

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const std::size_t result_width = (width * repeat - 1) / weights.stride + 1;
    const depthwise_rows from(weights, rows, width, repeat);
    static constexpr void (*row_functions[])(const depthwise_u8_weights&, const depthwise_rows&, std::size_t, std::uint8_t*) = {
        depthwise_u8_row<false>, depthwise_u8_row<true>};
    row_functions[weights.output.zero_point == 0](weights, from, result_width, result);
}

}  // namespace ldi::wasm_simd128

#endif
