// Walks along the boundaries of charts and around the corners of pixels. Sides and corners of a pixel are numbered clockwise
// from the top: side 0 is up, 1 right, 2 down, 3 left; side s runs from corner s to corner s + 1, so a chart lies to the right
// of its boundary.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/graph.hpp>

#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

constexpr int clockwise(int s) { return (s + 1) & 3; }
constexpr int counter_clockwise(int s) { return (s + 3) & 3; }
constexpr int across(int s) { return (s + 2) & 3; }
constexpr std::uint8_t side_bit(int s) { return static_cast<std::uint8_t>(1U << s); }
constexpr std::int32_t heading_x(int s) { return s == 0 ? 1 : s == 2 ? -1 : 0; }
constexpr std::int32_t heading_y(int s) { return s == 1 ? 1 : s == 3 ? -1 : 0; }

/// Lattice point of corner c of a pixel.
inline std::int32_t corner_x(const graph_view& g, std::int32_t pixel, int c) { return g.x()[pixel] + (c == 1 || c == 2 ? 1 : 0); }
inline std::int32_t corner_y(const graph_view& g, std::int32_t pixel, int c) { return g.y()[pixel] + (c >= 2 ? 1 : 0); }

/// Returns one byte per pixel: bit s is set if side s of the pixel has no neighbor in the same chart.
///
/// g         a graph whose invariants hold
/// chart_of  one chart per pixel
///
/// Raises mismatch if a right neighbor is not the next pixel, as it is in canonical order.
inline buffer<std::uint8_t> mark_boundary_sides(const graph_view& g, std::span<const std::int32_t> chart_of) {
    constexpr std::uint8_t up = side_bit(0), right = side_bit(1), down = side_bit(2), left = side_bit(3);
    const std::int32_t count = g.count();
    buffer<std::uint8_t> sides(g.size(), up | right | down | left);
    const std::int32_t* const chart = chart_of.data();
    const std::int32_t *const g_right = g.right().data(), *const g_down = g.down().data();
    std::uint8_t* const bits = sides.data();
    const auto clear = [](std::uint8_t& byte, std::uint8_t bit) { byte = static_cast<std::uint8_t>(byte & ~bit); };
    // Most runs of `stretch` pixels belong to one chart and lie above a run of the same chart. Such runs need no branch per
    // pixel.
    constexpr std::int32_t stretch = 16;
    std::int32_t i = 0;
    while (i < count) {
        const std::int32_t below = g_down[i], here = chart[i];
        std::int32_t end = count;
        if (i + stretch < count) {
            end = i + stretch;
            if (below >= 0 && below + stretch <= count) {
                std::int32_t difference = 0;
                for (std::int32_t k = 0; k < stretch; ++k)
                    difference |= (chart[i + k + 1] ^ here) | (chart[below + k] ^ here) | (g_right[i + k] ^ (i + k + 1)) |
                                  (g_down[i + k] ^ (below + k));
                if (difference == 0) {
                    for (std::int32_t k = 0; k < stretch; ++k) clear(bits[i + k], right | down);
                    for (std::int32_t k = 1; k <= stretch; ++k) clear(bits[i + k], left);
                    for (std::int32_t k = 0; k < stretch; ++k) clear(bits[below + k], up);
                    i = end;
                    continue;
                }
            }
        }
        for (; i < end; ++i) {
            const std::int32_t r = g_right[i], d = g_down[i];
            if (r != no_pixel) {
                if (r != i + 1)
                    raise(error_code::mismatch, "mesh", "pixels in canonical order",
                          "pixel " + std::to_string(i) + " whose right neighbor is not the next pixel");
                if (chart[r] == chart[i]) clear(bits[i], right), clear(bits[r], left);
            }
            if (d != no_pixel && chart[d] == chart[i]) clear(bits[i], down), clear(bits[d], up);
        }
    }
    return sides;
}

