#include <ldi/occlusion/discontinuity_curves.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace {

ldi::buffer<ldi::discontinuity_curve> curves_of(const ldi::photo_layer& layers, std::size_t min_length = 1) {
    ldi::curve_options options;
    options.min_length = min_length;
    options.max_density = 2.0F;  // keeps all sides
    return ldi::find_discontinuity_curves(layers, {}, options);
}

// Ends of the lattice edge between two pixels, as (x, y) of corners.
std::pair<std::pair<int, int>, std::pair<int, int>> corners_of(const ldi::graph_view& g, const ldi::discontinuity& d) {
    const int x = g.x()[static_cast<std::size_t>(d.back)], y = g.y()[static_cast<std::size_t>(d.back)];
    switch (d.toward_front) {
        case ldi::side::up: return {{x, y}, {x + 1, y}};
        case ldi::side::down: return {{x, y + 1}, {x + 1, y + 1}};
        case ldi::side::left: return {{x, y}, {x, y + 1}};
        case ldi::side::right: break;
    }
    return {{x + 1, y}, {x + 1, y + 1}};
}

}  // namespace

TEST_CASE("every missing link inside the photo lies on exactly one curve, with its nearer pixel in front") {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        const ldi::photo_layer layers =
            ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 1 + random() % 30, 1 + random() % 30));
        const ldi::graph& g = layers.topology();
        const auto disparity = layers.column<ldi::disparity_column>();
        std::set<std::pair<std::int32_t, std::int32_t>> found;
        for (const ldi::discontinuity_curve& c : curves_of(layers))
            for (const ldi::discontinuity& d : c.sides) {
                REQUIRE(disparity[static_cast<std::size_t>(d.front)] > disparity[static_cast<std::size_t>(d.back)] + 0.05F);
                REQUIRE(g.x()[static_cast<std::size_t>(d.front)] ==
                        g.x()[static_cast<std::size_t>(d.back)] + ldi::step_x(d.toward_front));
                REQUIRE(g.y()[static_cast<std::size_t>(d.front)] ==
                        g.y()[static_cast<std::size_t>(d.back)] + ldi::step_y(d.toward_front));
                REQUIRE(found.emplace(std::min(d.back, d.front), std::max(d.back, d.front)).second);
            }
        std::size_t missing = 0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i) {
            if (g.x()[static_cast<std::size_t>(i)] + 1 < g.width())
                missing += g.neighbor(i, ldi::side::right) == ldi::no_pixel ? 1U : 0U;
            if (g.y()[static_cast<std::size_t>(i)] + 1 < g.height())
                missing += g.neighbor(i, ldi::side::down) == ldi::no_pixel ? 1U : 0U;
        }
        REQUIRE(found.size() == missing);
    }
}

TEST_CASE("the sides of a curve form a chain, and no curve runs through a junction") {
    std::mt19937 random(2);
    for (int round = 0; round < 300; ++round) {
        const ldi::photo_layer layers =
            ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 2 + random() % 30, 2 + random() % 30));
        const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(layers);
        std::map<std::pair<int, int>, int> degree;
        for (const ldi::discontinuity_curve& c : curves)
            for (const ldi::discontinuity& d : c.sides) {
                const auto [a, b] = corners_of(layers.topology(), d);
                ++degree[a], ++degree[b];
            }
        for (const ldi::discontinuity_curve& c : curves) {
            std::map<std::pair<int, int>, int> inner;
            for (std::size_t i = 0; i + 1 < c.sides.size(); ++i) {
                const auto [a, b] = corners_of(layers.topology(), c.sides[i]);
                const auto [e, f] = corners_of(layers.topology(), c.sides[i + 1]);
                const auto shared = a == e || a == f ? a : b;
                REQUIRE((shared == e || shared == f));
                const bool pass_each_other = degree[shared] == 4;  // two curves meet and keep separate background pixels
                const ldi::discontinuity &d = c.sides[i], &next = c.sides[i + 1];
                REQUIRE((degree[shared] == 2 || (pass_each_other && d.back == next.back)));
            }
        }
    }
}

