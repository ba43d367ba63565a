#include <ldi/mesh/flat_mesh.hpp>

#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>
#include <tests/support/surfaces.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace {

using ldi::testing::charted_graph;

ldi::flat_mesh mesh_of(const charted_graph& c, const ldi::mesh_options& options) {
    ldi::serial_executor threads;
    return ldi::build_flat_mesh(ldi::testing::surfaces_of(c.topology, c.disparity), {}, c.charts, options, threads);
}

ldi::mesh_options with_tolerance(float tolerance) {
    ldi::mesh_options options;
    options.outlines.tolerance = tolerance;
    options.outlines.disparity_tolerance = 0.02F;
    options.studs.spacing = 5;
    options.studs.disparity_tolerance = 0.002F;
    options.studs.clearance = static_cast<std::int32_t>(tolerance) + 1;
    return options;
}

ldi::outline_corner vertex(const ldi::flat_mesh& m, const ldi::chart_mesh& c, std::uint32_t index) {
    if (index < c.outline.size()) return m.outlines.corners[static_cast<std::size_t>(c.outline[index])];
    return m.studs.vertices[static_cast<std::size_t>(c.first_stud_vertex) + index - c.outline.size()];
}

using triangle = std::array<std::array<std::int64_t, 2>, 3>;

std::vector<triangle> triangles_of(const ldi::flat_mesh& m, const ldi::chart_mesh& c, std::int64_t scale) {
    std::vector<triangle> result;
    for (std::size_t f = 0; f < c.triangles.size(); f += 3) {
        triangle t;
        for (std::size_t k = 0; k < 3; ++k) {
            const ldi::outline_corner v = vertex(m, c, c.triangles[f + k]);
            t[k] = {v.x * scale, v.y * scale};
        }
        result.push_back(t);
    }
    return result;
}

std::int64_t twice_area(const std::array<std::int64_t, 2>& a, const std::array<std::int64_t, 2>& b,
                        const std::array<std::int64_t, 2>& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Counts the triangles that contain the center of a pixel. Moves the center slightly, so that it lies on no edge between
// lattice points less than 40 apart.
constexpr std::int64_t fine = 1 << 20;
std::size_t cover_of_center(const std::vector<triangle>& triangles, std::int32_t x, std::int32_t y) {
    const std::array<std::int64_t, 2> center{x * fine + fine / 2 + 37, y * fine + fine / 2 + 1013};
    std::size_t count = 0;
    for (const triangle& t : triangles)
        count += twice_area(t[0], t[1], center) < 0 && twice_area(t[1], t[2], center) < 0 && twice_area(t[2], t[0], center) < 0;
    return count;
}

double distance_to_outline(const ldi::flat_mesh& m, std::size_t chart, double x, double y) {
    double nearest = 1e9;
    for (std::int32_t l = m.outlines.first_loop[chart]; l < m.outlines.first_loop[chart + 1]; ++l)
        for (std::int32_t s = m.outlines.first_step[static_cast<std::size_t>(l)];
             s < m.outlines.first_step[static_cast<std::size_t>(l) + 1]; ++s) {
            const ldi::boundary_piece& p =
                m.outlines.pieces[static_cast<std::size_t>(m.outlines.steps[static_cast<std::size_t>(s)].piece)];
            ldi::buffer<std::int32_t> ids{p.start};
            for (std::int32_t i = 0; i < p.inner_count; ++i) ids.push_back(p.first_inner + i);
            ids.push_back(p.end);
            for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
                const ldi::outline_corner& a = m.outlines.corners[static_cast<std::size_t>(ids[i])];
                const ldi::outline_corner& b = m.outlines.corners[static_cast<std::size_t>(ids[i + 1])];
                const double along =
                    std::clamp((x - a.x) * (b.x - a.x) + (y - a.y) * (b.y - a.y), 0.0, 1.0);  // the edge from a to b has length 1
                nearest = std::min(nearest, std::hypot(x - a.x - along * (b.x - a.x), y - a.y - along * (b.y - a.y)));
            }
        }
    return nearest;
}

}  // namespace

