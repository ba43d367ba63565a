// A non-owning view of a layered image, or of a graph and columns that the caller owns.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

template <payload_column... Columns>
class layered_view;

namespace detail {
template <class>
inline constexpr bool is_layered_view = false;
template <class... Columns>
inline constexpr bool is_layered_view<layered_view<Columns...>> = true;
}  // namespace detail

/// Non-owning view of a layered image, or of some of its columns. Stages that only read layers accept a layered_view.
template <payload_column... Columns>
class layered_view {
    static_assert(detail::are_distinct<Columns...>, "the columns of a layered view must be distinct");

public:
    template <class Column>
    static constexpr bool has = one_of<Column, Columns...>;

    /// columns  K x channels scalars each, in the order of the tags. Raises mismatch for any other length
    explicit layered_view(const graph_view& g,
                          array_view<const typename Columns::scalar>... columns) requires(sizeof...(Columns) > 0)
        : graph_(g), columns_(shown<Columns>{columns}...) {
        const auto check = [&](std::size_t expected, std::size_t found) {
            if (found != expected) detail::refuse_column_length(expected, found);
        };
        (check(detail::scalar_count<Columns>(g.size()), columns.size()), ...);
    }
    /// Converts from any other layered_view that has these columns, even a temporary one. Also converts from a layered_image, a
    /// single_layer, or the caller's own type with `has`, topology() and column(), but not from a temporary of these types.
    template <has_columns<Columns...> Layers>
    requires(requires(const Layers& l) { graph_view(l.topology()); } &&
             !std::is_same_v<std::remove_cvref_t<Layers>, layered_view> &&
             (std::is_lvalue_reference_v<Layers> || detail::is_layered_view<std::remove_const_t<Layers>>))
        layered_view(Layers&& layers)
        : layered_view(graph_view(layers.topology()), layers.template column<Columns>()...) {}

    const graph_view& topology() const { return graph_; }
    std::size_t size() const { return graph_.size(); }
    template <one_of<Columns...> Column>
    array_view<const typename Column::scalar> column() const {
        return std::get<shown<Column>>(columns_).values;
    }
    template <one_of<Columns...> Column, std::integral Index>
    std::span<const typename Column::scalar, Column::channels> at(Index pixel) const {
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
