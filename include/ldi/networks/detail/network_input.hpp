// Inputs and layer results of an inpainting network: feature maps, with a mask for networks that ignore missing colors.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Input of the network or result of a layer.
template <class Value>
struct masked_map {
    basic_feature_map<Value> map;
    buffer<std::uint8_t> mask;  ///< per row: 0 for an unknown color or a window without known values, else 1; empty: all 1

    /// The map must outlive the view and keep its size.
    basic_feature_view<Value> view() const {
        basic_feature_view<Value> result = map;
        result.mask = mask;
        return result;
    }

    /// Views the map on the finer graph, like upsample() of nn/ldi/feature_map.hpp, without a check of `rows`. The map must
    /// outlive the view and keep its size.
    ///
    /// rows  row of each pixel's parent, or no_pixel
    basic_feature_view<Value> upsampled(std::span<const std::int32_t> rows) const {
        basic_feature_view<Value> result = view();
        result.rows = rows;
        return result;
    }
};

/// Returns the input of a network that masks unknown colors: known colors, scaled to [0, 1].
///
/// read     pixels that the network reads
/// convert  converts a float to the type of the network's input
template <class Convert>
auto masked_input(array_view<const std::uint8_t> colors, array_view<const std::uint8_t> known, const pixel_subset& read,
                  const Convert& convert) {
    masked_map<decltype(convert(0.0F))> input{{read.size(), 3, convert.zero()}, buffer<std::uint8_t>(read.size())};
    read.for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t first_row) {
        for (std::int32_t i = 0; i < count; ++i) {
            const std::size_t pixel = static_cast<std::size_t>(first + i), row = static_cast<std::size_t>(first_row + i);
            input.mask[row] = known[pixel] != 0 ? 1 : 0;
            for (std::size_t c = 0; c < 3; ++c)
                input.map.values[3 * row + c] =
                    known[pixel] != 0 ? convert(nearest_float(colors[3 * pixel + c]) / 255.0F) : input.map.zero;
        }
    });
    return input;
}

}}}  // namespace ldi::detail
