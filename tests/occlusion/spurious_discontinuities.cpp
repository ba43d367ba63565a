#include <ldi/occlusion/spurious_discontinuities.hpp>

#include "tests/support/lifted_scene.hpp"

#include <ldi/core/validate.hpp>

#include <catch2/catch.hpp>

#include <random>
#include <set>

TEST_CASE("close_spurious_discontinuities() closes exactly the discontinuities that are not on a curve") {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        ldi::photo_layer layers =
            ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 1 + random() % 30, 1 + random() % 30));
        const ldi::graph& g = layers.topology();
        ldi::curve_options options;
        options.min_length = 1 + random() % 30;
        const auto curves = ldi::find_discontinuity_curves(layers, {}, options);
        std::set<std::pair<std::int32_t, std::int32_t>> on_curve;
        for (const ldi::discontinuity_curve& c : curves)
            for (const ldi::discontinuity& d : c.sides) on_curve.insert(std::minmax(d.back, d.front));
        ldi::close_spurious_discontinuities(layers, curves);
        REQUIRE_FALSE(ldi::validate(g));
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i) {
            if (g.x()[static_cast<std::size_t>(i)] + 1 < g.width())
                REQUIRE((g.neighbor(i, ldi::side::right) == ldi::no_pixel) == (on_curve.count({i, i + 1}) == 1));
            if (g.y()[static_cast<std::size_t>(i)] + 1 < g.height())
                REQUIRE((g.neighbor(i, ldi::side::down) == ldi::no_pixel) == (on_curve.count({i, i + g.width()}) == 1));
        }
    }
}
