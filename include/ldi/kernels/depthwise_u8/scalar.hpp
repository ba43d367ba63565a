// kernels/depthwise_u8.hpp in portable C++.
#pragma once

#include <ldi/kernels/depthwise_u8/contract.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Number of channels computed together. Compilers vectorize a loop over this many 8-bit values, but not shorter loops.
inline constexpr std::size_t depthwise_block = 16;

/// Packs the weights tap by tap: for each element of the window, the weights of all channels.
inline void pack_depthwise_u8(depthwise_u8_data& packed, const detail::depthwise_source& source) {
    for (std::size_t t = 0; t < depthwise_u8_data::taps; ++t)
        for (std::size_t c = 0; c < packed.channels; ++c) packed.wide.push_back(static_cast<std::int16_t>(source.weight(c, t)));
    for (std::size_t c = 0; c < packed.channels; ++c) packed.bias.push_back(source.folded_bias(c));
}

/// Computes `count` channels of one pixel, starting at `first`. A compile-time `count` lets the compiler vectorize the loops.
template <class Count>
inline void depthwise_u8_channels(const depthwise_u8_data& weights, const std::uint8_t* const* taps, std::size_t first,
                                  Count count, std::uint8_t* result) {
    std::int32_t sums[depthwise_block] = {};
    std::uint8_t outside[depthwise_block];
    for (std::uint8_t& value : outside) value = weights.padding;
    for (std::size_t t = 0; t < depthwise_u8_data::taps; ++t) {
        const std::uint8_t* const x = taps[t] == nullptr ? outside : taps[t] + first;
        const std::int16_t* const w = weights.wide.data() + t * weights.channels + first;
        for (std::size_t c = 0; c < count; ++c) sums[c] += std::int32_t{std::int16_t{x[c]}} * std::int32_t{w[c]};
    }
    for (std::size_t c = 0; c < count; ++c) result[first + c] = requantize(sums[c] + weights.bias[first + c], weights.output);
}

inline void depthwise_u8(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    using block = std::integral_constant<std::size_t, depthwise_block>;
    const std::size_t channels = weights.channels, result_width = weights.result_width(width, repeat);
    for (std::size_t x = 0; x < result_width; ++x, result += channels) {
        const std::uint8_t* taps[depthwise_u8_data::taps];
        for (std::size_t t = 0; t < depthwise_u8_data::taps; ++t) {
            const std::size_t column = x * weights.stride + t % 3;  // index of the column that is read, plus one
            const bool outside = rows[t / 3] == nullptr || column == 0 || column > width * repeat;
            taps[t] = outside ? nullptr : rows[t / 3] + (column - 1) / repeat * channels;
        }
        std::size_t first = 0;
        for (; first + block::value <= channels; first += block::value)
            depthwise_u8_channels(weights, taps, first, block{}, result);
        if (first == channels) continue;
        if (channels > block::value)  // the last block overlaps the one before it
            depthwise_u8_channels(weights, taps, channels - block::value, block{}, result);
        else
            depthwise_u8_channels(weights, taps, 0, channels, result);
    }
}

}}}  // namespace ldi::scalar
