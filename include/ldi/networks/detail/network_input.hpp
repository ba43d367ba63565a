// Inputs and layer results of an inpainting network: feature maps, with a mask for networks that ignore missing colors.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The network's input, one row per pixel that it reads.
struct network_input {
    buffer<float> values;       ///< rows x channels
    buffer<std::uint8_t> mask;  ///< per row: 0 for a missing color, otherwise 1; empty: all 1
};

/// Scales known colors to [0, 1] and masks unknown colors.
inline network_input masked_input(array_view<const std::uint8_t> colors, array_view<const std::uint8_t> known,
                                  const pixel_subset& read) {
    network_input input{buffer<float>(3 * read.size()), buffer<std::uint8_t>(read.size())};
    for (std::size_t row = 0; row < read.size(); ++row) {
        const std::size_t pixel = static_cast<std::size_t>(read.pixels[row]);
        if (known[pixel] == 0) continue;
        input.mask[row] = 1;
        for (std::size_t c = 0; c < 3; ++c) input.values[3 * row + c] = nearest_float(colors[3 * pixel + c]) / 255.0F;
    }
    return input;
}

/// Result of a layer.
template <class Value>
struct masked_map {
    basic_feature_map<Value> map;
    buffer<std::uint8_t> mask;  ///< for each row: 0 if the layer's window has no known value, else 1; empty: all 1

    /// The map must outlive the view and keep its size.
    basic_feature_view<Value> view() const {
        basic_feature_view<Value> result = map;
        result.mask = mask;
        return result;
    }

    /// Views the map on the finer graph, like upsample() of nn/ldi/feature_map.hpp. The map must outlive the view and keep its
    /// size.
    ///
    /// rows  row of each pixel's parent, or no_pixel
    basic_feature_view<Value> upsampled(std::span<const std::int32_t> rows) const {
        basic_feature_view<Value> result = upsample(map, rows);
        result.mask = mask;
        return result;
    }
};

}}}  // namespace ldi::detail
