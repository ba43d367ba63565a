// Builds graphs: adds pixels and links to an empty or existing graph, then returns the result.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/validate.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {
/// Tag for overloads that skip a check. The caller guarantees what the check would verify.
struct unchecked_t {
    explicit unchecked_t() = default;  // build({}) must not compile
};
inline constexpr unchecked_t unchecked{};
}  // namespace detail

/// A graph under construction. Its columns can be read like those of a finished graph.
///
///     graph_builder b(6, 4);                             // a lattice of 6 x 4
///     const auto a = b.add_pixel(0, 0), c = b.add_pixel(1, 0);
///     b.link(a, side::right, c);
///     const graph g = std::move(b).build();
class graph_builder : public detail::index_columns<detail::owned_columns> {
public:
    /// width, height  size of the lattice; raises invalid_option for a negative side, too_large for one above max_lattice_side
    /// count          number of initial pixels, all at (0, 0) and without links; raises too_large for 2^31 or more
    graph_builder(std::int32_t width, std::int32_t height, std::size_t count = 0) : index_columns(width, height) {
        if (count > detail::max_pixels) detail::refuse_pixel_count(count);
        x_.resize(count), y_.resize(count);
        for (const side s : all_sides) column(s).resize(count, no_pixel);
    }
    /// Leaves positions and neighbors uninitialized, for callers that set all of them with set_position() and
    /// set_neighbor().
    graph_builder(std::int32_t width, std::int32_t height, std::size_t count, unset_t) : index_columns(width, height) {
        if (count > detail::max_pixels) detail::refuse_pixel_count(count);
        x_.resize(count, unset), y_.resize(count, unset);
        for (const side s : all_sides) column(s).resize(count, unset);
    }
    /// Starts from an existing graph, or from a copy of a view. Takes over the columns of a moved graph: earlier views of that
    /// graph show the builder's changes.
    explicit graph_builder(graph g) : index_columns(std::move(g)) {}
    explicit graph_builder(const graph_view& g) : index_columns(g.width(), g.height()) {
        x_ = g.x().copy(), y_ = g.y().copy();
        for (const side s : all_sides) column(s) = g.neighbors(s).copy();
    }

    /// Appends an unlinked pixel and returns its index. Asserts that its position lies inside the lattice. Raises too_large if
    /// there are already 2^31 - 1 pixels.
    std::int32_t add_pixel(std::int32_t at_x, std::int32_t at_y) {
        LDI_ASSERT(at_x >= 0 && at_y >= 0 && at_x < width_ && at_y < height_);
        if (size() >= detail::max_pixels) detail::refuse_pixel_count(size() + 1);
        make_room(x_), make_room(y_);  // reserves in all columns first, so that their lengths stay equal
        for (const side s : all_sides) make_room(column(s));
        x_.push_back(detail::to_coordinate(at_x)), y_.push_back(detail::to_coordinate(at_y));
        for (const side s : all_sides) column(s).push_back(no_pixel);
        return count() - 1;
    }

    /// Whether both pixels exist, side `s` of `a` and the opposite side of `b` are free, and `b` is one step from `a` toward `s`.
    bool can_link(std::int32_t a, side s, std::int32_t b) const {
        return is_side(s) && exists(a) && exists(b) && neighbor(a, s) == no_pixel && neighbor(b, opposite(s)) == no_pixel &&
               x_[b] - x_[a] == step_x(s) && y_[b] - y_[a] == step_y(s);
    }
    bool exists(std::int32_t pixel) const { return static_cast<std::size_t>(pixel) < size(); }

    /// Makes `b` the neighbor of `a` on side `s`, and `a` the neighbor of `b` on the opposite side. Asserts can_link(). Release
    /// builds do not check it, because building a large graph would take a fifth longer.
    void link(std::int32_t a, side s, std::int32_t b) {
        LDI_ASSERT(can_link(a, s, b));
        column(s)[a] = b, column(opposite(s))[b] = a;
    }

