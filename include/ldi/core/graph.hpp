// The topology of a layered depth image: K pixels on a lattice, any number of them at one position, each with at most one
// neighbor per side. This is the paper's 6 x K index tensor (section "Mapping the PConv Network to LDI"); each column is one of
// its rows.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

/// The index of a neighbor that does not exist.
inline constexpr std::int32_t no_pixel = -1;

/// The four sides of a pixel. Up is towards smaller y.
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

constexpr std::int32_t step_x(side s) { return s == side::left ? -1 : s == side::right ? 1 : 0; }
constexpr std::int32_t step_y(side s) { return s == side::up ? -1 : s == side::down ? 1 : 0; }

/// Invariants (core/validate.hpp checks them): all columns have the same length; 0 <= x < width, 0 <= y < height; links are
/// mutual, `right[left[i]] == i`; the left neighbor of a pixel at (x, y) lies at (x - 1, y), and likewise on the other sides.
///
/// Order is canonical where a stage says so (core/canonical_order.hpp): scanline by scanline, in a scanline run by run.
struct graph {
    std::int32_t width = 0, height = 0;          ///< of the lattice
    buffer<std::int32_t> x, y;                   ///< position, K each
    buffer<std::int32_t> up, down, left, right;  ///< neighbor's index or no_pixel, K each

    std::size_t size() const { return x.size(); }
    /// K as a pixel's index.
    std::int32_t count() const { return x.count(); }

    /// Positions on the lattice, W x H of them, and which of these (x, y) is, row by row.
    std::size_t position_count() const { return static_cast<std::size_t>(std::int64_t{width} * height); }
    std::size_t position(std::int32_t at_x, std::int32_t at_y) const {
        return static_cast<std::size_t>(std::int64_t{at_y} * width + at_x);
    }
    std::size_t position_of(std::int32_t pixel) const { return position(x[pixel], y[pixel]); }

    buffer<std::int32_t>& neighbors(side s) { return const_cast<buffer<std::int32_t>&>(std::as_const(*this).neighbors(s)); }
    const buffer<std::int32_t>& neighbors(side s) const {
        switch (s) {
            case side::up: return up;
            case side::down: return down;
            case side::left: return left;
            case side::right: break;
        }
        return right;
    }

    std::int32_t neighbor(std::int32_t pixel, side s) const { return neighbors(s)[pixel]; }

    /// Makes room for K pixels; new ones are unset.
    void resize(std::size_t count) {
        for (buffer<std::int32_t>* column : {&x, &y, &up, &down, &left, &right}) column->resize(count);
    }

    /// Appends an unlinked pixel and returns its index.
    std::int32_t add_pixel(std::int32_t pixel_x, std::int32_t pixel_y) {
        x.push_back(pixel_x), y.push_back(pixel_y);
        for (side s : all_sides) neighbors(s).push_back(no_pixel);
        return count() - 1;
    }

    /// Makes `b` the neighbor of `a` on side `s`, and `a` that of `b` on the opposite side. Both sides must be free.
    void link(std::int32_t a, side s, std::int32_t b) {
        std::int32_t& there = neighbors(s)[a];
        std::int32_t& back = neighbors(opposite(s))[b];
        LDI_ASSERT(there == no_pixel && back == no_pixel);
        there = b, back = a;
    }

    /// Removes the link of `a` on side `s`, if there is one.
    void unlink(std::int32_t a, side s) {
        std::int32_t& there = neighbors(s)[a];
        if (there == no_pixel) return;
        neighbors(opposite(s))[there] = no_pixel;
        there = no_pixel;
    }
};

/// A fully linked single layer: what an ordinary image is. Pixel (x, y) has index y * width + x. Raises too_large if there are
/// 2^31 pixels or more.
inline graph make_grid(std::int32_t width, std::int32_t height) {
    LDI_ASSERT(width >= 0 && height >= 0);
    graph g;
    g.width = width, g.height = height;
    if (g.position_count() > 0x7FFFFFFF)
        raise(error_code::too_large, "make_grid", "fewer than 2^31 pixels",
              std::to_string(width) + " x " + std::to_string(height));
    g.resize(g.position_count());
    std::int32_t i = 0;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x, ++i) {
            g.x[i] = x, g.y[i] = y;
            g.up[i] = y > 0 ? i - width : no_pixel;
            g.down[i] = y + 1 < height ? i + width : no_pixel;
            g.left[i] = x > 0 ? i - 1 : no_pixel;
            g.right[i] = x + 1 < width ? i + 1 : no_pixel;
        }
    return g;
}

}  // namespace ldi