TEST_CASE("at a T-junction, only the curve between midground and foreground is constrained") {
    ldi::image<float> map(60, 80);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 80; ++x) map(y, x, 0) = x >= 40 ? 0.9F : y >= 30 ? 0.5F : 0.1F;
    const ldi::photo_layer layers = ldi::testing::lift_disparity(map);
    const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(layers, 20);
    REQUIRE(curves.size() == 3);
    const auto disparity = layers.column<ldi::disparity_column>();
    for (const ldi::discontinuity_curve& c : curves) {
        const bool is_mid_to_fore = disparity[static_cast<std::size_t>(c.sides[0].back)] == 0.5F;
        REQUIRE(c.constraints.size() == (is_mid_to_fore ? 1U : 0U));
        if (!is_mid_to_fore) continue;
        CHECK(c.constraints[0].x == 40.0F);
        CHECK(c.constraints[0].y == 30.0F);
        CHECK(c.constraints[0].outward_y == Approx(-1.0F));
        CHECK(c.constraints[0].perpendicular_x == Approx(1.0F));
    }
    // Without the rule for junctions, all three curves would be constrained there. Without constraints, none would be.
    std::size_t all = 0, none = 0;
    for (const auto& c : ldi::find_discontinuity_curves(layers, {}, {.constraints = ldi::constrained_ends::all}))
        all += c.constraints.size();
    for (const auto& c : ldi::find_discontinuity_curves(layers, {}, {.constraints = ldi::constrained_ends::none}))
        none += c.constraints.size();
    CHECK(all == 3);
    CHECK(none == 0);
}

TEST_CASE("a curve is not constrained at an end where its discontinuity fades out or leaves the photo") {
    ldi::image<float> map(60, 80);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 80; ++x) {
            const float step = 0.4F - 0.01F * static_cast<float>(y);  // between left and right, vanishing at the bottom
            map(y, x, 0) = x < 40 ? 0.5F : 0.5F + std::max(step, 0.0F);
        }
    const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(ldi::testing::lift_disparity(map), 20);
    REQUIRE(curves.size() == 1);
    CHECK(curves[0].constraints.empty());
}

TEST_CASE("curves shorter than the minimum are dropped, and closed curves are marked as closed") {
    ldi::image<float> map(40, 60, 1, 0.1F);
    for (std::size_t y = 10; y < 20; ++y)
        for (std::size_t x = 10; x < 20; ++x) map(y, x, 0) = 0.7F;  // a closed curve of 40 sides
    for (std::size_t y = 30; y < 34; ++y)
        for (std::size_t x = 40; x < 44; ++x) map(y, x, 0) = 0.7F;  // a closed curve of 16 sides
    const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(ldi::testing::lift_disparity(map), 20);
    REQUIRE(curves.size() == 1);
    CHECK(curves[0].sides.size() == 40);
    CHECK(curves[0].is_closed);
    CHECK(curves[0].constraints.empty());
}

TEST_CASE("a short branch is pruned, and the curve from which it branches continues through the junction") {
    ldi::image<float> map(40, 60, 1, 0.1F);
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 60; ++x)
            if (x >= 30) map(y, x, 0) = y < 20 ? 0.5F + 0.006F * static_cast<float>(std::max(40 - static_cast<int>(x), 0)) : 0.5F;
    const ldi::photo_layer layers = ldi::testing::lift_disparity(map);  // along y = 20 a step of 0.06 that ends after two pixels
    REQUIRE(curves_of(layers, 1).size() == 3);
    const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(layers, 20);
    REQUIRE(curves.size() == 1);
    CHECK(curves[0].sides.size() == 40);
}

TEST_CASE("two curves that meet at a corner pass each other, each around its own part of the background") {
    for (const bool mirrored : {false, true}) {
        ldi::image<float> map(40, 40, 1, 0.1F);
        for (std::size_t y = 0; y < 40; ++y)
            for (std::size_t x = 0; x < 40; ++x) map(y, mirrored ? 39 - x : x, 0) = (x < 20) == (y < 20) ? 0.8F : 0.1F;
        const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(ldi::testing::lift_disparity(map), 20);
        REQUIRE(curves.size() == 2);
        for (const ldi::discontinuity_curve& c : curves) {
            CHECK(c.sides.size() == 40);
            CHECK(c.constraints.empty());
            std::set<bool> halves;
            for (const ldi::discontinuity& d : c.sides) halves.insert(d.back / 40 < 20);
            CHECK(halves.size() == 1);  // each stays in its quarter of the background
        }
    }
}