    /// Removes the link of `a` on side `s`, if any. Asserts that the pixel exists.
    void unlink(std::int32_t a, side s) {
        LDI_ASSERT(is_side(s) && exists(a));
        std::int32_t& there = column(s)[a];
        if (exists(there)) column(opposite(s))[there] = no_pixel;  // set_neighbor() may have stored any number
        there = no_pixel;
    }

    /// Moves a pixel without checking its links. Asserts that the pixel exists. Stores a coordinate outside every lattice as
    /// max_lattice_side. No function returns a writable view of a column, because the caller could change the graph through it
    /// after build().
    void set_position(std::int32_t pixel, std::int32_t at_x, std::int32_t at_y) {
        x_[pixel] = detail::to_coordinate(at_x), y_[pixel] = detail::to_coordinate(at_y);
    }
    /// Sets one direction of a link: the neighbor of `pixel` on side `s`, an index or no_pixel. The caller must also set the
    /// opposite direction. Asserts that the pixel and the side exist. Threads may set different pixels or sides at the same
    /// time.
    void set_neighbor(std::int32_t pixel, side s, std::int32_t neighbor) { column(s)[pixel] = neighbor; }

    /// Replaces the lattice and all columns, one column after another, so that at most one column exists twice. Raises the
    /// constructor's errors for the new size. The caller guarantees columns of equal length and the invariants of `graph`. If a
    /// callable throws, the builder must not be used again.
    ///
    /// width, height  size of the new lattice
    /// x, y           x(old) and y(old) return the new positions, K' each; `old` is the column that they replace
    /// neighbors      neighbors(s, old) returns the new neighbors on side `s`, K' indices or no_pixel
    template <class X, class Y, class Neighbors>
    void replace_columns(detail::unchecked_t, std::int32_t width, std::int32_t height, X&& x, Y&& y, Neighbors&& neighbors) {
        detail::check_lattice(width, height);
        width_ = width, height_ = height;
        x_ = x(coordinate_view(x_)), y_ = y(coordinate_view(y_));
        for (const side s : all_sides) column(s) = neighbors(s, index_view(column(s)));
    }

    /// Returns the finished graph. Raises mismatch if an invariant of `graph` does not hold, even in release builds. After this
    /// error, the builder is unchanged. Linear time.
    [[nodiscard]] graph build() && {
        if (const std::optional<violation> found = validate(view())) found->refuse("graph_builder");
        return graph(std::move(*this));
    }
    /// Returns the finished graph. The caller guarantees the invariants; debug builds assert them.
    [[nodiscard]] graph build(detail::unchecked_t) && {
        LDI_ASSERT(!validate(view()));
        return graph(std::move(*this));
    }

private:
    template <class T>
    static void make_room(buffer<T>& column) {
        if (column.size() == column.capacity()) column.reserve(column.size() + column.size() / 2 + 4);
    }
    graph_view view() const { return graph_view(width_, height_, x_, y_, up(), down(), left(), right()); }
};

/// Makes a fully linked single layer, equivalent to an ordinary image. Pixel (x, y) has index y * width + x. Raises
/// invalid_option for a negative size, too_large for a side above max_lattice_side or 2^31 pixels or more.
inline graph make_grid(std::int32_t width, std::int32_t height) {
    const std::int64_t pixels = std::int64_t{width} * height;
    if (width < 0 || height < 0) detail::refuse_lattice(width, height);
    if (pixels > 0x7FFFFFFF)
        raise(error_code::too_large, "make_grid", "fewer than 2^31 pixels",
              std::to_string(width) + " x " + std::to_string(height));
    graph_builder g(width, height, static_cast<std::size_t>(pixels), unset);
    std::int32_t i = 0;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x, ++i) {
            g.set_position(i, x, y);
            g.set_neighbor(i, side::up, y > 0 ? i - width : no_pixel);
            g.set_neighbor(i, side::down, y + 1 < height ? i + width : no_pixel);
            g.set_neighbor(i, side::left, x > 0 ? i - 1 : no_pixel);
            g.set_neighbor(i, side::right, x + 1 < width ? i + 1 : no_pixel);
        }
    return std::move(g).build(detail::unchecked);
}

}}  // namespace ldi
