// Converts a column of a layered image to a feature map, and back.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <string>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Copies a column to a feature map with the pixels of `layers` and the channels of the column.
///
///     const feature_map colors = from_column<color_column>(layers, 1.0F / 255.0F);
///
/// scale  factor that multiplies every value
template <payload_column Column, has_column<Column> Layers>
feature_map from_column(const Layers& layers, float scale = 1.0F) {
    const array_view<const typename Column::scalar> column = layered_view<Column>(layers).template column<Column>();
    feature_map map(layers.size(), Column::channels);
    std::transform(column.begin(), column.end(), map.values.begin(),
                   [scale](auto value) { return scale * static_cast<float>(value); });
    return map;
}

/// Copies a column of bytes to a map of bytes with zero point 0.
///
///     const auto bytes = from_column<color_column, std::uint8_t>(layers);
template <payload_column Column, std::same_as<std::uint8_t> Value, has_column<Column> Layers>
basic_feature_map<Value> from_column(const Layers& layers) {
    static_assert(std::same_as<Value, typename Column::scalar>, "bytes require a column of bytes");
    const array_view<const Value> column = layered_view<Column>(layers).template column<Column>();
    basic_feature_map<Value> map(layers.size(), Column::channels);
    std::copy(column.begin(), column.end(), map.values.begin());
    return map;
}

/// Writes a feature map to a column. If the column stores integers, rounds values to the nearest integer and clamps them to the
/// range of the integer type; NaN becomes 0. Ignores the zero point of a map of bytes. Unless that zero point is 0, convert the
/// map with dequantize() (nn/ldi/elementwise.hpp) first.
///
/// map    as many pixels as the layers, as many channels as the column; raises mismatch otherwise
/// scale  factor that multiplies every value before rounding
template <payload_column Column, class Value, has_column<Column> Layers>
void to_column(const basic_feature_map<Value>& map, Layers& layers, float scale = 1.0F) {
    using scalar = typename Column::scalar;
    static_assert(!std::is_enum_v<scalar>, "numbers of a map do not convert to enumerators; convert them yourself");
    const auto column = layers.template column<Column>();
    if (map.pixels() != layers.size() || map.channels != Column::channels || map.values.size() != column.size())
        raise(error_code::mismatch, "to_column",
              std::to_string(layers.size()) + " pixels of " + std::to_string(Column::channels) + " channels",
              std::to_string(map.values.size()) + " values, " + std::to_string(map.channels) + " per pixel");
    if constexpr (std::same_as<Value, scalar>)
        if (scale == 1.0F) {
            std::copy(map.values.begin(), map.values.end(), column.begin());
            return;
        }
    std::transform(map.values.begin(), map.values.end(), column.begin(), [=](Value value) {
        if constexpr (std::integral<scalar>) {
            // A double holds the product of two floats exactly, with 5 bits to spare. Adding 0.5 to a value whose fraction is
            // below one half therefore never rounds up to the next integer.
            const double scaled = double{scale} * static_cast<double>(value);
            const double rounded = (std::isnan(scaled) ? 0.0 : scaled) + (scaled < 0.0 ? -0.5 : 0.5);
            constexpr scalar lowest = (std::numeric_limits<scalar>::min)(), highest = (std::numeric_limits<scalar>::max)();
            if constexpr (std::same_as<scalar, bool>)
                return rounded >= 1.0;
            else if constexpr (sizeof(scalar) < sizeof(double))
                return static_cast<scalar>(std::clamp(rounded, double{lowest}, double{highest}));
            else if (rounded >= static_cast<double>(highest))  // conversion to double rounds 2^63 - 1 to 2^63
                return highest;
            else
                return rounded <= static_cast<double>(lowest) ? lowest : static_cast<scalar>(rounded);
        } else {
            return static_cast<scalar>(scale * static_cast<float>(value));
        }
    });
}

}}  // namespace ldi