TEST_CASE("all triangles are counter-clockwise, and the triangles of a chart together have the area of its outline") {
    for (std::uint32_t seed = 0; seed < 2000; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, seed % 20 == 0 ? 40 : 12);
        const ldi::flat_mesh m = mesh_of(c, with_tolerance(static_cast<float>(seed % 5) * 0.6F));
        for (const ldi::chart_mesh& chart : m.charts) {
            std::int64_t area = 0, outline_area = 0;
            for (const triangle& t : triangles_of(m, chart, 1)) {
                const std::int64_t a = twice_area(t[0], t[1], t[2]);
                REQUIRE(a < 0);  // counter-clockwise on screen
                area -= a;
            }
            std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
            for (std::size_t h = 0; h < chart.triangles.size(); ++h)
                ++edges[{chart.triangles[h], chart.triangles[h % 3 == 2 ? h - 2 : h + 1]}];
            for (const auto& [edge, count] : edges) {
                REQUIRE(count == 1);
                if (edges.count({edge.second, edge.first}) != 0) continue;
                const ldi::outline_corner a = vertex(m, chart, edge.second), b = vertex(m, chart, edge.first);
                outline_area += std::int64_t{a.x} * b.y - std::int64_t{b.x} * a.y;
            }
            REQUIRE(area == outline_area);
            REQUIRE(area > 0);
        }
    }
}

TEST_CASE("without an outline tolerance, a chart covers exactly the centers of its own pixels, each of them once") {
    for (std::uint32_t seed = 0; seed < 1000; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 12);
        const ldi::flat_mesh m = mesh_of(c, with_tolerance(0.0F));
        for (std::size_t k = 0; k < m.charts.size(); ++k) {
            const ldi::chart& box = c.charts.charts[k];
            std::set<std::pair<std::int32_t, std::int32_t>> pixels;
            for (std::int32_t pixel : box.pixels)
                pixels.emplace(c.topology.x()[static_cast<std::size_t>(pixel)], c.topology.y()[static_cast<std::size_t>(pixel)]);
            const std::vector<triangle> triangles = triangles_of(m, m.charts[k], fine);
            for (std::int32_t y = box.y - 1; y <= box.y + box.height; ++y)
                for (std::int32_t x = box.x - 1; x <= box.x + box.width; ++x)
                    REQUIRE(cover_of_center(triangles, x, y) == pixels.count({x, y}));
        }
    }
}

TEST_CASE(
    "with an outline tolerance, no center is covered twice, and coverage changes only within the tolerance of the outline") {
    std::size_t far_from_outline = 0;
    for (std::uint32_t seed = 0; seed < 200; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 24);
        const float tolerance = 0.5F + 0.5F * static_cast<float>(seed % 3);
        const ldi::flat_mesh m = mesh_of(c, with_tolerance(tolerance));
        for (std::size_t k = 0; k < m.charts.size(); ++k) {
            const ldi::chart& box = c.charts.charts[k];
            std::set<std::pair<std::int32_t, std::int32_t>> pixels;
            for (std::int32_t pixel : box.pixels)
                pixels.emplace(c.topology.x()[static_cast<std::size_t>(pixel)], c.topology.y()[static_cast<std::size_t>(pixel)]);
            const std::vector<triangle> triangles = triangles_of(m, m.charts[k], fine);
            for (std::int32_t y = box.y - 1; y <= box.y + box.height; ++y)
                for (std::int32_t x = box.x - 1; x <= box.x + box.width; ++x) {
                    const std::size_t cover = cover_of_center(triangles, x, y);
                    REQUIRE(cover <= 1);
                    if (distance_to_outline(m, k, x + 0.5, y + 0.5) <= static_cast<double>(tolerance) + 0.01) continue;
                    ++far_from_outline;
                    REQUIRE(cover == pixels.count({x, y}));
                }
        }
    }
    REQUIRE(far_from_outline > 1000);
}

