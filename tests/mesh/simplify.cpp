#include <ldi/mesh/simplify.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <cmath>

namespace {

using ldi::testing::charted_graph;

ldi::simplify_options options_with(float tolerance, float disparity_tolerance) {
    ldi::simplify_options options;
    options.tolerance = tolerance, options.disparity_tolerance = disparity_tolerance;
    options.texture_tolerance = 1e6F;
    return options;
}

// All corners of a piece of boundary, in order.
ldi::buffer<std::int32_t> all_corners(const ldi::boundary_piece& p) {
    ldi::buffer<std::int32_t> ids{p.start};
    for (std::int32_t i = 0; i < p.inner_count; ++i) ids.push_back(p.first_inner + i);
    ids.push_back(p.end);
    return ids;
}

double distance_to_segment(const ldi::outline_corner& p, const ldi::outline_corner& a, const ldi::outline_corner& b) {
    const double dx = b.x - a.x, dy = b.y - a.y, px = p.x - a.x, py = p.y - a.y, length = dx * dx + dy * dy;
    const double along = length > 0 ? std::clamp((px * dx + py * dy) / length, 0.0, 1.0) : 0.0;
    return std::hypot(px - along * dx, py - along * dy);
}

}  // namespace

TEST_CASE("a simplified piece keeps its ends and the order of its corners, and stays within the tolerance") {
    for (std::uint32_t seed = 0; seed < 2000; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 14);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        for (float tolerance : {0.0F, 0.8F, 2.0F}) {
            const ldi::simplified_boundary boundary(outlines, options_with(tolerance, 0.02F));
            for (std::size_t p = 0; p < outlines.pieces.size(); ++p) {
                const ldi::buffer<std::int32_t> all = all_corners(outlines.pieces[p]);
                const auto kept = boundary.corners(static_cast<std::int32_t>(p));
                REQUIRE(kept.size() >= 2);
                REQUIRE(kept.front() == all.front());
                REQUIRE(kept.back() == all.back());
                std::size_t i = 0;
                for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
                    const ldi::outline_corner& a = outlines.corners[static_cast<std::size_t>(kept[k])];
                    const ldi::outline_corner& b = outlines.corners[static_cast<std::size_t>(kept[k + 1])];
                    std::size_t next = i + 1;
                    while (next < all.size() && all[next] != kept[k + 1]) ++next;
                    REQUIRE(next < all.size());
                    for (; i < next; ++i) {
                        const ldi::outline_corner& corner = outlines.corners[static_cast<std::size_t>(all[i])];
                        REQUIRE(distance_to_segment(corner, a, b) <= static_cast<double>(tolerance) + 2e-3);
                    }
                }
            }
        }
    }
}

TEST_CASE("a straight border keeps a corner where disparity bends and drops all others") {
    const ldi::graph g = ldi::make_grid(40, 3);
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, 40, 3, {}});
    for (std::int32_t i = 0; i < g.count(); ++i) charts.charts.front().pixels.push_back(i);
    ldi::buffer<float> disparity(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) disparity[i] = 0.02F * static_cast<float>(std::min<std::int32_t>(g.x()[i], 20));
    const ldi::chart_outlines outlines = ldi::trace_outlines(g, disparity, charts);
    const ldi::simplified_boundary boundary(outlines, {1.0F, 0.011F, 100.0F});
    for (std::size_t p = 0; p < outlines.pieces.size(); ++p) {
        const ldi::boundary_piece& piece = outlines.pieces[p];
        const bool is_horizontal =
            outlines.corners[static_cast<std::size_t>(piece.start)].y == outlines.corners[static_cast<std::size_t>(piece.end)].y;
        REQUIRE(boundary.corners(static_cast<std::int32_t>(p)).size() == (is_horizontal ? 3U : 2U));
    }
}

TEST_CASE("repeatedly splitting every edge restores the detailed boundary") {
    for (std::uint32_t seed = 0; seed < 100; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 14);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        ldi::simplified_boundary boundary(outlines, options_with(100.0F, 10.0F));
        while (true) {
            std::vector<ldi::boundary_split> splits;
            for (std::size_t p = 0; p < outlines.pieces.size(); ++p) {
                const std::int32_t piece = static_cast<std::int32_t>(p);
                for (std::size_t i = 0; i + 1 < boundary.corners(piece).size(); ++i) {
                    const ldi::boundary_edge edge{piece, static_cast<std::int32_t>(i)};
                    const auto [first, last] = boundary.left_out(edge);
                    if (first == last) continue;
                    const std::int32_t corner = boundary.farthest_left_out(edge);
                    REQUIRE((first <= corner && corner < last));
                    splits.push_back({edge, corner});
                }
            }
            if (splits.empty()) break;
            const ldi::buffer<std::int32_t> before(boundary.corners(splits[0].edge.piece).begin(),
                                                   boundary.corners(splits[0].edge.piece).end());
            boundary.split(splits);
            REQUIRE(boundary.corners(splits[0].edge.piece).size() > before.size());
            REQUIRE(boundary.is_fresh(splits[0].edge));
        }
        for (std::size_t p = 0; p < outlines.pieces.size(); ++p) {
            const ldi::buffer<std::int32_t> all = all_corners(outlines.pieces[p]);
            const auto kept = boundary.corners(static_cast<std::int32_t>(p));
            REQUIRE(ldi::buffer<std::int32_t>(kept.begin(), kept.end()) == all);
        }
    }
}

