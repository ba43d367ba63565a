#include <ldi/mesh/triangulate.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_polygons.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <limits>

namespace {

using ldi::testing::require_triangulation;
using ldi::testing::twice_area;

ldi::polygon closed(ldi::buffer<ldi::lattice_point> points) {
    ldi::polygon p;
    p.points = std::move(points);
    for (std::size_t v = 0; v < p.points.size(); ++v) p.next.push_back(static_cast<std::int32_t>((v + 1) % p.points.size()));
    p.outline_count = static_cast<std::int32_t>(p.points.size());
    return p;
}

std::int64_t sign(std::int64_t v) { return v < 0 ? -1 : v > 0 ? 1 : 0; }

bool on_segment(ldi::lattice_point p, ldi::lattice_point a, ldi::lattice_point b) {
    return twice_area(a, b, p) == 0 && std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
           p.y <= std::max(a.y, b.y);
}

bool meet(ldi::lattice_point a, ldi::lattice_point b, ldi::lattice_point c, ldi::lattice_point d) {
    if (on_segment(c, a, b) || on_segment(d, a, b) || on_segment(a, c, d) || on_segment(b, c, d)) return true;
    return sign(twice_area(a, b, c)) * sign(twice_area(a, b, d)) < 0 && sign(twice_area(c, d, a)) * sign(twice_area(c, d, b)) < 0;
}

// Whether a closed chain touches itself only where an edge follows another.
bool is_simple(const ldi::buffer<ldi::lattice_point>& points) {
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i) {
        const ldi::lattice_point a = points[i], b = points[(i + 1) % n], c = points[(i + 2) % n];
        if ((a.x == b.x && a.y == b.y) || on_segment(c, a, b) || on_segment(a, b, c)) return false;
        for (std::size_t j = i + 2; j < n; ++j) {
            if (i == 0 && j == n - 1) continue;
            if (meet(a, b, points[j], points[(j + 1) % n])) return false;
        }
    }
    return true;
}

}  // namespace

TEST_CASE("triangles cover charts of any shape exactly once and keep all edges") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    for (std::uint32_t seed = 0; seed < 4000; ++seed) {
        const ldi::testing::charted_graph c = ldi::testing::random_charts(seed, 10);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        std::mt19937 random(seed);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart) {
            const std::int32_t jitter = seed % 2 == 0 ? 0 : 2;
            ldi::polygon p = ldi::testing::chart_polygon(outlines, chart, 10, jitter, random);
            if (seed % 3 != 0) ldi::testing::add_inner_chains(p, c, chart, 10, random);
            REQUIRE_FALSE(triangulate(p, t));
            require_triangulation(p, t);
        }
    }
}

TEST_CASE(
    "a simple polygon is triangulated if it is clockwise; any other closed chain is a conflict or has a valid triangulation") {
    std::mt19937 random(7);
    ldi::triangulator triangulate;
    ldi::triangulation t;
    std::size_t simple = 0, other = 0;
    for (int i = 0; i < 60000; ++i) {
        const std::size_t count = 3 + random() % 6;
        ldi::buffer<ldi::lattice_point> points;
        for (std::size_t k = 0; k < count; ++k)
            points.push_back({static_cast<std::int32_t>(random() % 9) - 4, static_cast<std::int32_t>(random() % 9) - 4});
        const ldi::polygon p = closed(points);
        if (is_simple(points)) {
            ++simple;
            const bool clockwise = ldi::testing::twice_outline_area(p) > 0;
            REQUIRE(triangulate(p, t).has_value() == !clockwise);
            if (clockwise) require_triangulation(p, t);
        } else {
            ++other;
            // The polygon may still touch itself from outside; if it is accepted, all guarantees hold.
            if (const auto conflict = triangulate(p, t)) {
                REQUIRE_FALSE(conflict->edges.empty());
            } else {
                require_triangulation(p, t);
            }
        }
    }
    REQUIRE(simple > 5000);
    REQUIRE(other > 5000);
}

