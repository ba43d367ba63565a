#include <ldi/mesh/flip.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_polygons.hpp>
#include <tests/support/errors.hpp>

namespace {

// Positive if d lies inside the circle around a, b, c, which are counter-clockwise on screen (y downward).
std::int64_t in_circle(ldi::lattice_point a, ldi::lattice_point b, ldi::lattice_point c, ldi::lattice_point d) {
    const std::int64_t ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y, cx = c.x - d.x, cy = c.y - d.y;
    const std::int64_t aa = ax * ax + ay * ay, bb = bx * bx + by * by, cc = cx * cx + cy * cy;
    return -(ax * (by * cc - bb * cy) - ay * (bx * cc - bb * cx) + aa * (bx * cy - by * cx));
}

}  // namespace

TEST_CASE("flipping makes every inner edge that is not part of a chain locally Delaunay, and keeps the triangulation valid") {
    ldi::triangulator triangulate;
    ldi::triangulation t;
    ldi::buffer<std::int32_t> stack;
    std::size_t inner_edges = 0;
    for (std::uint32_t seed = 0; seed < 2000; ++seed) {
        const ldi::testing::charted_graph c = ldi::testing::random_charts(seed, 12);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        std::mt19937 random(seed);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart) {
            ldi::polygon p = ldi::testing::chart_polygon(outlines, chart, 10, seed % 2 == 0 ? 0 : 2, random);
            ldi::testing::add_inner_chains(p, c, chart, 10, random);
            REQUIRE_FALSE(triangulate(p, t));
            ldi::flip_to_delaunay(p.points, t, stack);
            ldi::testing::require_triangulation(p, t);
            for (std::size_t h = 0; h < t.mates.size(); ++h) {
                if (t.mates[h] < 0) continue;
                const std::size_t f = h - h % 3, m = static_cast<std::size_t>(t.mates[h]);
                const std::size_t beyond = m % 3 == 0 ? m + 2 : m - 1;
                ++inner_edges;
                REQUIRE(in_circle(p.points[t.triangles[f]], p.points[t.triangles[f + 1]], p.points[t.triangles[f + 2]],
                                  p.points[t.triangles[beyond]]) <= 0);
            }
        }
    }
    REQUIRE(inner_edges > 100000);
}

TEST_CASE("flipping selects the shorter diagonal of a kite") {
    ldi::polygon p;
    p.points = {{0, -1}, {10, 0}, {0, 1}, {-10, 0}};
    p.next = {1, 2, 3, 0};
    p.outline_count = 4;
    ldi::triangulation t;
    ldi::buffer<std::int32_t> stack;
    for (const auto& [first, second] : {std::pair{0, 2}, std::pair{1, 3}}) {
        // Both triangulations of the kite.
        const std::uint32_t a = static_cast<std::uint32_t>(first), c = static_cast<std::uint32_t>(second);
        const std::uint32_t b = (a + 1) % 4, d = (c + 1) % 4;
        t.triangles = {c, b, a, a, d, c};
        t.mates = {-1, -1, 5, -1, -1, 2};
        ldi::flip_to_delaunay(p.points, t, stack);
        ldi::testing::require_triangulation(p, t);
        bool has_short_diagonal = false;
        for (std::size_t h = 0; h < 6; ++h)
            if (t.triangles[h] == 0 && t.triangles[h % 3 == 2 ? h - 2 : h + 1] == 2) has_short_diagonal = true;
        REQUIRE(has_short_diagonal);
    }
}

TEST_CASE("the triangulation stays valid after flipping with coordinates beyond 2^14") {
    std::mt19937 random(3);
    ldi::triangulator triangulate;
    ldi::triangulation t;
    ldi::buffer<std::int32_t> stack;
    constexpr std::int32_t side = 1 << 16;
    ldi::polygon p;
    p.points = {{0, 0}, {side, 0}, {side, side}, {0, side}};
    p.next = {1, 2, 3, 0};
    p.outline_count = 4;
    for (int i = 0; i < 500; ++i) {
        p.points.push_back(
            {1 + static_cast<std::int32_t>(random() % (side - 1)), 1 + static_cast<std::int32_t>(random() % (side - 1))});
        p.next.push_back(-1);
    }
    REQUIRE_FALSE(triangulate(p, t));
    ldi::flip_to_delaunay(p.points, t, stack);
    ldi::testing::require_triangulation(p, t);
}

TEST_CASE("flipping returns the same triangles if all coordinates are four times as large, up to 2^16") {
    ldi::triangulator triangulate;
    ldi::buffer<std::int32_t> stack;
    const auto triangles_of_square = [&](std::int32_t scale, std::uint32_t seed) {
        std::mt19937 random(seed);
        constexpr std::int32_t side = 1 << 14;
        ldi::polygon p;
        p.points = {{0, 0}, {scale * side, 0}, {scale * side, scale * side}, {0, scale * side}};
        p.next = {1, 2, 3, 0};
        p.outline_count = 4;
        for (int i = 0; i < 8; ++i) {
            const std::int32_t x = 1 + static_cast<std::int32_t>(random() % (side - 1)),
                               y = 1 + static_cast<std::int32_t>(random() % (side - 1));
            p.points.push_back({scale * x, scale * y});
            p.next.push_back(-1);
        }
        ldi::triangulation t;
        REQUIRE_FALSE(triangulate(p, t));
        ldi::flip_to_delaunay(p.points, t, stack);
        ldi::testing::require_triangulation(p, t);
        return t.triangles;
    };
    for (std::uint32_t seed = 0; seed < 100; ++seed) CHECK(triangles_of_square(4, seed) == triangles_of_square(1, seed));
}

TEST_CASE("triangulations with out-of-range indices or inconsistent mates of half-edges are refused") {
    const ldi::buffer<ldi::lattice_point> square{{0, 0}, {9, 0}, {9, 9}, {0, 9}};
    const auto result_of = [&](auto change) {
        ldi::triangulation t{{0, 1, 2, 0, 2, 3}, {-1, -1, 3, 2, -1, -1}};
        change(t);
        ldi::buffer<std::int32_t> stack;
        return ldi::testing::raised([&] { ldi::flip_to_delaunay(square, t, stack); });
    };
    CHECK_FALSE(result_of([](auto&) {}));
    CHECK(result_of([](auto& t) { t.triangles[4] = 4; }) == ldi::error_code::mismatch);
    CHECK(result_of([](auto& t) { t.triangles.pop_back(); }) == ldi::error_code::mismatch);
    CHECK(result_of([](auto& t) { t.triangles.pop_back(), t.mates.pop_back(); }) == ldi::error_code::mismatch);
    for (const std::int32_t wrong : {-2, 0, 4, 6})
        CHECK(result_of([&](auto& t) { t.mates[2] = wrong; }) == ldi::error_code::mismatch);
}
