#include <ldi/mesh/outlines.hpp>

#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

namespace {

using ldi::testing::charted_graph;
using ldi::testing::random_charts;

struct corner_classes {
    ldi::buffer<std::size_t> parent;
    std::size_t find(std::size_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    }
    void unite(std::size_t a, std::size_t b) { parent[find(a)] = find(b); }
};

// Corner k of pixel i is 4 i + k: top left, top right, bottom right, bottom left.
corner_classes classes_by_definition(const ldi::graph_view& g) {
    corner_classes c;
    c.parent.resize(4 * g.size());
    std::iota(c.parent.begin(), c.parent.end(), std::size_t{0});
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (g.right()[i] != ldi::no_pixel) {
            const std::size_t r = static_cast<std::size_t>(g.right()[i]);
            c.unite(4 * i + 1, 4 * r), c.unite(4 * i + 2, 4 * r + 3);
        }
        if (g.down()[i] != ldi::no_pixel) {
            const std::size_t d = static_cast<std::size_t>(g.down()[i]);
            c.unite(4 * i + 3, 4 * d), c.unite(4 * i + 2, 4 * d + 1);
        }
    }
    return c;
}

ldi::buffer<std::int32_t> corners_along(const ldi::chart_outlines& outlines, std::size_t loop) {
    ldi::buffer<std::int32_t> result;
    for (std::int32_t s = outlines.first_step[loop]; s < outlines.first_step[loop + 1]; ++s) {
        const ldi::outline_step step = outlines.steps[static_cast<std::size_t>(s)];
        const ldi::boundary_piece& p = outlines.pieces[static_cast<std::size_t>(step.piece)];
        ldi::buffer<std::int32_t> ids{p.start};
        for (std::int32_t i = 0; i < p.inner_count; ++i) ids.push_back(p.first_inner + i);
        ids.push_back(p.end);
        if (step.reversed) std::reverse(ids.begin(), ids.end());
        result.insert(result.end(), ids.begin(), ids.end() - 1);
    }
    return result;
}

bool is_boundary(const charted_graph& c, std::size_t i, ldi::side s) {
    const std::int32_t n = c.topology.neighbors(s)[i];
    return n == ldi::no_pixel || c.charts.chart_of[static_cast<std::size_t>(n)] != c.charts.chart_of[i];
}

}  // namespace

TEST_CASE("the outlines of a chart are closed and contain every boundary side of its pixels exactly once") {
    for (std::uint32_t seed = 0; seed < 4000; ++seed) {
        const charted_graph c = random_charts(seed, 9);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart) {
            std::multiset<std::array<std::int32_t, 4>> expected, found;
            for (std::int32_t pixel : c.charts.charts[chart].pixels) {
                const std::size_t i = static_cast<std::size_t>(pixel);
                const std::int32_t x = c.topology.x()[i], y = c.topology.y()[i];
                if (is_boundary(c, i, ldi::side::up)) expected.insert({x, y, x + 1, y});
                if (is_boundary(c, i, ldi::side::right)) expected.insert({x + 1, y, x + 1, y + 1});
                if (is_boundary(c, i, ldi::side::down)) expected.insert({x + 1, y + 1, x, y + 1});
                if (is_boundary(c, i, ldi::side::left)) expected.insert({x, y + 1, x, y});
            }
            std::int64_t area = 0, positive = 0;
            for (std::int32_t l = outlines.first_loop[chart]; l < outlines.first_loop[chart + 1]; ++l) {
                const ldi::buffer<std::int32_t> loop = corners_along(outlines, static_cast<std::size_t>(l));
                for (std::size_t i = 0; i < loop.size(); ++i) {
                    const ldi::outline_corner& a = outlines.corners[static_cast<std::size_t>(loop[i])];
                    const ldi::outline_corner& b = outlines.corners[static_cast<std::size_t>(loop[(i + 1) % loop.size()])];
                    found.insert({a.x, a.y, b.x, b.y});
                }
                area += outlines.loop_area[static_cast<std::size_t>(l)];
                positive += outlines.loop_area[static_cast<std::size_t>(l)] > 0 ? 1 : 0;
            }
            REQUIRE(found == expected);
            REQUIRE(area == static_cast<std::int64_t>(c.charts.charts[chart].pixels.size()));
            REQUIRE(positive == 1);  // these charts are connected
        }
    }
}