/// Lists the pixels with a boundary side, in ascending order. Reads eight pixels at a time, because most have no boundary side.
inline buffer<std::int32_t> pixels_with_boundary(const buffer<std::uint8_t>& sides) {
    buffer<std::int32_t> pixels;
    pixels.reserve(sides.size() / 16);
    for (std::int32_t i = 0; i < sides.count(); ++i) {
        std::uint64_t eight = 1;
        if (sides.count() - i >= 8) std::memcpy(&eight, sides.data() + i, sizeof eight);
        if (eight == 0)
            i += 7;
        else if (sides[i] != 0)
            pixels.push_back(i);
    }
    return pixels;
}

/// One side of one pixel: a step of a boundary.
struct pixel_side {
    std::int32_t pixel;
    int side;
    friend bool operator==(const pixel_side&, const pixel_side&) = default;
};

/// One corner of one pixel. visit_corner_class() finds the pixels that share it.
struct pixel_corner {
    std::int32_t pixel;
    int corner;
    friend bool operator==(const pixel_corner&, const pixel_corner&) = default;
};

/// Follows the boundaries of charts, pixel side by pixel side, in a graph whose boundary sides are marked.
class boundary_walker {
public:
    boundary_walker(const graph_view& g, const buffer<std::uint8_t>& sides)
        : sides_(sides.data()), links_{g.up().data(), g.right().data(), g.down().data(), g.left().data()} {}

    std::int32_t neighbor(std::int32_t pixel, int s) const { return links_[s][pixel]; }
    bool is_boundary(std::int32_t pixel, int s) const { return (sides_[pixel] & side_bit(s)) != 0; }
    pixel_side twin(pixel_side e) const { return {neighbor(e.pixel, e.side), across(e.side)}; }

    /// Returns the boundary side that follows `e` clockwise around the same chart. Calls `visit` for every pixel between the two
    /// sides.
    template <class Visitor>
    pixel_side next(pixel_side e, Visitor&& visit) const {
        return turn<clockwise, counter_clockwise>(e, visit);
    }
    pixel_side next(pixel_side e) const {
        return next(e, [](std::int32_t) {});
    }

    /// Returns the boundary side that precedes `e`.
    template <class Visitor>
    pixel_side previous(pixel_side e, Visitor&& visit) const {
        return turn<counter_clockwise, clockwise>(e, visit);
    }

    /// Visits all pixels that share the corner `c`: those that links connect around its lattice point, even across charts. The
    /// order does not depend on which of these pixels `c` refers to. Returns the first pixel's corner, which identifies the
    /// shared corner.
    template <class Visitor>
    pixel_corner visit_corner_class(pixel_corner c, Visitor&& visit) const {
        pixel_corner first = c, smallest = c;
        while (true) {  // links around a point form a path or a ring
            const std::int32_t n = neighbor(first.pixel, first.corner);
            if (n == no_pixel) break;
            first = {n, counter_clockwise(first.corner)};
            if (first.pixel < smallest.pixel) smallest = first;
            if (first == c) {
                first = smallest;
                break;
            }
        }
        pixel_corner at = first;
        do {
            visit(at.pixel);
            const std::int32_t n = neighbor(at.pixel, counter_clockwise(at.corner));
            if (n == no_pixel) break;
            at = {n, clockwise(at.corner)};
        } while (!(at == first));
        return first;
    }

private:
    /// Finds the boundary side next to side `e`. `first` selects the side after `e` in the same pixel. After each step into a
    /// neighboring pixel, `then` selects the side to test there.
    template <int (*first)(int), int (*then)(int), class Visitor>
    pixel_side turn(pixel_side e, Visitor&& visit) const {
        visit(e.pixel);
        e.side = first(e.side);
        while (!is_boundary(e.pixel, e.side)) {
            e.pixel = neighbor(e.pixel, e.side);
            visit(e.pixel);
            e.side = then(e.side);
        }
        return e;
    }

    const std::uint8_t* sides_;
    const std::int32_t* links_[4];
};

}}}  // namespace ldi::detail