TEST_CASE("neighboring charts have the same edges along their common boundary, so that there are no T-junctions and no cracks") {
    std::size_t shared = 0;
    for (std::uint32_t seed = 0; seed < 1000; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, seed % 20 == 0 ? 40 : 12);
        const ldi::flat_mesh m = mesh_of(c, with_tolerance(static_cast<float>(seed % 5) * 0.6F));
        // Edges of each chart's triangles, as pairs of corners.
        std::vector<std::set<std::pair<std::int32_t, std::int32_t>>> edges(m.charts.size());
        for (std::size_t k = 0; k < m.charts.size(); ++k) {
            const ldi::chart_mesh& chart = m.charts[k];
            for (std::size_t h = 0; h < chart.triangles.size(); ++h) {
                const std::uint32_t a = chart.triangles[h], b = chart.triangles[h % 3 == 2 ? h - 2 : h + 1];
                if (a < chart.outline.size() && b < chart.outline.size()) edges[k].emplace(chart.outline[a], chart.outline[b]);
            }
        }
        for (std::size_t p = 0; p < m.outlines.pieces.size(); ++p) {
            const ldi::boundary_piece& piece = m.outlines.pieces[p];
            if (piece.left_chart == ldi::no_chart) continue;
            const std::size_t right = static_cast<std::size_t>(piece.right_chart),
                              left = static_cast<std::size_t>(piece.left_chart);
            const auto used_by = [&](std::size_t chart) {
                const std::set<std::int32_t> used(m.charts[chart].outline.begin(), m.charts[chart].outline.end());
                ldi::buffer<std::int32_t> ids{piece.start};
                for (std::int32_t i = piece.first_inner; i < piece.first_inner + piece.inner_count; ++i)
                    if (used.count(i) != 0) ids.push_back(i);
                ids.push_back(piece.end);
                return ids;
            };
            const ldi::buffer<std::int32_t> ids = used_by(right);
            REQUIRE(ids == used_by(left));
            for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
                // Triangles are counter-clockwise, outlines clockwise.
                REQUIRE(edges[right].count({ids[i + 1], ids[i]}) == 1);
                REQUIRE(edges[left].count({ids[i], ids[i + 1]}) == 1);
                ++shared;
            }
        }
    }
    REQUIRE(shared > 10000);
}

TEST_CASE("all charts of a photo together have its area, even if outlines are simplified") {
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        charted_graph c;
        c.topology = ldi::make_grid(1 + static_cast<std::int32_t>(random() % 30), 1 + static_cast<std::int32_t>(random() % 30));
        c.charts = ldi::testing::random_partition(c.topology, random);
        c.disparity = ldi::testing::random_disparity(c.topology, random);
        const ldi::flat_mesh m = mesh_of(c, with_tolerance(2.0F));
        std::int64_t area = 0;
        for (const ldi::chart_mesh& chart : m.charts)
            for (const triangle& t : triangles_of(m, chart, 1)) area -= twice_area(t[0], t[1], t[2]);
        REQUIRE(area == 2 * std::int64_t{c.topology.width()} * c.topology.height());
    }
}

TEST_CASE("the mesh does not depend on the number of threads") {
    ldi::thread_pool threads(3);
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 40);
        const ldi::mesh_options options = with_tolerance(1.0F);
        const ldi::flat_mesh a = mesh_of(c, options);
        const ldi::flat_mesh b =
            ldi::build_flat_mesh(ldi::testing::surfaces_of(c.topology, c.disparity), {}, c.charts, options, threads);
        REQUIRE(a.charts.size() == b.charts.size());
        for (std::size_t i = 0; i < a.charts.size(); ++i) {
            REQUIRE(a.charts[i].outline == b.charts[i].outline);
            REQUIRE(a.charts[i].triangles == b.charts[i].triangles);
        }
    }
}

