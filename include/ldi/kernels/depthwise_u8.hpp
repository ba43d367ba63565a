// Depthwise 3 x 3 convolution of 8-bit activations, requantised to 8 bits, one row of the result at a time. This header is the
// contract of the family and its portable implementation.
#pragma once

#include <ldi/kernels/requantize.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace ldi {

/// The weights of one layer in the order that depthwise_u8() reads them. Only pack_depthwise_u8() makes sound ones.
struct depthwise_u8_weights {
    static constexpr std::size_t taps = 9;

    std::size_t channels = 0;
    std::vector<std::int16_t> values;   ///< weight minus its zero point, 9 x channels, taps row by row
    std::vector<std::int32_t> bias;     ///< channels
    std::vector<std::uint8_t> padding;  ///< channels values equal to the input's zero point: what lies outside the image
    requantization output;
};

/// weights           channels x 3 x 3, row-major
/// bias              channels, in units of input scale * weight scale; |bias| must be below 2^30
/// input_zero_point  of the activations, and the value of what lies outside the image
inline depthwise_u8_weights pack_depthwise_u8(std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                                              std::span<const std::int32_t> bias, std::uint8_t input_zero_point,
                                              const requantization& output) {
    constexpr std::size_t taps = depthwise_u8_weights::taps;
    LDI_ASSERT(weights.size() == bias.size() * taps);
    depthwise_u8_weights packed;
    packed.channels = bias.size();
    packed.values.resize(weights.size());
    for (std::size_t c = 0; c < packed.channels; ++c)
        for (std::size_t t = 0; t < taps; ++t)
            packed.values[t * packed.channels + c] = static_cast<std::int16_t>(weights[c * taps + t] - weight_zero_point);
    packed.bias.assign(bias.begin(), bias.end());
    packed.padding.assign(packed.channels, input_zero_point);
    packed.output = output;
    return packed;
}

namespace scalar {

/// Channels that are summed at a time. Compilers make vectors of a loop over so many 8-bit values, but not of shorter ones.
inline constexpr std::size_t depthwise_block = 16;

/// The result at one pixel, `count` channels from `first` on; with `count` known to the compiler the loops become vectors.
template <class Count>
inline void depthwise_u8_channels(const depthwise_u8_weights& weights, const std::uint8_t* const* taps, std::size_t first,
                                  Count count, std::uint8_t* result) {
    std::int32_t sums[depthwise_block] = {};
    const std::int16_t zero_point = weights.padding[0];
    for (std::size_t t = 0; t < depthwise_u8_weights::taps; ++t) {
        const std::uint8_t* const x = taps[t] + first;
        const std::int16_t* const w = weights.values.data() + t * weights.channels + first;
        for (std::size_t c = 0; c < count; ++c) {
            const std::int16_t centred = static_cast<std::int16_t>(x[c] - zero_point);
            sums[c] += std::int32_t{centred} * std::int32_t{w[c]};
        }
    }
    for (std::size_t c = 0; c < count; ++c) result[first + c] = requantize(sums[c] + weights.bias[first + c], weights.output);
}

inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t stride, std::uint8_t* result) {
    using block = std::integral_constant<std::size_t, depthwise_block>;
    const std::size_t channels = weights.channels;
    const std::size_t result_width = (width - 1) / stride + 1;
    for (std::size_t x = 0; x < result_width; ++x, result += channels) {
        const std::uint8_t* taps[depthwise_u8_weights::taps];
        for (std::size_t t = 0; t < depthwise_u8_weights::taps; ++t) {
            const std::size_t column = x * stride + t % 3;  // one more than the column that is read
            const bool outside = rows[t / 3] == nullptr || column == 0 || column > width;
            taps[t] = outside ? weights.padding.data() : rows[t / 3] + (column - 1) * channels;
        }
        if (channels < block::value) {
            depthwise_u8_channels(weights, taps, 0, channels, result);
            continue;
        }
        std::size_t first = 0;
        for (; first + block::value <= channels; first += block::value)
            depthwise_u8_channels(weights, taps, first, block{}, result);
        // The last block overlaps the one before and gives the same values once more.
        if (first < channels) depthwise_u8_channels(weights, taps, channels - block::value, block{}, result);
    }
}

}  // namespace scalar

/// rows    the rows above, at and below the result's row, width x channels each; nullptr for a row outside the image
/// stride  1 or 2, horizontally; the vertical one is in the choice of rows
/// result  ((width - 1) / stride + 1) x channels; must not overlap the rows
inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t stride, std::uint8_t* result) {
    scalar::depthwise_u8(weights, rows, width, stride, result);
}

}  // namespace ldi
