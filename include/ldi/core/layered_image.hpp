// A layered depth image: a graph and payload columns of the same length. Column tags (core/columns.hpp) choose the payload.
//
//     layered_image<Columns...>   owns a graph and its columns; stages receive and return it
//     layered_view<Columns...>    a non-owning view of a graph and columns (core/layered_view.hpp)
//     single_layer<Columns...>    one layer in the order of the photo (core/single_layer.hpp)
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

template <payload_column... Columns>
class layered_image;

namespace detail {
[[noreturn]] inline void refuse_link(std::int32_t a, std::int32_t b) {
    raise(error_code::mismatch, "edit_links", "pixels one step apart whose facing sides have no link",
          "pixels " + std::to_string(a) + " and " + std::to_string(b));
}
[[noreturn]] inline void refuse_side(side s) {
    raise(error_code::mismatch, "edit_links", "one of four sides", "side " + std::to_string(static_cast<int>(s)));
}
[[noreturn]] inline void refuse_pixel(std::int32_t pixel, std::int32_t count) {
    raise(error_code::mismatch, "edit_links", "a pixel index from 0 to " + std::to_string(count - 1), std::to_string(pixel));
}
}  // namespace detail

/// Adds and removes links, but does not change the pixels. edit_links() passes a link_editor to its callback. The link_editor
/// is invalid after the callback returns.
class link_editor {
public:
    link_editor(const link_editor&) = delete;
    link_editor& operator=(const link_editor&) = delete;

    /// Returns the neighbor of a pixel, or no_pixel. Raises mismatch for a pixel or a side that does not exist, even in release
    /// builds.
    std::int32_t neighbor(std::int32_t pixel, side s) const {
        check(pixel, s);
        return graph_.neighbor(pixel, s);
    }
    /// Makes `b` the neighbor of `a` on side `s`, and `a` the neighbor of `b` on the opposite side. Raises mismatch unless
    /// graph_builder::can_link() is true, even in release builds.
    void link(std::int32_t a, side s, std::int32_t b) {
        if (!graph_.can_link(a, s, b)) detail::refuse_link(a, b);
        graph_.link(a, s, b);
    }
    /// Removes the link of `a` on side `s`, if any. Raises mismatch for a pixel or a side that does not exist, even in release
    /// builds.
    void unlink(std::int32_t a, side s) {
        check(a, s);
        graph_.unlink(a, s);
    }

private:
    void check(std::int32_t pixel, side s) const {
        if (!graph_.exists(pixel)) detail::refuse_pixel(pixel, graph_.count());
        if (!is_side(s)) detail::refuse_side(s);
    }

    template <payload_column...>
    friend class layered_image;
    explicit link_editor(graph_builder& g) : graph_(g) {}

    graph_builder& graph_;
};

/// A graph with K pixels and, for each column, K rows of `channels` scalars, row-major. Every column always has one row per
/// pixel, even after memory runs out or a callback throws, because only members that process all columns together can add, remove
/// and move pixels. After an error, members leave the image unchanged, with two exceptions: grow() leaves it empty, and
/// edit_links() keeps the changes that `edit` made before it threw.
///
///     struct normal { using scalar = float; static constexpr std::size_t channels = 3; };
///     layered_image<disparity_column, normal> surfaces(make_grid(6, 4));
///     surfaces.column<normal>()[3 * i + 2]
template <payload_column... Columns>
class layered_image {
    static_assert(detail::are_distinct<Columns...>, "the columns of a layered image must be distinct");
    static_assert((detail::check_rules<Columns>() && ...));

public:
    /// Whether the layered image has this column.
    template <class Column>
    static constexpr bool has = one_of<Column, Columns...>;

    layered_image() = default;
    /// Initializes all columns to zero.
    explicit layered_image(graph g) : graph_(std::move(g)) { (zero_column<Columns>(), ...); }
    /// columns  K x channels scalars each, in the order of the tags. Raises mismatch for any other length
    layered_image(graph g, buffer<typename Columns::scalar>... columns) requires(sizeof...(Columns) > 0) : graph_(std::move(g)) {
        (set_column<Columns>(std::move(columns)), ...);
    }
    /// Moves the graph and the common columns from another layered image. Columns that the other image lacks become zero.
    template <payload_column... Others>
    requires(!std::is_same_v<layered_image<Others...>, layered_image>) explicit layered_image(layered_image<Others...>&& other) {
        const auto make = [&]<class Column>(std::type_identity<Column>) {
            if constexpr (!layered_image<Others...>::template has<Column>)
                values<Column>().resize(detail::scalar_count<Column>(other.size()));
        };
        const auto take = [&]<class Column>(std::type_identity<Column>) {
            if constexpr (layered_image<Others...>::template has<Column>)
                values<Column>() = std::move(other.template values<Column>());
        };
        (make(std::type_identity<Columns>{}), ...);  // allocates first, so that `other` stays unchanged if memory runs out
        (take(std::type_identity<Columns>{}), ...);
        graph_ = std::move(other.graph_);
        other = {};
    }
    layered_image(const layered_image&) = default;
    layered_image& operator=(const layered_image& other) { return *this = layered_image(other); }
    /// The moved-from image is empty.
    layered_image(layered_image&& other) noexcept
        : graph_(std::exchange(other.graph_, {})), columns_(std::exchange(other.columns_, {})) {}
    layered_image& operator=(layered_image&& other) noexcept {
        graph_ = std::exchange(other.graph_, {}), columns_ = std::exchange(other.columns_, {});
        return *this;
    }

