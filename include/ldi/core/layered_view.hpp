// A non-owning view of a layered image, or of a graph and columns that the caller owns.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Non-owning view of a layered image, or of some of its columns. Stages that only read layers accept it. As with
/// std::string_view, a view of a temporary is valid only until the end of the full expression.
template <payload_column... Columns>
class layered_view {
public:
    template <class Column>
    static constexpr bool has = (std::is_same_v<Column, Columns> || ...);

    /// columns  K x channels scalars each, in the order of the tags. Raises mismatch for any other length
    explicit layered_view(const graph_view& g, array_view<const typename Columns::scalar>... columns)
        : graph_(g), columns_(shown<Columns>{columns}...) {
        const auto check = [&](std::size_t expected, std::size_t found) {
            if (found != expected) detail::refuse_column_length(expected, found);
        };
        (check(g.size() * Columns::channels, columns.size()), ...);
    }
    explicit layered_view(graph&&, array_view<const typename Columns::scalar>...) = delete;  // the view would outlive the graph
    template <has_columns<Columns...> Layers>
    layered_view(const Layers& layers) : layered_view(layers.topology(), layers.template column<Columns>()...) {}

    const graph_view& topology() const { return graph_; }
    std::size_t size() const { return graph_.size(); }
    template <payload_column Column>
    array_view<const typename Column::scalar> column() const {
        return std::get<shown<Column>>(columns_).values;
    }
    template <payload_column Column>
    std::span<const typename Column::scalar, Column::channels> at(std::int32_t pixel) const {
        return detail::pixel_scalars<Column>(column<Column>(), pixel);
    }

private:
    template <class Column>
    struct shown {
        array_view<const typename Column::scalar> values;
    };

    graph_view graph_;
    std::tuple<shown<Columns>...> columns_;
};

}}  // namespace ldi
