// Follows a surface of a layered image along a row or a column of the screen, from sample to sample. Depth peeling uses this
// class to find which surfaces at neighboring pixels are connected. The class uses integer arithmetic and the rasterizer's edge
// rule, so that both assign a sample to the same triangle.
#pragma once

#include "pixel_squares.hpp"

#include <ldi/core/graph.hpp>
#include <ldi/render/detail/screen_triangles.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi_quality {

/// One of the four triangles of a pixel, identified by the side that it touches.
struct surface_triangle {
    std::int32_t pixel = ldi::no_pixel;
    ldi::side outer = ldi::side::up;

    bool operator==(const surface_triangle&) const = default;
};

/// Whether the sample belongs to the triangle by the rule of for_each_span().
///
/// t  a triangle of positive area
inline bool holds_sample(const screen_triangle& t, std::int64_t x, std::int64_t y) {
    const std::int64_t px = x * subsample_steps + subsample_steps / 2, py = y * subsample_steps + subsample_steps / 2;
    for (std::size_t i = 0; i < 3; ++i) {
        const screen_vertex &a = t[i], &b = t[(i + 1) % 3];
        const std::int64_t dx = b.x - a.x, dy = b.y - a.y;
        const std::int64_t inside = dx * (py - a.y) - dy * (px - a.x);
        if (inside < 0 || (inside == 0 && !(dy < 0 || (dy == 0 && dx > 0)))) return false;
    }
    return true;
}

class surface_walk {
public:
    surface_walk(const ldi::graph_view& g, const pixel_squares& squares) : graph_(g), squares_(squares) {}

    /// Follows the surface from triangle `from`, which contains sample (x, y), to the next sample on the right or below. Returns
    /// the triangle there, or no pixel if the surface ends or folds back first.
    surface_triangle one_sample(surface_triangle from, std::int64_t x, std::int64_t y, ldi::side direction) const {
        const bool to_right = direction == ldi::side::right;
        const std::int64_t target_x = x + (to_right ? 1 : 0), target_y = y + (to_right ? 0 : 1);
        // The edge rule is equivalent to moving each sample right by e and down by e^2, for an infinitesimal e > 0. The line
        // through the samples moves in the same way: it meets no corner, and corners exactly on it count as before it.
        const std::int64_t line = (to_right ? y : x) * subsample_steps + subsample_steps / 2;
        const auto before_line = [&](const screen_vertex& v) { return (to_right ? v.y : v.x) <= line; };

        screen_triangle t = squares_.triangle(from.pixel, from.outer);
        const bool faces_us = signed_area(t) > 0;
        // A path to the right leaves a clockwise triangle through the edge that crosses the line downward. A path down leaves it
        // through the edge that crosses the line to the left.
        std::size_t exit = 3;
        for (std::size_t e = 0; e < 3; ++e)
            if (before_line(t[e]) != before_line(t[(e + 1) % 3]) && before_line(t[e]) == (to_right == faces_us)) exit = e;
        while (true) {
            const std::int64_t area = signed_area(t);
            if (area != 0) {
                if ((area > 0) != faces_us) return {};
                const screen_triangle clockwise{t[0], t[faces_us ? 1 : 2], t[faces_us ? 2 : 1]};
                if (holds_sample(clockwise, target_x, target_y)) return from;
            }
            const std::size_t entered = cross(from, exit);
            if (from.pixel == ldi::no_pixel || !squares_.is_drawn(from.pixel)) return {};
            t = squares_.triangle(from.pixel, from.outer);
            for (std::size_t e = 0; e < 3; ++e)
                if (e != entered && before_line(t[e]) != before_line(t[(e + 1) % 3])) exit = e;
        }
    }

private:
    /// Moves `from` to the triangle across one of its edges. Returns the same edge as numbered in the new triangle. Edges 0 and
    /// 2 run from the pixel's center to a corner; edge 1 is the pixel's side.
    std::size_t cross(surface_triangle& from, std::size_t edge) const {
        if (edge == 1) {
            from = {graph_.neighbor(from.pixel, from.outer), ldi::opposite(from.outer)};
            return 1;
        }
        const int turn = edge == 0 ? 3 : 1;
        from.outer = clockwise_sides[(clockwise_index(from.outer) + turn) % 4];
        return edge == 0 ? 2 : 0;
    }

    ldi::graph_view graph_;
    const pixel_squares& squares_;
};

}  // namespace ldi_quality
