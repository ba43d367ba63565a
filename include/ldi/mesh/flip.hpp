// Flips edges of a triangulation until it is constrained Delaunay (C. L. Lawson 1977). The sweep (triangulate.hpp) creates fans
// of thin triangles, which would interpolate disparity between distant vertices.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/mesh/polygon.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Flips every edge whose two opposite angles sum to more than 180 degrees, except edges of the polygon's chains. Compares angles
/// in integer arithmetic.
///
/// points  of the triangulated polygon
/// t       triangulation from triangulator; changed in place
/// stack   working memory; pass the same buffer again to reuse its memory
///
/// Raises mismatch for an index that `points` or `t` does not have, and for half-edges that are not each other's mates.
inline void flip_to_delaunay(std::span<const lattice_point> points, triangulation& t, buffer<std::int32_t>& stack);

namespace detail {

constexpr std::int32_t next_half_edge(std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }

inline void check_triangulation(std::size_t points, const triangulation& t) {
    const std::int32_t count = t.mates.count();
    bool is_sound = t.triangles.size() == t.mates.size() && count % 3 == 0;
    for (std::int32_t h = 0; is_sound && h < count; ++h) {
        const std::int32_t m = t.mates[h];
        is_sound = t.triangles[h] < points && (m == -1 || (m >= 0 && m < count && m / 3 != h / 3 && t.mates[m] == h));
    }
    if (!is_sound)
        raise(error_code::mismatch, "flip_to_delaunay", "a consistent triangulation of " + std::to_string(points) + " points",
              "an index out of range, or half-edges that are not mates of each other");
}

/// Replaces the edge of half-edge h, between triangles a b c and b a d, with the edge c d.
inline void flip(triangulation& t, std::int32_t h) {
    const std::int32_t m = t.mates[h];
    const std::int32_t h1 = next_half_edge(h), h2 = next_half_edge(h1), m1 = next_half_edge(m), m2 = next_half_edge(m1);
    // a -> d -> c replaces the first triangle, b -> c -> d the second.
    t.triangles[h1] = t.triangles[m2];
    t.triangles[m1] = t.triangles[h2];
    const auto connect = [&](std::int32_t from, std::int32_t to) {
        t.mates[from] = to;
        if (to >= 0) t.mates[to] = from;
    };
    const std::int32_t beyond_bc = t.mates[h1], beyond_ad = t.mates[m1];
    connect(h, beyond_ad);
    connect(m, beyond_bc);
    connect(h1, m1);
}

}  // namespace detail

inline void flip_to_delaunay(std::span<const lattice_point> points, triangulation& t, buffer<std::int32_t>& stack) {
    using detail::next_half_edge;
    detail::check_triangulation(points.size(), t);
    stack.clear();
    for (std::int32_t h = 0; h < t.mates.count(); ++h)
        if (t.mates[h] > h) stack.push_back(h);
    std::int32_t extent = 1;
    for (const lattice_point& p : points) extent = (std::max)({extent, p.x, p.y, -p.x, -p.y});
    int shift = 0;  // keeps products of four coordinate differences within 64 bits
    for (; extent > 1 << 14; extent >>= 1) ++shift;
    shift *= 2;
    // The shift rounds the angles, so flipping is not proven to terminate. This limit is far above any practical number of flips.
    std::size_t flips_left = 64 * t.triangles.size();
    while (!stack.empty() && flips_left > 0) {
        const std::int32_t h = stack.back();
        stack.pop_back();
        if (t.mates[h] < 0) continue;
        const std::int32_t m = t.mates[h];
        const std::int32_t h1 = next_half_edge(h), h2 = next_half_edge(h1), m1 = next_half_edge(m), m2 = next_half_edge(m1);
        const lattice_point a = points[t.triangles[h]], b = points[t.triangles[h1]], c = points[t.triangles[h2]],
                            d = points[t.triangles[m2]];
        const std::int64_t ca_x = a.x - c.x, ca_y = a.y - c.y, cb_x = b.x - c.x, cb_y = b.y - c.y;
        const std::int64_t da_x = a.x - d.x, da_y = a.y - d.y, db_x = b.x - d.x, db_y = b.y - d.y;
        // The edge is flipped if the angles at c and d, each between 0 and 180 degrees, sum to more than 180. The sine of their
        // sum is then negative. `orientation` is this sine times a positive factor.
        const std::int64_t cos_c = (ca_x * cb_x + ca_y * cb_y) >> shift, cos_d = (da_x * db_x + da_y * db_y) >> shift;
        const std::int64_t sin_c = (cb_x * ca_y - cb_y * ca_x) >> shift, sin_d = (da_x * db_y - da_y * db_x) >> shift;
        const std::int64_t orientation = sin_c * cos_d + cos_c * sin_d;
        if (!(cos_c < 0 && cos_d < 0) && (cos_c >= 0 && cos_d >= 0 ? true : orientation >= 0)) continue;
        // Only a strictly convex quadrilateral has a second diagonal.
        if (detail::turn(c, a, d) >= 0 || detail::turn(d, b, c) >= 0) continue;
        detail::flip(t, h);
        --flips_left;
        for (std::int32_t side : {h, h2, m, m2}) stack.push_back(side);
    }
}

}}  // namespace ldi
