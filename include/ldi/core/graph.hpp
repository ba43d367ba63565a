// The topology of a layered depth image: K pixels on a lattice, each with at most one neighbor per side. Any number of pixels
// may share a position. This is the paper's 6 x K index tensor (section "Mapping the PConv Network to LDI"); each column is one
// row of the tensor. Graphs are immutable; core/graph_builder.hpp builds them.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A column or a row of a lattice. 16 bits suffice for pictures, and small positions save memory and bandwidth.
using lattice_coordinate = std::uint16_t;

/// Maximum width and height of a lattice. The largest coordinate lies outside every lattice.
inline constexpr std::int32_t max_lattice_side = 65535;

/// Index of a neighbor that does not exist.
inline constexpr std::int32_t no_pixel = -1;

/// The four sides of a pixel. Up is toward smaller y.
enum class side : std::uint8_t { up, down, left, right };

/// All sides in the paper's order of exploration.
inline constexpr side all_sides[] = {side::up, side::down, side::left, side::right};

constexpr side opposite(side s) {
    switch (s) {
        case side::up: return side::down;
        case side::down: return side::up;
        case side::left: return side::right;
        case side::right: break;
    }
    return side::left;
}

/// Whether the value is one of the four sides, which a cast does not guarantee.
constexpr bool is_side(side s) { return static_cast<std::uint8_t>(s) < 4; }

constexpr std::int32_t step_x(side s) { return s == side::left ? -1 : s == side::right ? 1 : 0; }
constexpr std::int32_t step_y(side s) { return s == side::up ? -1 : s == side::down ? 1 : 0; }

class graph_view;
class graph;
class graph_builder;

namespace detail {

[[noreturn]] inline void refuse_lattice(std::int32_t width, std::int32_t height) {
    const bool is_large = width >= 0 && height >= 0;
    raise(is_large ? error_code::too_large : error_code::invalid_option, "graph",
          "a lattice with a width and a height of 0 to " + std::to_string(max_lattice_side),
          std::to_string(width) + " x " + std::to_string(height));
}

inline void check_lattice(std::int32_t width, std::int32_t height) {
    if (width < 0 || height < 0 || width > max_lattice_side || height > max_lattice_side) refuse_lattice(width, height);
}

/// Returns a coordinate. A number outside every lattice becomes max_lattice_side, which is also outside.
constexpr lattice_coordinate to_coordinate(std::int32_t at) {
    return static_cast<lattice_coordinate>(at >= 0 && at < max_lattice_side ? at : max_lattice_side);
}

[[noreturn]] inline void refuse_pixel_count(std::size_t count) {
    raise(error_code::too_large, "graph", "fewer than 2^31 pixels", std::to_string(count));
}
inline constexpr std::size_t max_pixels = 0x7FFFFFFF;

/// Types of columns: owners or views.
struct owned_columns {
    template <class T>
    using column = buffer<T>;
};
struct viewed_columns {
    template <class T>
    using column = array_view<const T>;
};

/// The lattice and six columns of K entries each, read-only: positions and neighbors. Only graph_view, graph and graph_builder
/// can derive from this class and change its columns, so that other code cannot change a finished graph.
template <class Columns>
class index_columns {
    static constexpr bool is_owner = std::is_same_v<Columns, owned_columns>;

public:
    using index_view = array_view<const std::int32_t>;
    using coordinate_view = array_view<const lattice_coordinate>;

    /// Size of the lattice.
    std::int32_t width() const { return width_; }
    std::int32_t height() const { return height_; }

    /// Number of pixels K.
    std::size_t size() const { return x_.size(); }
    /// Returns K as std::int32_t, the type of ldi's indices.
    std::int32_t count() const { return x_.count(); }

    /// Positions of the pixels, K each.
    coordinate_view x() const& { return x_; }
    coordinate_view y() const& { return y_; }

    /// Index of each pixel's neighbor on side `s`, or no_pixel; K entries.
    index_view neighbors(side s) const& {
        LDI_ASSERT(is_side(s));
        return neighbors_[static_cast<std::size_t>(s)];
    }
    index_view up() const& { return neighbors(side::up); }
    index_view down() const& { return neighbors(side::down); }
    index_view left() const& { return neighbors(side::left); }
    index_view right() const& { return neighbors(side::right); }

    // No views of a temporary owner's columns, which would be destroyed with the owner.
    coordinate_view x() const&& requires is_owner = delete;
    coordinate_view y() const&& requires is_owner = delete;
    index_view neighbors(side) const&& requires is_owner = delete;
    index_view up() const&& requires is_owner = delete;
    index_view down() const&& requires is_owner = delete;
    index_view left() const&& requires is_owner = delete;
    index_view right() const&& requires is_owner = delete;