#if LDI_HAS_EXCEPTIONS
TEST_CASE(
    "by default, edges along a slanted surface's border shift its texture by at most half a pixel and are not split needlessly") {
    const ldi::depth_range range{1.0F, 4.0F};
    for (const std::int32_t width : {37, 64, 150, 331, 512}) {
        const ldi::graph g = ldi::make_grid(width, 3);
        ldi::buffer<float> disparity;
        for (std::int32_t i = 0; i < g.count(); ++i)
            disparity.push_back(static_cast<float>(g.x()[i]) / static_cast<float>(width));
        ldi::chart_set charts;
        charts.chart_of.assign(g.size(), 0);
        ldi::chart& all = charts.charts.emplace_back();
        all.width = width, all.height = 3;
        for (std::int32_t i = 0; i < g.count(); ++i) all.pixels.push_back(i);
        const ldi::chart_outlines outlines = ldi::trace_outlines(g, disparity, charts);
        const ldi::simplified_boundary boundary(outlines, {}, range);
        for (std::int32_t p = 0; p < outlines.pieces.count(); ++p) {
            const auto kept = boundary.corners(p);
            const auto shift = [&](std::size_t from, std::size_t to) {
                const ldi::outline_corner &a = outlines.corners[kept[from]], &b = outlines.corners[kept[to]];
                const float length = std::hypot(static_cast<float>(b.x - a.x), static_cast<float>(b.y - a.y));
                return length <= 1.0F ? 0.0F : range.texture_shift(length, a.disparity, b.disparity);
            };
            CAPTURE(width, p, kept.size());
            for (std::size_t k = 0; k + 1 < kept.size(); ++k) CHECK(shift(k, k + 1) <= 0.5F);
            // No split is needless: joining two adjacent edges exceeds the tolerance for at least one such pair.
            float largest = 0;
            for (std::size_t k = 0; k + 2 < kept.size(); ++k) largest = std::max(largest, shift(k, k + 2));
            if (kept.size() > 4) CHECK(largest > 0.5F);
        }
    }
}

TEST_CASE("negative tolerances are refused") {
    const ldi::chart_outlines outlines;
    REQUIRE_THROWS_AS(ldi::simplified_boundary(outlines, options_with(-1.0F, 0.01F)), ldi::error);
    REQUIRE_THROWS_AS(ldi::simplified_boundary(outlines, options_with(1.0F, -0.01F)), ldi::error);
}

TEST_CASE("splits out of order, repeated, of missing edges, or at corners that an edge does not skip are refused") {
    const ldi::graph g = ldi::make_grid(40, 30);
    const ldi::buffer<float> disparity(g.size(), 0.5F);
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, 40, 30, {}});
    for (std::int32_t i = 0; i < g.count(); ++i) charts.charts.front().pixels.push_back(i);
    const ldi::chart_outlines outlines = ldi::trace_outlines(g, disparity, charts);
    ldi::simplified_boundary boundary(outlines, {});
    const auto pieces = outlines.pieces.count(), edges = static_cast<std::int32_t>(boundary.corners(0).size()) - 1;
    const auto [first, last] = boundary.left_out({0, 0});
    REQUIRE((pieces > 1 && last - first > 3));
    using splits = ldi::buffer<ldi::boundary_split>;
    for (const splits& wrong :
         {splits{{{1, 0}, boundary.farthest_left_out({1, 0})}, {{0, 0}, first}}, splits{{{0, 0}, first + 1}, {{0, 0}, first}},
          splits{{{0, 0}, first}, {{0, 0}, first}}, splits{{{0, edges}, first}}, splits{{{0, -1}, first}},
          splits{{{-1, 0}, first}}, splits{{{pieces, 0}, first}}, splits{{{0, 0}, first - 1}}, splits{{{0, 0}, last}}}) {
        CHECK(ldi::testing::raised([&] { boundary.split(wrong); }) == ldi::error_code::mismatch);
        CHECK(static_cast<std::int32_t>(boundary.corners(0).size()) == edges + 1);
    }
    boundary.split(splits{{{0, 0}, first}, {{0, 0}, first + 1}});
    CHECK(static_cast<std::int32_t>(boundary.corners(0).size()) == edges + 3);
}
#endif

TEST_CASE("outlines whose pieces have corners that do not exist are refused") {
    const auto result_of = [](const ldi::boundary_piece& piece) {
        ldi::chart_outlines outlines;
        outlines.corners.resize(4);
        outlines.pieces = {piece};
        return ldi::testing::raised([&] { ldi::simplified_boundary(outlines, {}).corners(0); });
    };
    const auto piece_of = [](std::int32_t start, std::int32_t end, std::int32_t first_inner, std::int32_t inner_count) {
        ldi::boundary_piece piece{};
        piece.start = start, piece.end = end, piece.first_inner = first_inner, piece.inner_count = inner_count;
        return piece;
    };
    CHECK_FALSE(result_of(piece_of(0, 3, 1, 2)));
    for (const ldi::boundary_piece& wrong : {piece_of(4, 3, 1, 2), piece_of(0, -1, 1, 2), piece_of(0, 3, 1, 4),
                                             piece_of(0, 3, -1, 2), piece_of(0, 3, 1, -1), piece_of(0, 3, 5, 0)})
        CHECK(result_of(wrong) == ldi::error_code::mismatch);
}