    const graph& topology() const& { return graph_; }
    const graph& topology() const&& = delete;  // the graph would be destroyed with the image
    /// Number of pixels K.
    std::size_t size() const { return graph_.size(); }

    /// Returns K x channels scalars.
    template <one_of<Columns...> Column>
    array_view<typename Column::scalar> column() & {
        return values<Column>();
    }
    template <one_of<Columns...> Column>
    array_view<const typename Column::scalar> column() const& {
        return std::get<storage<Column>>(columns_).values;
    }
    template <one_of<Columns...> Column>
    array_view<const typename Column::scalar> column() const&& = delete;

    /// Returns the scalars of one pixel.
    template <one_of<Columns...> Column, std::integral Index>
    std::span<typename Column::scalar, Column::channels> at(Index pixel) & {
        return detail::pixel_scalars<Column>(column<Column>(), pixel);
    }
    template <one_of<Columns...> Column, std::integral Index>
    std::span<const typename Column::scalar, Column::channels> at(Index pixel) const& {
        return detail::pixel_scalars<Column>(column<Column>(), pixel);
    }
    template <one_of<Columns...> Column, std::integral Index>
    std::span<const typename Column::scalar, Column::channels> at(Index pixel) const&& = delete;

    /// Replaces a column without a copy. Raises mismatch unless there are K x channels scalars.
    template <one_of<Columns...> Column>
    void set_column(buffer<typename Column::scalar> scalars) {
        const std::size_t count = detail::scalar_count<Column>(size());
        if (scalars.size() != count) detail::refuse_column_length(count, scalars.size());
        values<Column>() = std::move(scalars);
    }

    /// Calls edit(link_editor&), which may link and unlink pixels. During the call the image is empty; afterward it has its
    /// pixels again, even if `edit` throws. Views of the image's topology show the changes. Raises mismatch if `edit` assigned
    /// pixels to the image itself; the assigned pixels are lost.
    template <class Edit>
    void edit_links(Edit&& edit) {
        layered_image edited = std::move(*this);
        struct restorer {
            layered_image &image, &edited;
            graph_builder links;
            ~restorer() {
                edited.graph_ = std::move(links).build(detail::unchecked);
                image = std::move(edited);
            }
        } r{*this, edited, graph_builder(std::move(edited.graph_))};
        link_editor editor(r.links);
        edit(editor);
        if (size() > 0)
            raise(error_code::mismatch, "edit_links", "no assignment to the image during the call",
                  "an assignment of " + std::to_string(size()) + " pixels");
    }

    /// Moves pixel `order[i]` to index i. Raises mismatch unless `order` is a permutation of all pixels. After this error, or
    /// if memory runs out, the image is unchanged.
    void reorder(std::span<const std::int32_t> order) { *this = with_pixels(reordered(graph_, order), order); }

    /// Removes the pixels whose entry in `kept` is 0, and their links. The other pixels keep their order. If memory runs out,
    /// nothing changes.
    ///
    /// kept  K values, one per pixel; raises mismatch for any other number of values
    void keep(std::span<const std::uint8_t> kept) {
        if (kept.size() != size())
            raise(error_code::mismatch, "keep", std::to_string(size()) + " entries", std::to_string(kept.size()));
        buffer<std::int32_t> old_index, new_index(size(), no_pixel);
        for (std::int32_t i = 0; i < graph_.count(); ++i)
            if (kept.data()[i] != 0) new_index[i] = old_index.count(), old_index.push_back(i);
        graph_builder b(graph_.width(), graph_.height(), old_index.size(), unset);
        for (std::int32_t i = 0; i < old_index.count(); ++i) {
            const std::int32_t old = old_index[i];
            b.set_position(i, graph_.x()[old], graph_.y()[old]);
            for (const side s : all_sides) {
                const std::int32_t neighbor = graph_.neighbor(old, s);
                b.set_neighbor(i, s, neighbor == no_pixel ? no_pixel : new_index[neighbor]);
            }
        }
        *this = with_pixels(std::move(b).build(detail::unchecked), old_index);
    }

