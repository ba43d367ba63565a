// A single layer with the photo's pixels in row-major order. lift() makes it; expand() turns it into a layered image.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {
struct expansion_access;
}

/// A single layer with the photo's pixels in row-major order: pixel (x, y) has index y * width + x. Links and values can change,
/// but pixels cannot be added, removed or moved. expand() turns it into a layered image.
template <payload_column... Columns>
class single_layer {
public:
    template <class Column>
    static constexpr bool has = one_of<Column, Columns...>;

    single_layer() = default;
    /// Raises mismatch unless there is exactly one pixel per lattice position, in the photo's order.
    explicit single_layer(layered_image<Columns...> layers) : layers_(std::move(layers)) {
        const graph& g = topology();
        std::int32_t in_order = 0;
        while (in_order < g.count() && g.position_of(in_order) == static_cast<std::size_t>(in_order)) ++in_order;
        if (in_order < g.count() || g.size() != g.position_count())
            raise(error_code::mismatch, "single_layer",
                  std::to_string(g.width()) + " x " + std::to_string(g.height()) + " pixels, row by row",
                  std::to_string(g.size()) + " pixels, of which the first " + std::to_string(in_order) + " are in this order");
    }

    const graph& topology() const& { return layers_.topology(); }
    const graph& topology() const&& = delete;  // the graph would be destroyed with the layer
    std::size_t size() const { return layers_.size(); }
    template <one_of<Columns...> Column>
    array_view<typename Column::scalar> column() & {
        return layers_.template column<Column>();
    }
    template <one_of<Columns...> Column>
    array_view<const typename Column::scalar> column() const& {
        return layers_.template column<Column>();
    }
    template <one_of<Columns...> Column>
    array_view<const typename Column::scalar> column() const&& = delete;
    template <one_of<Columns...> Column, std::integral Index>
    std::span<typename Column::scalar, Column::channels> at(Index pixel) & {
        return layers_.template at<Column>(pixel);
    }
    template <one_of<Columns...> Column, std::integral Index>
    std::span<const typename Column::scalar, Column::channels> at(Index pixel) const& {
        return layers_.template at<Column>(pixel);
    }
    template <one_of<Columns...> Column, std::integral Index>
    std::span<const typename Column::scalar, Column::channels> at(Index pixel) const&& = delete;
    /// Replaces a column without a copy. Raises mismatch unless there are K x channels scalars.
    template <one_of<Columns...> Column>
    void set_column(buffer<typename Column::scalar> scalars) {
        layers_.template set_column<Column>(std::move(scalars));
    }
    /// Calls edit(link_editor&), which may link and unlink pixels, as layered_image::edit_links() does.
    template <class Edit>
    void edit_links(Edit&& edit) {
        layers_.edit_links(edit);
    }

    /// Returns the layer with one more column.
    ///
    /// scalars  K x channels, row-major. Raises mismatch for any other length; in that case, the layer keeps its values
    ///
    ///     struct normal { using scalar = float; static constexpr std::size_t channels = 3; };
    ///     auto layer = ldi::lift(photo, disparity).with<normal>(normals);  // normals stay with their pixels up to the mesh
    template <payload_column Column>
    requires(!has<Column>) single_layer<Columns..., Column> with(buffer<typename Column::scalar> scalars) && {
        const std::size_t count = detail::scalar_count<Column>(size());
        if (scalars.size() != count) detail::refuse_column_length(count, scalars.size());
        single_layer<Columns..., Column> result;
        result.layers_ = layered_image<Columns..., Column>(std::move(layers_));
        result.template set_column<Column>(std::move(scalars));
        return result;
    }

private:
    template <payload_column...>
    friend class single_layer;
    friend detail::expansion_access;

    layered_image<Columns...> layers_;
};

/// The layer of a photo.
using photo_layer = single_layer<color_column, disparity_column, known_column, matte_column>;

namespace detail {

// The only conversion from a single layer to a layered image.
struct expansion_access {
    template <class... Columns>
    static layered_image<Columns...> layers_of(single_layer<Columns...>&& layer) {
        return std::move(layer.layers_);
    }
};

}  // namespace detail

}}  // namespace ldi
