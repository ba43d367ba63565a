// kernels/depthwise_u8.hpp with i32x4.dot_i16x8_s, 16 channels at a time.
//
// The kernel first upsamples the rows, widens them to 16 bits, and stores them column by column. It interleaves the first two
// rows with each other, and each column of the third row with the next column of the same row. The 9 products of a window then
// cost 5 multiplications for 4 channels.
//
// The loop of generic/walk.hpp would be slower here. It interleaves each column separately, which would cost 6 multiplications.
// It also keeps two windows and a column of 16 channels in registers: 12 of the 15 that V8 allocates, even without weights and
// constants.
#pragma once

#include <ldi/kernels/depthwise_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

inline constexpr std::size_t depthwise_block = 16;                  // channels
inline constexpr std::size_t depthwise_slot = 4 * depthwise_block;  // 16-bit values of one column
inline constexpr std::size_t depthwise_max_slots = 66;              // 8.25 KiB
inline constexpr std::size_t depthwise_dots = 5;                    // per vector of 4 channels

inline std::size_t depthwise_blocks(const depthwise_u8_data& weights) {
    return (weights.channels + depthwise_block - 1) / depthwise_block;
}

/// First channel of a block. The last block may overlap the one before it, so that every block is full.
inline std::size_t block_start(std::size_t channels, std::size_t block) {
    if (channels < depthwise_block) return 0;
    return block * depthwise_block + depthwise_block <= channels ? block * depthwise_block : channels - depthwise_block;
}

/// Packs weights block by block, in groups of 4 channels: rows 0 and 1 of each column of the window, then row 2 of columns 0 and
/// 1, then row 2 of column 2.
inline void pack_depthwise_u8(depthwise_u8_data& packed, const detail::depthwise_source& source) {
    constexpr std::size_t none = depthwise_u8_data::taps;
    constexpr std::size_t taps[depthwise_dots][2] = {{0, 3}, {1, 4}, {2, 5}, {6, 7}, {8, none}};
    for (std::size_t b = 0; b < depthwise_blocks(packed); ++b) {
        const std::size_t start = block_start(packed.channels, b), end = start + depthwise_block;
        for (std::size_t four = start; four < end; four += 4)
            for (const auto& pair : taps)
                for (std::size_t c = four; c < four + 4; ++c)
                    for (std::size_t tap : pair) packed.wide.push_back(static_cast<std::int16_t>(source.weight(c, tap)));
        for (std::size_t c = start; c < end; ++c) packed.bias.push_back(source.folded_bias(c));
    }
}