TEST_CASE("crossing edges, vertices on edges, and loops of one or two vertices are conflicts") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    const auto conflict = triangulate(closed({{0, 0}, {10, 10}, {10, 0}, {0, 10}}), t);
    REQUIRE(conflict);
    const auto names = [&](std::int32_t edge) {
        return std::find(conflict->edges.begin(), conflict->edges.end(), edge) != conflict->edges.end();
    };
    REQUIRE((names(0) || names(2)));
    REQUIRE(triangulate(closed({{0, 0}, {10, 0}, {10, 10}, {5, 0}, {0, 10}}), t));  // the fourth vertex lies on the first edge
    REQUIRE(triangulate(closed({{0, 0}, {10, 0}}), t));
    REQUIRE(triangulate(closed({{0, 0}}), t));
}

TEST_CASE("inner points outside the polygon, on its outline, or at the same position are conflicts") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    const ldi::polygon square = closed({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
    const auto with = [&](ldi::buffer<ldi::lattice_point> inner) {
        ldi::polygon p = square;
        for (const ldi::lattice_point& q : inner) p.points.push_back(q), p.next.push_back(-1);
        return p;
    };
    REQUIRE_FALSE(triangulate(with({{5, 5}, {6, 5}}), t));
    REQUIRE(t.triangles.size() == 3 * 6);
    REQUIRE(triangulate(with({{15, 5}}), t));
    REQUIRE(triangulate(with({{5, 15}}), t));
    REQUIRE(triangulate(with({{5, 0}}), t));
    REQUIRE(triangulate(with({{10, 10}}), t));
    REQUIRE(triangulate(with({{5, 5}, {5, 5}}), t));
}

TEST_CASE("many collinear vertices, vertical or horizontal, cause no degenerate triangle") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    for (bool transposed : {false, true}) {
        ldi::polygon p = closed({{0, 0}, {200, 0}, {200, 200}, {0, 200}});
        for (std::int32_t x = 20; x < 200; x += 20)
            for (std::int32_t y = 20; y < 200; y += 4) {
                p.points.push_back(transposed ? ldi::lattice_point{y, x} : ldi::lattice_point{x, y});
                p.next.push_back(y + 4 < 200 ? static_cast<std::int32_t>(p.points.size()) : -1);
            }
        REQUIRE_FALSE(triangulate(p, t));
        require_triangulation(p, t);
    }
}

TEST_CASE("the largest coordinates do not overflow") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    constexpr std::int32_t far_away = 1 << 16;
    ldi::polygon p = closed(
        {{-far_away, -far_away}, {far_away, -far_away + 1}, {far_away, far_away}, {0, far_away - 1}, {-far_away, far_away}});
    p.points.push_back({1, 0}), p.next.push_back(-1);
    REQUIRE_FALSE(triangulate(p, t));
    require_triangulation(p, t);
}

TEST_CASE("polygons with out-of-range vertex indices or coordinates are refused") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    const auto result_of = [&](auto change) {
        ldi::polygon p = closed({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
        change(p);
        return ldi::testing::raised([&] { triangulate(p, t); });
    };
    CHECK_FALSE(result_of([](auto&) {}));
    for (const std::int32_t wrong : {-2, 4, 7000, (std::numeric_limits<std::int32_t>::max)()})
        CHECK(result_of([&](auto& p) { p.next[2] = wrong; }) == ldi::error_code::mismatch);
    CHECK(result_of([](auto& p) { p.next.pop_back(); }) == ldi::error_code::mismatch);
    for (const std::int32_t wrong : {-1, 5})
        CHECK(result_of([&](auto& p) { p.outline_count = wrong; }) == ldi::error_code::mismatch);
    for (const std::int32_t wrong : {(1 << 16) + 1, (std::numeric_limits<std::int32_t>::min)()})
        CHECK(result_of([&](auto& p) { p.points[2].x = p.points[3].y = wrong; }) == ldi::error_code::too_large);
}
