// kernels/depthwise_u8.hpp with sdot, 16 channels at a time.
//
// The kernel interleaves the bytes of three rows: four bytes contain one channel of one column (the fourth has weight 0). Each of
// the three columns of a window then costs one sdot for 4 channels. Each column is interleaved only once, in registers, and
// immediately added to all windows that contain it. 16 channels of a pixel (144 products) cost 12 sdot, and 11 instructions to
// load and interleave the new column. Widening multiplications would cost 36 smlal, and 6 instructions for the new column.
#pragma once

#include <ldi/kernels/depthwise_u8/contract.hpp>
#include <ldi/kernels/depthwise_u8/stretches.hpp>
#include <ldi/kernels/detail/lanes_neon.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

inline constexpr std::size_t depthwise_max_channels = 16, lane_count = 4;

inline void pack_depthwise_u8(depthwise_u8_data& packed, const detail::depthwise_source& source) {
    const int sign = detail::range_of(source.weights, source.weight_zero_point).max > 127 ? -1 : 1;
    packed.output.multiplier *= sign;
    detail::depthwise_source from = source;
    from.input_zero_point -= 128;  // see to_signed()
    detail::pack_columns<depthwise_max_channels>(packed, from, sign);
}

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

/// Number of existing channels in each group of 16.
using depthwise_lanes = std::size_t;

inline depthwise_lanes existing_lanes(std::size_t channels) { return channels < 16 ? channels : 16; }

struct four_vectors {
    int32x4_t v[4];
};

/// Interleaves bytes: each 32-bit value of the result contains one byte of a, of b, of c, and of d.
[[gnu::always_inline]] inline four_vectors interleave_bytes(int8x16_t a, int8x16_t b, int8x16_t c, int8x16_t d) {
    const int16x8_t ab_low = vreinterpretq_s16_s8(vzip1q_s8(a, b)), ab_high = vreinterpretq_s16_s8(vzip2q_s8(a, b));
    const int16x8_t cd_low = vreinterpretq_s16_s8(vzip1q_s8(c, d)), cd_high = vreinterpretq_s16_s8(vzip2q_s8(c, d));
    return {{vreinterpretq_s32_s16(vzip1q_s16(ab_low, cd_low)), vreinterpretq_s32_s16(vzip2q_s16(ab_low, cd_low)),
             vreinterpretq_s32_s16(vzip1q_s16(ab_high, cd_high)), vreinterpretq_s32_s16(vzip2q_s16(ab_high, cd_high))}};
}

/// Loads 16 channels of one row, or all channels if there are fewer.
template <std::size_t channels>
[[gnu::always_inline]] inline int8x16_t load_stretches(const detail::depthwise_position<1>& position, std::size_t row,
                                                       std::size_t offset, depthwise_lanes lanes) {
    const std::uint8_t* const from = position.find(row, 0, offset);
    if (lanes == 16) return to_signed(vld1q_u8(from));
    std::uint8_t bytes[16] = {};
    std::memcpy(bytes, from, lanes);
    return to_signed(vld1q_u8(bytes));
}

template <std::size_t channels>
[[gnu::always_inline]] inline void store_stretches(std::uint8_t* const* to, std::size_t offset, depthwise_lanes lanes,
                                                   uint8x16_t bytes) {
    store_first(to[0] + offset, bytes, lanes);
}

#include <ldi/kernels/depthwise_u8/generic/walk.hpp>

/// The weights of one unit.
template <class Requantizer>
struct depthwise_sums {
    using requantizer_type = Requantizer;

    int8x16_t weights[12];
    const std::int32_t* bias;

    [[gnu::always_inline]] depthwise_sums(const std::int8_t* values, const std::int32_t* biases)
        : depthwise_sums(values, biases, std::make_index_sequence<12>{}) {}

    [[gnu::always_inline]] four_vectors start() const { return load_sums(bias); }
    template <std::size_t k>
    [[gnu::always_inline]] four_vectors add(const four_vectors& sum, const four_vectors& column) const {
        return {{add(sum.v[0], column.v[0], weights[4 * k]), add(sum.v[1], column.v[1], weights[4 * k + 1]),
                 add(sum.v[2], column.v[2], weights[4 * k + 2]), add(sum.v[3], column.v[3], weights[4 * k + 3])}};
    }

    static Requantizer requantizer_of(const depthwise_u8_data& packed) { return Requantizer(packed.output); }
    [[gnu::always_inline]] static uint8x16_t requantized(const Requantizer& requantize, const four_vectors& sums) {
        return requantize(sums.v[0], sums.v[1], sums.v[2], sums.v[3]);
    }

private:
    template <std::size_t... i>
    [[gnu::always_inline]] depthwise_sums(const std::int8_t* values, const std::int32_t* biases, std::index_sequence<i...>)
        : weights{load(values + i * 16)...}, bias(biases) {}

    [[gnu::always_inline]] static int32x4_t add(int32x4_t sum, int32x4_t column, int8x16_t values) {
        return add_products(sum, vreinterpretq_s8_s32(column), values);
    }
};

inline void depthwise_u8(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    const detail::depthwise_call call(weights, rows, width, repeat, result);
    if (weights.output.zero_point == 0)
        depthwise_u8_units<depthwise_sums<relu_requantizer>>(call);
    else
        depthwise_u8_units<depthwise_sums<requantizer>>(call);
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