TEST_CASE("a short curve between two junctions of long curves is kept") {
    ldi::image<float> map(60, 80, 1, 0.1F);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 80; ++x) map(y, x, 0) = x >= 40 ? 0.9F : y >= 36 ? 0.5F : y >= 30 ? 0.3F : 0.1F;
    const ldi::buffer<ldi::discontinuity_curve> curves = curves_of(ldi::testing::lift_disparity(map), 20);
    REQUIRE(curves.size() == 5);
    CHECK(std::count_if(curves.begin(), curves.end(), [](const ldi::discontinuity_curve& c) { return c.sides.size() == 6; }) ==
          1);
}

TEST_CASE("if curves have more sides than the maximum, only the longest curves that fit remain, and dropped sides are counted") {
    ldi::image<float> map(60, 100, 1, 0.1F);
    for (std::size_t size = 1; size <= 10; ++size)
        for (std::size_t i = 0; i < size * size; ++i)
            map((size % 2 == 0 ? 40 : 25) + i / size, 8 * size + i % size, 0) = 0.7F;  // 4 * size sides
    for (std::size_t x = 0; x < 100; ++x) map(10, x, 0) = 0.7F;                        // two curves of 100 sides
    const ldi::photo_layer layers = ldi::testing::lift_disparity(map);
    const auto lengths = [&](ldi::curve_options options) {
        std::vector<std::size_t> found;
        for (const ldi::discontinuity_curve& c : ldi::find_discontinuity_curves(layers, {}, options))
            found.push_back(c.sides.size());
        std::sort(found.begin(), found.end());
        return found;
    };
    using sizes = std::vector<std::size_t>;
    CHECK(lengths({}) == sizes{20, 24, 28, 32, 36, 40, 100, 100});
    CHECK(lengths({.max_sides = 420}) == sizes{20, 24, 28, 32, 36, 40, 100, 100});
    CHECK(lengths({.min_length = 4, .max_sides = 420}) == sizes{4, 8, 12, 16, 20, 24, 28, 32, 36, 40, 100, 100});
    CHECK(lengths({.min_length = 4, .max_sides = 419}) == sizes{8, 12, 16, 20, 24, 28, 32, 36, 40, 100, 100});
    CHECK(lengths({.max_sides = 300}) == sizes{36, 40, 100, 100});
    CHECK(lengths({.max_sides = 276}) == sizes{36, 40, 100, 100});
    CHECK(lengths({.max_sides = 275}) == sizes{40, 100, 100});
    CHECK(lengths({.max_density = 0.05F}) == sizes{36, 40, 100, 100});  // of 6000 pixels
    for (const float density : {-0.1F, 2.1F, std::numeric_limits<float>::quiet_NaN()})
        CHECK_THROWS_AS(lengths({.max_density = density}), ldi::error);
    CHECK(lengths({.max_sides = 199}).empty());  // curves of equal length are kept or dropped together
    const auto dropped = [&](ldi::curve_options options) {
        std::size_t sides = 1;  // find_discontinuity_curves() replaces it
        ldi::find_discontinuity_curves(layers, {}, options, &sides);
        return sides;
    };
    CHECK(dropped({}) == 0);
    CHECK(dropped({.max_sides = 420}) == 0);  // the map has 420 sides
    CHECK(dropped({.min_length = 4, .max_sides = 419}) == 4);
    CHECK(dropped({.max_sides = 300}) == 420 - 276);
    CHECK(dropped({.max_sides = 0}) == 420);
}

TEST_CASE("on noise, no curve is shorter than the minimum") {
    std::mt19937 random(5);
    const ldi::photo_layer layers = ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 120, 160));
    std::size_t sides = 0;
    for (const ldi::discontinuity_curve& c : ldi::find_discontinuity_curves(layers, {})) {
        CHECK(c.sides.size() >= ldi::curve_options().min_length);
        sides += c.sides.size();
    }
    CHECK(static_cast<double>(sides) <= 0.2 * 120 * 160);
}
