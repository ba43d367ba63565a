// Feature maps: one layer's values at each pixel of a layered image (paper, section "Mapping the PConv Network to LDI").
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/level_map.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Non-owning view of a feature map. The optional index map `rows` implements nearest-neighbor upsampling without a copy.
///
/// Value  float or std::uint8_t
template <class Value>
struct basic_feature_view {
    std::span<const Value> values;  ///< rows x channels
    std::size_t channels = 0;
    /// Index of each pixel's row, or no_pixel for a pixel that reads as zeros. If empty, pixel i has row i. Operators do not
    /// check the indices.
    std::span<const std::int32_t> rows;
    std::span<const std::uint8_t> mask;  ///< per row: 0 if its values are missing and read as zeros, else 1; empty: all 1
    Value zero = {};                     ///< value that represents zero; for bytes, the zero point

    /// Number of pixels of the graph.
    std::size_t pixels() const { return rows.empty() && channels > 0 ? values.size() / channels : rows.size(); }

    /// The row of a pixel, or no_pixel if it is missing or masked.
    std::int32_t row_of(std::int32_t pixel) const {
        if (pixel == no_pixel) return no_pixel;
        const std::int32_t row = rows.empty() ? pixel : rows[static_cast<std::size_t>(pixel)];
        if (row == no_pixel || mask.empty() || mask[static_cast<std::size_t>(row)] != 0) return row;
        return no_pixel;
    }

    /// Pointer to the channels of a row, which are contiguous.
    const Value* values_of(std::int32_t row) const { return values.data() + static_cast<std::size_t>(row) * channels; }
};

using feature_view = basic_feature_view<float>;

/// Owns the values of a feature map: pixels x channels, row-major, with the pixels in the graph's order.
template <class Value>
struct basic_feature_map {
    std::size_t channels = 0;
    buffer<Value> values;
    Value zero = {};  ///< value that represents zero; for bytes, the zero point

    basic_feature_map() = default;
    /// Leaves the values uninitialized. Raises too_large if the values exceed the address space.
    basic_feature_map(std::size_t pixel_count, std::size_t channel_count, Value zero_value = {})
        : channels(channel_count), values(checked_size(1, pixel_count, channel_count, sizeof(Value)), unset), zero(zero_value) {}

    std::size_t pixels() const { return channels > 0 ? values.size() / channels : 0; }

    /// The channels of one pixel.
    template <std::integral Index>
    std::span<Value> at(Index pixel) & {
        return std::span<Value>(values).subspan(first(pixel), channels);
    }
    template <std::integral Index>
    std::span<const Value> at(Index pixel) const& {
        return std::span<const Value>(values).subspan(first(pixel), channels);
    }
    template <std::integral Index>
    std::span<const Value> at(Index pixel) const&& = delete;  // the values would be destroyed with the map

    /// The map must outlive the view and keep its size. A temporary map also converts, so that it can be a function argument.
    /// Therefore, even `feature_view y = layer(plan, x);` compiles, but `y` then refers to a destroyed map.
    operator basic_feature_view<Value>() const { return {values, channels, {}, {}, zero}; }

private:
    template <std::integral Index>
    std::size_t first(Index pixel) const {
        LDI_ASSERT(static_cast<std::size_t>(pixel) < pixels());
        return static_cast<std::size_t>(pixel) * channels;
    }
};

using feature_map = basic_feature_map<float>;

/// Views a coarse map on the finer graph without a copy. Both arguments must outlive the view.
///
/// parent  per pixel of the finer graph: a row of `coarse`, or no_pixel for zeros; raises mismatch for any other index
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>& coarse, std::span<const std::int32_t> parent) {
    for (const std::int32_t row : parent)
        if (row != no_pixel && static_cast<std::size_t>(row) >= coarse.pixels())
            raise(error_code::mismatch, "upsample", "rows below " + std::to_string(coarse.pixels()),
                  "row " + std::to_string(row));
    return {coarse.values, coarse.channels, parent, {}, coarse.zero};
}
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>&&, std::span<const std::int32_t>) = delete;

/// Views a coarse map on the finer graph without a copy: each pixel has the channels of its parent, or zeros if it has no
/// parent. Both arguments must outlive the view. Raises mismatch unless `coarse` has one pixel per pixel of the coarse graph.
///
/// by  coarsened::map of the result of coarsen() for the finer graph
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>& coarse, const level_map& by) {
    if (coarse.pixels() != by.kept().size())
        raise(error_code::mismatch, "upsample", std::to_string(by.kept().size()) + " pixels", std::to_string(coarse.pixels()));
    return {coarse.values, coarse.channels, by.parent(), {}, coarse.zero};
}
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>&&, const level_map&) = delete;
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>&, const level_map&&) = delete;
template <class Value>
basic_feature_view<Value> upsample(const basic_feature_map<Value>&&, const level_map&&) = delete;

namespace detail {

/// Raises mismatch unless the values of a view form whole rows, and its mask, if any, has one entry per row.
template <class Value>
void check_rows(const char* where, const basic_feature_view<Value>& view) {
    const std::size_t rows = view.channels > 0 ? view.values.size() / view.channels : 0;
    if (view.values.size() != rows * view.channels)
        raise(error_code::mismatch, where, "whole rows of " + std::to_string(view.channels) + " values",
              std::to_string(view.values.size()) + " values");
    if (!view.mask.empty() && view.mask.size() != rows)
        raise(error_code::mismatch, where, "a mask of " + std::to_string(rows) + " rows", std::to_string(view.mask.size()));
}

/// Copies a row in a loop, because rows are short and a call to memmove() costs more than the copy.
template <class Value>
void copy_row(const Value* from, std::size_t count, Value* to) {
    constexpr std::size_t step = 16, short_step = 4;
    std::size_t i = 0;
    for (; i + step <= count; i += step) std::memcpy(to + i, from + i, step * sizeof(Value));
    for (; i + short_step <= count; i += short_step) std::memcpy(to + i, from + i, short_step * sizeof(Value));
    for (; i < count; ++i) to[i] = from[i];
}

/// Copies a pixel's channels from all sources, with zeros for masked channels. Returns the number of unmasked channels.
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

}}  // namespace ldi