/// Interleaves 16 channels of two rows or columns into pairs of 16-bit values.
[[gnu::always_inline]] inline void store_pairs(v128_t a, v128_t b, std::int16_t* to) {
    const v128_t low = wasm_i8x16_shuffle(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const v128_t high = wasm_i8x16_shuffle(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    wasm_v128_store(to, wasm_u16x8_extend_low_u8x16(low));
    wasm_v128_store(to + 8, wasm_u16x8_extend_high_u8x16(low));
    wasm_v128_store(to + 16, wasm_u16x8_extend_low_u8x16(high));
    wasm_v128_store(to + 24, wasm_u16x8_extend_high_u8x16(high));
}

/// Writes columns to consecutive slots. Also overwrites the second half of the slot before the first one.
struct slot_writer {
    std::int16_t* slot;
    v128_t third = wasm_i32x4_splat(0);  // third row of the previous column

    [[gnu::always_inline]] void operator()(v128_t a, v128_t b, v128_t c) {
        store_pairs(third, c, slot - depthwise_slot / 2);
        store_pairs(a, b, slot);
        third = c;
        slot += depthwise_slot;
    }
    /// Completes the last slot. Its second half pairs the third row of the last column with the third row of the next column.
    /// Because there is no next column, the second half repeats the last column; the weights of these values are 0.
    void end() { store_pairs(third, third, slot - depthwise_slot / 2); }
};

/// Loads 16 channels if `all` is true, else `channels` channels.
template <bool all>
[[gnu::always_inline]] inline v128_t load_channels(const std::uint8_t* from, std::size_t channels) {
    if (all) return wasm_v128_load(from);
    std::uint8_t bytes[depthwise_block] = {};
    std::memcpy(bytes, from, channels);
    return wasm_v128_load(bytes);
}

/// Three rows of an image before upsampling.
struct depthwise_rows {
    const std::uint8_t* rows[3];  // nullptr for a row outside the image
    std::size_t channels, width, repeat;
    std::uint8_t padding;
};

/// Fills `count` slots with columns of the upsampled rows, starting at column `first` - 1. At most one column on each side is
/// outside the image.
template <bool all>
inline void fill_slots(const depthwise_rows& from, std::size_t first, std::size_t count, std::size_t first_channel,
                       std::int16_t* slot_values) {
    const v128_t outside = wasm_u8x16_splat(from.padding);
    std::uint8_t padding[depthwise_block];
    wasm_v128_store(padding, outside);
    const std::size_t begin = first == 0 ? 0 : first - 1, enlarged = from.width * from.repeat;
    const std::size_t end = first + count - 1 < enlarged ? first + count - 1 : enlarged;
    const std::size_t offset = begin / from.repeat * from.channels + first_channel;
    const auto at = [&](std::size_t r) { return from.rows[r] == nullptr ? padding : from.rows[r] + offset; };
    const auto move = [&](std::size_t r) { return from.rows[r] == nullptr ? 0 : from.channels; };
    const std::uint8_t *a = at(0), *b = at(1), *c = at(2);
    const std::size_t a_move = move(0), b_move = move(1), c_move = move(2);
    slot_writer write{slot_values};
    if (first == 0) write(outside, outside, outside);
    std::size_t repeated = begin % from.repeat;
    for (std::size_t column = begin; column < end; ++column) {
        write(load_channels<all>(a, from.channels), load_channels<all>(b, from.channels), load_channels<all>(c, from.channels));
        if (++repeated < from.repeat) continue;
        repeated = 0, a += a_move, b += b_move, c += c_move;
    }
    if (end < first + count - 1) write(outside, outside, outside);
    write.end();
}

/// Weights of 4 channels.
struct depthwise_vector {
    v128_t bias, dots[depthwise_dots];

    depthwise_vector(const depthwise_u8_data& weights, std::size_t vector)
        : bias(wasm_v128_load(weights.bias.data() + vector * 4)),
          dots{load(weights, vector, 0), load(weights, vector, 1), load(weights, vector, 2), load(weights, vector, 3),
               load(weights, vector, 4)} {}

    [[gnu::always_inline]] v128_t sums(const std::int16_t* slot) const {
        constexpr std::size_t third = depthwise_slot / 2;
        const v128_t outer = wasm_i32x4_add(dot<0>(slot), dot<2>(slot + 2 * depthwise_slot));
        const v128_t row = wasm_i32x4_add(dot<3>(slot + third), dot<4>(slot + 2 * depthwise_slot + third));
        return wasm_i32x4_add(wasm_i32x4_add(bias, dot<1>(slot + depthwise_slot)), wasm_i32x4_add(outer, row));
    }

private:
    static v128_t load(const depthwise_u8_data& weights, std::size_t vector, std::size_t dot) {
        return wasm_v128_load(weights.wide.data() + (vector * depthwise_dots + dot) * 8);
    }
    template <std::size_t i>
    [[gnu::always_inline]] v128_t dot(const std::int16_t* values) const {
        return wasm_i32x4_dot_i16x8(wasm_v128_load(values), dots[i]);
    }
};

template <bool positive>
inline void depthwise_u8_vector(const depthwise_u8_data& weights, std::size_t vector, const std::int16_t* slot_values,
                                std::size_t count, std::uint8_t* result) {
    const requantizer<positive> requantize(weights.fast);
    const depthwise_vector w(weights, vector);
    const std::size_t slot = weights.stride * depthwise_slot, channels = weights.channels;
    const std::size_t first_channel = vector * 4 % depthwise_block;
    const std::size_t held = channels - first_channel < 4 ? channels - first_channel : 4;
    if (held == 4) {  // a separate loop, because testing `held` per pixel makes the loop 1.4 times as slow at -O2
        for (std::size_t x = 0; x < count; ++x, slot_values += slot, result += channels) {
            const v128_t values = requantize(w.sums(slot_values));
            wasm_v128_store32_lane(result, narrow(values, values, values, values), 0);
        }
        return;
    }
    for (std::size_t x = 0; x < count; ++x, slot_values += slot, result += channels) {
        const v128_t values = requantize(w.sums(slot_values));
        store_first(result, narrow(values, values, values, values), held);
    }
}

inline void depthwise_u8_row(const depthwise_u8_data& weights, const depthwise_rows& rows, std::size_t result_width,
                             std::uint8_t* result) {
    static constexpr void (*functions[])(const depthwise_u8_data&, std::size_t, const std::int16_t*, std::size_t,
                                         std::uint8_t*) = {depthwise_u8_vector<false>, depthwise_u8_vector<true>};
    static constexpr void (*fill_functions[])(const depthwise_rows&, std::size_t, std::size_t, std::size_t, std::int16_t*) = {
        fill_slots<false>, fill_slots<true>};
    const auto function = functions[weights.output.zero_point == 0];
    const auto fill = fill_functions[weights.channels >= depthwise_block];
    const std::size_t channels = weights.channels, stride = weights.stride;
    const std::size_t held = channels < depthwise_block ? channels : depthwise_block;
    const std::size_t max_pixels = (depthwise_max_slots - 3) / stride + 1;
    alignas(16) std::int16_t memory[(1 + depthwise_max_slots) * depthwise_slot];
    std::int16_t* const slot_values = memory + depthwise_slot;
    for (std::size_t first = 0; first < result_width; first += max_pixels) {
        const std::size_t count = result_width - first < max_pixels ? result_width - first : max_pixels;
        for (std::size_t block = 0; block < depthwise_blocks(weights); ++block) {
            const std::size_t start = block_start(channels, block);
            fill(rows, first * stride, (count - 1) * stride + 3, start, slot_values);
            for (std::size_t c = 0; c < held; c += 4)
                function(weights, (block * depthwise_block + c) / 4, slot_values + c * 2, count,
                         result + first * channels + start + c);
        }
    }
}

inline void depthwise_u8(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const depthwise_rows from{{rows[0], rows[1], rows[2]}, weights.channels, width, repeat, weights.padding};
    depthwise_u8_row(weights, from, weights.result_width(width, repeat), result);
}

}}}  // namespace ldi::wasm_simd128

#endif