TEST_CASE("pixels that share a corner share one vertex, with their average disparity") {
    for (std::uint32_t seed = 0; seed < 4000; ++seed) {
        const charted_graph c = random_charts(seed, 9);
        const ldi::graph& g = c.topology;
        const ldi::chart_outlines outlines = ldi::trace_outlines(g, c.disparity, c.charts);
        corner_classes classes = classes_by_definition(g);
        std::map<std::size_t, std::pair<double, double>> sums;
        std::set<std::size_t> on_boundary;
        for (std::size_t i = 0; i < g.size(); ++i)
            for (std::size_t k = 0; k < 4; ++k) {
                const std::size_t root = classes.find(4 * i + k);
                sums[root].first += static_cast<double>(c.disparity[i]), sums[root].second += 1;
                const std::array<ldi::side, 4> clockwise{ldi::side::up, ldi::side::right, ldi::side::down, ldi::side::left};
                if (is_boundary(c, i, clockwise[k]) || is_boundary(c, i, clockwise[(k + 3) % 4])) on_boundary.insert(root);
            }
        REQUIRE(outlines.corners.size() == on_boundary.size());
        std::vector<std::tuple<std::int32_t, std::int32_t, double>> expected, found;
        for (std::size_t root : on_boundary) {
            const std::size_t i = root / 4, k = root % 4;
            expected.emplace_back(g.x()[i] + (k == 1 || k == 2 ? 1 : 0), g.y()[i] + (k >= 2 ? 1 : 0),
                                  sums[root].first / sums[root].second);
        }
        for (const ldi::outline_corner& corner : outlines.corners)
            found.emplace_back(corner.x, corner.y, static_cast<double>(corner.disparity));
        std::sort(expected.begin(), expected.end()), std::sort(found.begin(), found.end());
        for (std::size_t i = 0; i < found.size(); ++i) {
            REQUIRE(std::get<0>(found[i]) == std::get<0>(expected[i]));
            REQUIRE(std::get<1>(found[i]) == std::get<1>(expected[i]));
            REQUIRE(std::abs(std::get<2>(found[i]) - std::get<2>(expected[i])) < 1e-5);
        }
    }
}

TEST_CASE("two charts that share a piece of outline each traverse it once, in opposite directions") {
    for (std::uint32_t seed = 0; seed < 500; ++seed) {
        const charted_graph c = random_charts(seed, 9);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        ldi::buffer<std::int32_t> forward(outlines.pieces.size(), -1), backward(outlines.pieces.size(), -1);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart)
            for (std::int32_t l = outlines.first_loop[chart]; l < outlines.first_loop[chart + 1]; ++l)
                for (std::int32_t s = outlines.first_step[static_cast<std::size_t>(l)];
                     s < outlines.first_step[static_cast<std::size_t>(l) + 1]; ++s) {
                    const ldi::outline_step step = outlines.steps[static_cast<std::size_t>(s)];
                    std::int32_t& by = (step.reversed ? backward : forward)[static_cast<std::size_t>(step.piece)];
                    REQUIRE(by == -1);
                    by = static_cast<std::int32_t>(chart);
                }
        for (std::size_t p = 0; p < outlines.pieces.size(); ++p) {
            REQUIRE(forward[p] == outlines.pieces[p].right_chart);
            REQUIRE(backward[p] == outlines.pieces[p].left_chart);
        }
    }
}

TEST_CASE("the outline of a photo with one chart has one straight piece per side of the photo") {
    const ldi::graph g = ldi::make_grid(7, 5);
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, 7, 5, {}});
    for (std::int32_t i = 0; i < g.count(); ++i) charts.charts.front().pixels.push_back(i);
    const ldi::buffer<float> disparity(g.size(), 0.25F);
    const ldi::chart_outlines outlines = ldi::trace_outlines(g, disparity, charts);
    REQUIRE(outlines.pieces.size() == 4);
    REQUIRE(outlines.corners.size() == 2 * (7 + 5));
    for (const ldi::boundary_piece& p : outlines.pieces) {
        const ldi::outline_corner &a = outlines.corners[static_cast<std::size_t>(p.start)],
                                  &b = outlines.corners[static_cast<std::size_t>(p.end)];
        REQUIRE((a.x == 0 || a.x == 7));
        REQUIRE((a.y == 0 || a.y == 5));
        REQUIRE((a.x == b.x) != (a.y == b.y));
        REQUIRE(a.disparity == 0.25F);
    }
}

#if LDI_HAS_EXCEPTIONS
TEST_CASE("disparities and charts of another image are refused") {
    const ldi::graph g = ldi::make_grid(3, 2);
    ldi::chart_set charts;
    charts.chart_of.assign(6, 0);
    charts.charts.push_back({0, 0, 3, 2, {}});
    charts.charts.front().pixels.add_run(0, 6);
    REQUIRE_NOTHROW(ldi::trace_outlines(g, ldi::buffer<float>(6), charts));
    REQUIRE_THROWS_AS(ldi::trace_outlines(g, ldi::buffer<float>(5), charts), ldi::error);
    charts.chart_of[2] = 7;
    REQUIRE_THROWS_AS(ldi::trace_outlines(g, ldi::buffer<float>(6), charts), ldi::error);
}

TEST_CASE("pixels that are not in canonical order are refused") {
    ldi::testing::sketched_graph g(2, 1);
    g.add_pixel(1, 0), g.add_pixel(0, 0);
    g.link(1, ldi::side::right, 0);
    ldi::chart_set charts;
    charts.chart_of = {0, 0};
    charts.charts.push_back({0, 0, 2, 1, {}});
    charts.charts.front().pixels.add_run(0, 2);
    REQUIRE_THROWS_AS(ldi::trace_outlines(g, ldi::buffer<float>{0, 0}, charts), ldi::error);
}
#endif
