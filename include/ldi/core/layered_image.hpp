// A layered depth image: a graph and payload columns of the same length. The payload is the user's choice: each column is named
// by a tag type that says what a pixel holds. One value of this type carries everything from lifting to texturing.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

namespace ldi {

/// A column tag: the scalar, and how many of them a pixel holds.
template <class T>
concept payload_column = requires {
    typename T::scalar;
    { T::channels } -> std::convertible_to<std::size_t>;
};

/// red, green, blue as the photo has them (sRGB), 0 to 255. Undefined where known_column is 0.
struct color_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 3;
};

/// Disparity in [0, 1], larger is nearer; 0 is the farthest and 1 the nearest surface of the photo.
struct disparity_column {
    using scalar = float;
    static constexpr std::size_t channels = 1;
};

/// 1 where the photo gives the color, 0 where it must be inpainted.
struct known_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
};

/// A graph with K pixels and, for each column, K rows of `channels` scalars, row-major.
///
///     struct normal { using scalar = float; static constexpr std::size_t channels = 3; };
///     layered_image<disparity_column, normal> surfaces;
///     surfaces.column<normal>()[3 * i + 2]
template <payload_column... Columns>
class layered_image {
public:
    graph topology;

    layered_image() = default;
    /// Columns are set to zero.
    explicit layered_image(graph g) : topology(std::move(g)) { resize_columns(topology.size()); }

    std::size_t size() const { return topology.size(); }

    template <payload_column Column>
    buffer<typename Column::scalar>& column() {
        return std::get<storage<Column>>(columns_).values;
    }
    template <payload_column Column>
    const buffer<typename Column::scalar>& column() const {
        return std::get<storage<Column>>(columns_).values;
    }

    /// The scalars of one pixel.
    template <payload_column Column>
    std::span<typename Column::scalar, Column::channels> at(std::int32_t pixel) {
        return std::span<typename Column::scalar, Column::channels>(
            column<Column>().data() + static_cast<std::size_t>(pixel) * Column::channels, Column::channels);
    }
    template <payload_column Column>
    std::span<const typename Column::scalar, Column::channels> at(std::int32_t pixel) const {
        return std::span<const typename Column::scalar, Column::channels>(
            column<Column>().data() + static_cast<std::size_t>(pixel) * Column::channels, Column::channels);
    }

    /// Makes every column as long as the graph; new rows are zero.
    void resize_columns(std::size_t count) { (column<Columns>().resize(count * Columns::channels), ...); }

    /// Moves pixel `order[i]` to index i, in the graph and in every column.
    void reorder(std::span<const std::int32_t> order) {
        topology = reordered(topology, order);
        ((column<Columns>() = reordered(column<Columns>(), order, Columns::channels)), ...);
    }

    /// Cuts off the pixels whose place in `kept` is 0, with their links and rows; the others stay in their order.
    ///
    /// kept  one a pixel
    void keep(std::span<const std::uint8_t> kept) {
        LDI_ASSERT(kept.size() == size());
        buffer<std::int32_t> order;
        std::size_t count = 0;
        for (const bool stays : {true, false}) {
            for (std::size_t i = 0; i < kept.size(); ++i)
                if ((kept[i] != 0) == stays) order.push_back(static_cast<std::int32_t>(i));
            if (stays) count = order.size();
        }
        for (std::size_t n = count; n < order.size(); ++n)
            for (const side s : all_sides) topology.unlink(order[n], s);
        reorder(order);
        topology.resize(count);
        resize_columns(count);
    }

private:
    template <class Column>
    struct storage {
        buffer<typename Column::scalar> values;
    };
    std::tuple<storage<Columns>...> columns_;
};

/// The layered image that a photo becomes.
using photo_layers = layered_image<color_column, disparity_column, known_column>;

}  // namespace ldi
