#include <ldi/core/validate.hpp>
#include <ldi/occlusion/lift.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

TEST_CASE("lifting links neighbors exactly where disparity differs by at most the threshold") {
    std::mt19937 random(1);
    ldi::thread_pool threads(3);
    for (int round = 0; round < 200; ++round) {
        const std::size_t rows = 1 + random() % 20, columns = 1 + random() % 20;
        ldi::image<float> disparity(rows, columns);
        for (float& value : disparity) value = static_cast<float>(random() % 8) * 0.03F;
        ldi::image<std::uint8_t> color(rows, columns, 3);
        for (std::uint8_t& value : color) value = static_cast<std::uint8_t>(random());
        const ldi::photo_layer layers = ldi::lift(color, disparity, {}, threads);
        const ldi::graph& g = layers.topology();

        REQUIRE_FALSE(ldi::validate_canonical(g, layers.column<ldi::disparity_column>()));
        REQUIRE(g.size() == rows * columns);
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i) {
            const std::size_t k = static_cast<std::size_t>(i);
            REQUIRE(g.y()[k] * g.width() + g.x()[k] == i);
            REQUIRE(layers.at<ldi::color_column>(i)[1] == color(g.y()[k], g.x()[k], 1));
            REQUIRE(layers.column<ldi::known_column>()[k] == 1);
            for (ldi::side s : ldi::all_sides) {
                const std::int32_t u = g.x()[k] + ldi::step_x(s), v = g.y()[k] + ldi::step_y(s);
                const bool inside = u >= 0 && v >= 0 && u < g.width() && v < g.height();
                const bool close = inside && std::abs(disparity(v, u, 0) - disparity(g.y()[k], g.x()[k], 0)) <= 0.05F;
                REQUIRE((g.neighbor(i, s) != ldi::no_pixel) == close);
            }
        }
    }
}

TEST_CASE("an empty photo, a mismatched disparity map, a mismatched camera and a negative threshold are refused") {
    const auto photo = ldi::image<std::uint8_t>(4, 5, 3, std::uint8_t{0});
    CHECK_THROWS_AS(ldi::lift(photo, ldi::image<float>(5, 4, 1, 0.0F)), ldi::error);
    CHECK_THROWS_AS(ldi::lift(photo, ldi::image<float>(4, 5, 2, 0.0F)), ldi::error);
    CHECK_THROWS_AS(ldi::lift(ldi::image<std::uint8_t>(4, 0, 3), ldi::image<float>(4, 0)), ldi::error);
    const ldi::image<float> disparity(4, 5, 1, 0.0F);
    CHECK_NOTHROW(ldi::lift(photo, disparity, {.camera = {5, 4, 5.0F}}));
    for (const ldi::pinhole_camera& other : {ldi::pinhole_camera{4, 5, 5.0F}, {4000, 3000, 0.0F}, {5, 0, 0.0F}, {-5, -4, 1.0F}})
        CHECK_THROWS_AS(ldi::lift(photo, disparity, {.camera = other}), ldi::error);
    for (const float step : {-0.001F, -INFINITY, std::nanf("")})
        CHECK_THROWS_AS(ldi::lift(photo, disparity, {.surface = {step}}), ldi::error);
}

TEST_CASE("disparities that are not between 0 and 1, up to rounding, are refused") {
    const auto photo = ldi::image<std::uint8_t>(4, 5, 3, std::uint8_t{0});
    for (const float bad : {7.0F, 1.001F, -0.001F, std::nanf(""), INFINITY}) {
        ldi::image<float> disparity(4, 5, 1, 0.5F);
        disparity(3, 4) = bad;
        CHECK_THROWS_AS(ldi::lift(photo, disparity), ldi::error);
    }
    CHECK_NOTHROW(ldi::lift(photo, ldi::image<float>(4, 5, 1, std::nextafter(1.0F, 2.0F))));
    ldi::image<float> step(1, 2, 1, 0.5F);
    step(0, 1) = 1.000009F;
    ldi::photo_facts facts;
    facts.surface.max_step = 0.5F;
    const auto layer = ldi::lift(ldi::image<std::uint8_t>(1, 2, 3), step, facts);
    CHECK(layer.column<ldi::disparity_column>()[1] == 1.0F);
    CHECK(layer.topology().right()[0] == 1);  // neighbors are linked by the clamped disparities
}

TEST_CASE("a 16-bit photo is linked like the same 8-bit photo and keeps its full color values") {
    ldi::image<float> disparity(8, 9, 1, 0.2F);
    ldi::image<std::uint8_t> color(8, 9, 3);
    ldi::image<std::uint16_t> deep(8, 9, 3);
    for (std::size_t i = 0; i < color.size(); ++i)
        color.data()[i] = static_cast<std::uint8_t>(7 * i), deep.data()[i] = static_cast<std::uint16_t>(257 * (7 * i % 256) + 3);
    for (std::size_t y = 2; y < 6; ++y) disparity(y, 4) = 0.8F;
    const auto from_16 = ldi::lift(deep, disparity);
    const ldi::photo_layer from_8 = ldi::lift(color, disparity);
    CHECK(from_16.topology() == from_8.topology());
    CHECK(std::equal(deep.begin(), deep.end(), from_16.column<ldi::color16_column>().begin()));
}

TEST_CASE("photos with more than 65,535 pixels per side are refused") {
    const ldi::image<std::uint8_t> wide(1, 65536, 3), high(65536, 1, 3);
    CHECK(ldi::testing::raised([&] { ldi::lift(wide, ldi::image<float>(1, 65536)); }) == ldi::error_code::too_large);
    CHECK(ldi::testing::raised([&] { ldi::lift(high, ldi::image<float>(65536, 1)); }) == ldi::error_code::too_large);
    CHECK(ldi::lift(ldi::image<std::uint8_t>(1, 65535, 3), ldi::image<float>(1, 65535)).size() == 65535);
}
