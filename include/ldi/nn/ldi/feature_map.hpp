// Feature maps: what a layer of a network holds for each pixel of a layered image, and how the next layer reads it (paper,
// section "Mapping the PConv Network to LDI").
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace ldi::inline LDI_CONFIGURATION {

/// Somebody else's feature map, possibly through a map of pixels: nearest upsampling without writing it out.
///
/// Value  float or std::uint8_t, as the weights' kernel reads it
template <class Value>
struct basic_feature_view {
    std::span<const Value> values;  ///< rows x channels
    std::size_t channels = 0;
    std::span<const std::int32_t> rows;  ///< for each pixel of the graph its row, or no_pixel: zeros; empty: its own
    std::span<const std::uint8_t> mask;  ///< for each row 1 or 0; empty: all 1
    Value zero = {};                     ///< what stands for zero: of bytes their zero point

    /// Pixels of the graph.
    std::size_t pixels() const { return rows.empty() && channels > 0 ? values.size() / channels : rows.size(); }

    /// The row of a pixel that counts, or no_pixel.
    std::int32_t row_of(std::int32_t pixel) const {
        if (pixel == no_pixel) return no_pixel;
        const std::int32_t row = rows.empty() ? pixel : rows[static_cast<std::size_t>(pixel)];
        if (row == no_pixel || mask.empty() || mask[static_cast<std::size_t>(row)] != 0) return row;
        return no_pixel;
    }

    /// The channels of a row, side by side.
    const Value* values_of(std::int32_t row) const { return values.data() + static_cast<std::size_t>(row) * channels; }
};

using feature_view = basic_feature_view<float>;

/// Pixels x channels, row-major, pixels in the graph's order.
template <class Value>
struct basic_feature_map {
    std::size_t channels = 0;
    buffer<Value> values;
    Value zero = {};  ///< what stands for zero: of bytes their zero point

    basic_feature_map() = default;
    /// Values are not set.
    basic_feature_map(std::size_t pixel_count, std::size_t channel_count, Value stands_for_zero = {})
        : channels(channel_count), values(pixel_count * channel_count, unset), zero(stands_for_zero) {}

    std::size_t pixels() const { return channels > 0 ? values.size() / channels : 0; }

    /// The channels of one pixel.
    template <std::integral Index>
    std::span<Value> at(Index pixel) {
        return std::span<Value>(values).subspan(first(pixel), channels);
    }
    template <std::integral Index>
    std::span<const Value> at(Index pixel) const {
        return std::span<const Value>(values).subspan(first(pixel), channels);
    }

    /// The map must live, and keep its size, as long as the view.
    operator basic_feature_view<Value>() const { return {values, channels, {}, {}, zero}; }

private:
    template <std::integral Index>
    std::size_t first(Index pixel) const {
        return static_cast<std::size_t>(pixel) * channels;
    }
};

using feature_map = basic_feature_map<float>;

/// A coarse map as the finer graph's pixels see it: each has the channels of its parent, or zeros where it has none. Nothing is
/// written; the map and the parents must live as long as the view.
///
/// parent  coarsened::parent, one a pixel of the finer graph
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>& coarse, std::span<const std::int32_t> parent) {
    return {coarse.values, coarse.channels, parent, {}, coarse.zero};
}

namespace detail {

/// Rows are short: a call of memmove() for each costs more than it copies.
template <class Value>
void copy_row(const Value* from, std::size_t count, Value* to) {
    constexpr std::size_t step = 4;
    std::size_t i = 0;
    for (; i + step <= count; i += step) std::memcpy(to + i, from + i, step * sizeof(Value));
    for (; i < count; ++i) to[i] = from[i];
}

/// Copies what a pixel holds, and returns how many of its channels count.
template <class Value>
std::size_t copy_pixel(std::span<const basic_feature_view<Value>> sources, std::int32_t pixel, Value* to) {
    std::size_t counted = 0;
    for (const auto& source : sources) {
        const std::int32_t row = source.row_of(pixel);
        if (row == no_pixel) {
            std::fill_n(to, source.channels, source.zero);
        } else {
            copy_row(source.values_of(row), source.channels, to);
            counted += source.channels;
        }
        to += source.channels;
    }
    return counted;
}

}  // namespace detail

}  // namespace ldi