#if LDI_HAS_EXCEPTIONS
TEST_CASE("a chart with two pixels at the same position is refused") {
    ldi::testing::sketched_graph g(3, 1);
    for (std::int32_t layer = 0; layer < 2; ++layer) {
        const std::int32_t first = g.add_pixel(0, 0);
        g.link(first, ldi::side::right, g.add_pixel(1, 0));
    }
    ldi::chart_set charts;
    charts.chart_of.assign(4, 0);
    charts.charts.push_back({0, 0, 2, 1, {}});
    charts.charts.front().pixels.add_run(0, 4);
    const ldi::buffer<float> disparity(4, 0.5F);
    ldi::serial_executor threads;
    REQUIRE_THROWS_AS(ldi::build_flat_mesh(ldi::testing::surfaces_of(g, disparity), {}, charts, {}, threads), ldi::error);
}

TEST_CASE("charts of another image, disparities that are not finite, and distances out of order are refused") {
    const ldi::graph g = ldi::make_grid(60, 60);
    ldi::buffer<float> disparity(g.size(), 0.5F);
    const ldi::chart_set charts = ldi::make_charts(ldi::testing::surfaces_of(g, disparity), {});
    const ldi::graph small = ldi::make_grid(8, 8);
    const ldi::chart_set other = ldi::make_charts(ldi::testing::surfaces_of(small, ldi::buffer<float>(64)), {});
    const auto build = [&](const ldi::chart_set& c, const ldi::depth_range& range) {
        return ldi::build_flat_mesh(ldi::testing::surfaces_of(g, disparity), range, c);
    };
    REQUIRE_NOTHROW(build(charts, {}));
    REQUIRE_THROWS_AS(build(other, {}), ldi::error);
    REQUIRE_THROWS_AS(build(charts, {0.0F, 1.0F}), ldi::error);
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        disparity[100] = value;
        REQUIRE_THROWS_AS(build(charts, {}), ldi::error);
    }
}

TEST_CASE("an outline tolerance that reaches the studs is refused") {
    const ldi::graph g = ldi::make_grid(4, 4);
    ldi::mesh_options options;
    options.outlines.tolerance = 4.0F;
    ldi::serial_executor threads;
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, 4, 4, {}});
    REQUIRE_THROWS_AS(ldi::build_flat_mesh(ldi::testing::surfaces_of(g, ldi::buffer<float>(16)), {}, charts, options, threads),
                      ldi::error);
}
#endif

TEST_CASE("for a graph that is not in canonical order, meshing reads no memory outside its columns") {
    constexpr std::int32_t width = 40, height = 40, single_row = 23;  // the pixels of this row have only vertical links
    const auto id = [](std::int32_t x, std::int32_t y) {
        const std::int32_t canonical = y * width + x, first = single_row * width + 20;
        return canonical == first ? 0 : canonical < first ? canonical + 1 : canonical;
    };
    ldi::graph_builder b(width, height, std::size_t{width * height});
    ldi::buffer<float> disparity(std::size_t{width * height});
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            b.set_position(id(x, y), x, y);
            disparity[id(x, y)] = 0.3F + 0.002F * static_cast<float>(std::abs(x - 20));
        }
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            if (x + 1 < width && y != single_row) b.link(id(x, y), ldi::side::right, id(x + 1, y));
            if (y + 1 < height) b.link(id(x, y), ldi::side::down, id(x, y + 1));
        }
    const ldi::graph g = std::move(b).build();
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, width, height, {}});
    for (std::int32_t i = 0; i < g.count(); ++i) charts.charts[0].pixels.push_back(i);
    ldi::mesh_options options;
    options.studs.spacing = 8, options.studs.clearance = 2;
    CHECK_NOTHROW(ldi::build_flat_mesh(ldi::testing::surfaces_of(g, disparity), {}, charts, options));
}
