// Polygons with holes, pinches and inner points made from random charts, and the requirements on their triangulations.
#pragma once

#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/triangulate.hpp>
#include <tests/mesh/random_charts.hpp>

#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace ldi::testing {

/// Twice the area, positive for a, b, c clockwise on screen.
inline std::int64_t twice_area(ldi::lattice_point a, ldi::lattice_point b, ldi::lattice_point c) {
    return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

inline std::int64_t twice_outline_area(const ldi::polygon& p) {
    std::int64_t area = 0;
    for (std::int32_t v = 0; v < p.outline_count; ++v) {
        const ldi::lattice_point a = p.points[static_cast<std::size_t>(v)];
        const ldi::lattice_point b = p.points[static_cast<std::size_t>(p.next[static_cast<std::size_t>(v)])];
        area += std::int64_t{a.x} * b.y - std::int64_t{b.x} * a.y;
    }
    return area;
}

/// The detailed outline of a chart. Scales its lattice by `scale`, and moves its corners by up to `jitter`, which is less than
/// a quarter of `scale`. A corner moves equally wherever it occurs, so that no new crossing appears.
inline ldi::polygon chart_polygon(const ldi::chart_outlines& outlines, std::size_t chart, std::int32_t scale, std::int32_t jitter,
                                  std::mt19937& random) {
    ldi::polygon result;
    std::map<std::pair<std::int32_t, std::int32_t>, ldi::lattice_point> moved;
    for (std::int32_t l = outlines.first_loop[chart]; l < outlines.first_loop[chart + 1]; ++l) {
        const std::int32_t loop_start = static_cast<std::int32_t>(result.points.size());
        for (std::int32_t s = outlines.first_step[static_cast<std::size_t>(l)];
             s < outlines.first_step[static_cast<std::size_t>(l) + 1]; ++s) {
            const ldi::outline_step step = outlines.steps[static_cast<std::size_t>(s)];
            const ldi::boundary_piece& p = outlines.pieces[static_cast<std::size_t>(step.piece)];
            ldi::buffer<std::int32_t> ids{p.start};
            for (std::int32_t i = 0; i < p.inner_count; ++i) ids.push_back(p.first_inner + i);
            ids.push_back(p.end);
            if (step.reversed) std::reverse(ids.begin(), ids.end());
            for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
                const ldi::outline_corner& c = outlines.corners[static_cast<std::size_t>(ids[i])];
                const auto move = [&] {
                    return jitter == 0
                               ? 0
                               : static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(2 * jitter + 1)) - jitter;
                };
                const auto [at, is_new] = moved.try_emplace({c.x, c.y});
                if (is_new) at->second = {c.x * scale + move(), c.y * scale + move()};
                result.points.push_back(at->second);
                result.next.push_back(static_cast<std::int32_t>(result.points.size()));
            }
        }
        result.next.back() = loop_start;
    }
    result.outline_count = static_cast<std::int32_t>(result.points.size());
    return result;
}

/// Adds single points and vertical polylines near the middle of pixels, out of reach of jittered outlines.
inline void add_inner_chains(ldi::polygon& p, const charted_graph& c, std::size_t chart, std::int32_t scale,
                             std::mt19937& random) {
    for (std::int32_t pixel : c.charts.charts[chart].pixels) {
        const std::size_t i = static_cast<std::size_t>(pixel);
        if (random() % 3 != 0) continue;
        const std::int32_t x = c.topology.x()[i] * scale + scale / 2, y = c.topology.y()[i] * scale + scale / 2;
        const std::int32_t count = 1 + static_cast<std::int32_t>(random() % 3);
        for (std::int32_t k = 0; k < count; ++k) {
            p.points.push_back({x, y + k});
            p.next.push_back(k + 1 < count ? static_cast<std::int32_t>(p.points.size()) : -1);
        }
    }
}

/// Checks all guarantees of triangulate.hpp.
inline void require_triangulation(const ldi::polygon& p, const ldi::triangulation& t) {
    const auto at = [&](std::uint32_t v) { return p.points[v]; };
    REQUIRE(t.triangles.size() % 3 == 0);
    REQUIRE(t.mates.size() == t.triangles.size());
    std::int64_t area = 0;
    std::set<std::uint32_t> used;
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (std::size_t f = 0; f < t.triangles.size(); f += 3) {
        const std::int64_t a = twice_area(at(t.triangles[f]), at(t.triangles[f + 1]), at(t.triangles[f + 2]));
        REQUIRE(a < 0);  // counter-clockwise on screen
        area -= a;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t h = f + k, next = f + (k + 1) % 3;
            used.insert(t.triangles[h]);
            // No two edges have the same vertices in the same order. Where two parts of the outline coincide, each has its own
            // vertices.
            REQUIRE(edges.emplace(t.triangles[h], t.triangles[next]).second);
            const std::int32_t mate = t.mates[h];
            if (mate < 0) continue;
            const std::size_t m = static_cast<std::size_t>(mate), m_next = m % 3 == 2 ? m - 2 : m + 1;
            REQUIRE(t.mates[m] == static_cast<std::int32_t>(h));
            REQUIRE(t.triangles[m] == t.triangles[next]);
            REQUIRE(t.triangles[m_next] == t.triangles[h]);
        }
    }
    // No triangle is inverted and their areas add up: they cover the polygon exactly once.
    REQUIRE(area == twice_outline_area(p));
    REQUIRE(used.size() == p.points.size());
    for (std::size_t v = 0; v < p.points.size(); ++v) {
        if (p.next[v] < 0) continue;
        const std::uint32_t a = static_cast<std::uint32_t>(v), b = static_cast<std::uint32_t>(p.next[v]);
        // The chart lies right of its outline, and triangles lie left of their edges, so triangles have the reversed edges.
        REQUIRE(edges.count({b, a}) == 1);
        if (a >= static_cast<std::uint32_t>(p.outline_count)) REQUIRE(edges.count({a, b}) == 1);
    }
}

}  // namespace ldi::testing