    template <std::integral Index>
    std::int32_t neighbor(Index pixel, side s) const {
        return neighbors(s)[pixel];
    }

    /// Number of lattice positions, W x H.
    std::size_t position_count() const { return static_cast<std::size_t>(std::int64_t{width_} * height_); }
    /// Row-major index of a lattice position.
    std::size_t position(std::int32_t at_x, std::int32_t at_y) const {
        return static_cast<std::size_t>(std::int64_t{at_y} * width_ + at_x);
    }
    std::size_t position_of(std::int32_t pixel) const { return position(x_[pixel], y_[pixel]); }

private:
    friend graph_view;
    friend graph;
    friend graph_builder;
    using index_column = typename Columns::template column<std::int32_t>;

    index_columns() = default;
    index_columns(const index_columns&) = default;
    index_columns(index_columns&&) noexcept = default;
    /// If memory runs out, the columns do not change.
    index_columns& operator=(const index_columns& other) { return *this = index_columns(other); }
    index_columns& operator=(index_columns&&) noexcept = default;
    ~index_columns() = default;
    index_columns(std::int32_t width, std::int32_t height) : width_(width), height_(height) { check_lattice(width, height); }

    index_column& column(side s) {
        LDI_ASSERT(is_side(s));
        return neighbors_[static_cast<std::size_t>(s)];
    }

    std::int32_t width_ = 0, height_ = 0;
    typename Columns::template column<lattice_coordinate> x_, y_;
    index_column neighbors_[4];
};

}  // namespace detail

/// Non-owning view of the columns. Every function that reads a topology accepts a graph_view, and a `graph` converts to it.
///
/// The owner guarantees the invariants of `graph`; core/validate.hpp checks them.
class graph_view final : public detail::index_columns<detail::viewed_columns> {
public:
    graph_view() = default;
    /// Raises mismatch unless all columns have the same length, invalid_option for a negative width or height, too_large for a
    /// side above max_lattice_side or 2^31 pixels or more.
    ///
    /// x, y                   K positions on a lattice of width x height
    /// up, down, left, right  K neighbors each, an index below K or no_pixel
    graph_view(std::int32_t width, std::int32_t height, coordinate_view x, coordinate_view y, index_view up, index_view down,
               index_view left, index_view right)
        : index_columns(width, height) {
        x_ = x, y_ = y;
        column(side::up) = up, column(side::down) = down, column(side::left) = left, column(side::right) = right;
        if (x.size() > detail::max_pixels) detail::refuse_pixel_count(x.size());
        for (const std::size_t entries : {y.size(), up.size(), down.size(), left.size(), right.size()})
            if (entries != x.size())
                raise(error_code::mismatch, "graph_view", std::to_string(x.size()) + " entries in every column",
                      std::to_string(entries));
    }
};

/// An immutable graph that owns its columns. Invariants: all columns have the same length; 0 <= x < width, 0 <= y <
/// height; links are mutual, `right()[left()[i]] == i`; the left neighbor of a pixel at (x, y) is at (x - 1, y), and similarly
/// on the other sides.
///
/// A stage documents whether it returns pixels in canonical order (core/canonical_order.hpp): by scanline, then by run.
class graph final : public detail::index_columns<detail::owned_columns> {
public:
    /// Makes a graph without pixels.
    graph() = default;
    graph(const graph&) = default;
    graph& operator=(const graph&) = default;
    /// The moved-from graph is empty.
    graph(graph&& other) noexcept : index_columns(std::move(other)) { other.width_ = other.height_ = 0; }
    graph& operator=(graph&& other) noexcept {
        index_columns::operator=(std::move(other));
        if (this != &other) other.width_ = other.height_ = 0;
        return *this;
    }
    ~graph() = default;

    operator graph_view() const& { return graph_view(width_, height_, x_, y_, up(), down(), left(), right()); }
    operator graph_view() const&& = delete;  // the view would outlive the graph

private:
    friend graph_builder;
    explicit graph(index_columns&& columns) : index_columns(std::move(columns)) {}
};

/// Whether two graphs have the same lattice and equal columns.
inline bool operator==(const graph_view& a, const graph_view& b) {
    if (a.width() != b.width() || a.height() != b.height() || !(a.x() == b.x()) || !(a.y() == b.y())) return false;
    for (const side s : all_sides)
        if (!(a.neighbors(s) == b.neighbors(s))) return false;
    return true;
}
inline bool operator==(const graph& a, const graph& b) { return graph_view(a) == graph_view(b); }

}}  // namespace ldi