    /// Adds pixels: make(graph_builder) edits the topology that it receives and returns grown_pixels. Each new pixel continues an
    /// old pixel; the columns' rules compute its values from the values of the old pixel, on several threads at the same time.
    /// Returns grown_pixels::pieces. During the call the image is empty, but views of its columns stay valid. Raises mismatch if
    /// grown_pixels does not describe every pixel, if the lattice shrinks, or if `make` assigned pixels to the image itself.
    /// After this error, if `make` or a column's rule throws, or if memory runs out, the image remains empty (or, if `make`
    /// throws after such an assignment, keeps the assigned pixels).
    template <class Make, executor Executor = const serial_executor>
    buffer<grown_piece> grow(Make&& make, Executor&& threads = {}) {
        layered_image old = std::move(*this);
        const std::size_t old_count = old.size();
        const std::int32_t width = old.graph_.width(), height = old.graph_.height();
        grown_pixels grown = make(graph_builder(std::move(old.graph_)));
        if (size() > 0) {
            *this = layered_image();
            raise(error_code::mismatch, "grow", "no assignment to the image during the call", "an assignment");
        }
        if (!detail::is_complete(grown, old_count))
            raise(error_code::mismatch, "grow", "each old pixel once, and new pixels that continue old pixels",
                  std::to_string(old_count) + " old and " + std::to_string(grown.origins.size()) + " new pixels, " +
                      std::to_string(grown.topology.size()) + " in the graph, with pieces or origins that do not match");
        if (grown.topology.width() < width || grown.topology.height() < height)
            raise(error_code::mismatch, "grow", "a lattice of at least " + std::to_string(width) + " x " + std::to_string(height),
                  std::to_string(grown.topology.width()) + " x " + std::to_string(grown.topology.height()));
        layered_image result;
        const auto move_column = [&]<class Column>(std::type_identity<Column>) {
            result.template values<Column>() = old.template grown_column<Column>(grown, threads);
            old.template values<Column>() = {};  // releases memory, so that at most one column exists twice at a time
        };
        (move_column(std::type_identity<Columns>{}), ...);
        result.graph_ = std::move(grown.topology);
        *this = std::move(result);
        return std::move(grown.pieces);
    }

private:
    template <payload_column...>
    friend class layered_image;

    template <class Column>
    struct storage {
        buffer<typename Column::scalar> values;
    };

    template <class Column>
    buffer<typename Column::scalar>& values() {
        return std::get<storage<Column>>(columns_).values;
    }
    template <class Column>
    void zero_column() {
        values<Column>() = buffer<typename Column::scalar>(detail::scalar_count<Column>(size()));
    }

    /// Returns a layered image with graph `g`, whose pixel i has the values of pixel `old_index[i]` of this image.
    layered_image with_pixels(graph g, [[maybe_unused]] std::span<const std::int32_t> old_index) {
        layered_image result;
        ((result.template values<Columns>() = reordered(values<Columns>(), old_index, Columns::channels)), ...);
        result.graph_ = std::move(g);
        return result;
    }

    template <class Column, executor Executor>
    buffer<typename Column::scalar> grown_column(const grown_pixels& grown, Executor& threads) const {
        buffer<typename Column::scalar> result(detail::scalar_count<Column>(grown.topology.size()), unset);
        for_each_piece(threads, grown.pieces, [&](const grown_piece& p, std::int32_t first) {
            typename Column::scalar* to = result.data() + detail::scalar_count<Column>(static_cast<std::size_t>(first));
            if (!p.is_new) {
                std::copy_n(at<Column>(p.first).data(), detail::scalar_count<Column>(static_cast<std::size_t>(p.count)), to);
                return;
            }
            for (std::int32_t i = p.first; i < p.first + p.count; ++i)
                for (const typename Column::scalar& value : at<Column>(grown.origins[i]))
                    *to++ = detail::new_pixel_value<Column>(value);
        });
        return result;
    }

    graph graph_;
    std::tuple<storage<Columns>...> columns_;
};

/// Layered image of a photo.
using photo_layers = layered_image<color_column, disparity_column, known_column, matte_column>;

/// Checks the invariants of the topology, and that disparities are in [-1, 1]. Disparities of a photo are in [0, 1].
/// Disparities of hidden surfaces may be slightly below 0, because hidden surfaces continue behind other surfaces.
template <has_column<disparity_column> Layers>
std::optional<violation> validate(const Layers& layers) {
    if (const std::optional<violation> broken = validate(graph_view(layers.topology()))) return broken;
    const array_view<const float> disparity = layers.template column<disparity_column>();
    for (std::int32_t i = 0; i < disparity.count(); ++i)
        if (!(disparity[i] >= -1.0F && disparity[i] <= 1.0F)) return violation{invariant::disparity_in_range, i};
    return std::nullopt;
}

}}  // namespace ldi
