#include <ldi/depth/level_dips.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace {

/// Front up to column 29, then a dip `width` samples wide, then the background.
ldi::image<float> with_dip(float front, float dip, float back, std::size_t width) {
    ldi::image<float> map(20, 60);
    for (std::size_t y = 0; y < map.height(); ++y)
        for (std::size_t x = 0; x < map.width(); ++x) map(y, x) = x < 30 ? front : x < 30 + width ? dip : back;
    return map;
}

}  // namespace

TEST_CASE("a dip of up to 4 samples between a step and the background is raised to the depth of the background") {
    for (const std::size_t width : {std::size_t{1}, std::size_t{3}, std::size_t{4}}) {
        CAPTURE(width);
        CHECK(ldi::level_dips(with_dip(0.8F, 0.05F, 0.2F, width)) == with_dip(0.8F, 0.2F, 0.2F, width));
    }
    const ldi::image<float> wide = with_dip(0.8F, 0.05F, 0.2F, 9);
    CHECK(ldi::level_dips(wide) == wide);
    CHECK(ldi::level_dips(wide, {.radius = 9}) == with_dip(0.8F, 0.2F, 0.2F, 9));
    CHECK(ldi::level_dips(wide, {.radius = 0}) == wide);
}

TEST_CASE("a dip is left unchanged if it is deeper than 0.35 times the step beside it") {
    CHECK(ldi::level_dips(with_dip(0.8F, 0.1F, 0.34F, 4)) == with_dip(0.8F, 0.34F, 0.34F, 4));
    const ldi::image<float> deep = with_dip(0.8F, 0.1F, 0.36F, 4);
    CHECK(ldi::level_dips(deep) == deep);
    CHECK(ldi::level_dips(deep, {.max_depth = 0.4F}) == with_dip(0.8F, 0.36F, 0.36F, 4));
}

TEST_CASE("a narrow gap between two parts of an object keeps the depth of the background") {
    for (const std::size_t width : {std::size_t{1}, std::size_t{4}, std::size_t{8}}) {
        const ldi::image<float> gap = with_dip(0.8F, 0.2F, 0.75F, width);
        CHECK(ldi::level_dips(gap) == gap);
    }
}

TEST_CASE("leveling changes neither slopes nor steps, and never lowers a value") {
    ldi::image<float> slope(40, 50), wavy(40, 50);
    for (std::size_t y = 0; y < slope.height(); ++y)
        for (std::size_t x = 0; x < slope.width(); ++x) {
            slope(y, x) = 0.01F * static_cast<float>(x) + 0.005F * static_cast<float>(y) + (x > 20 ? 0.2F : 0.0F);
            wavy(y, x) = 0.5F + 0.3F * std::sin(0.4F * static_cast<float>(x)) * std::cos(0.3F * static_cast<float>(y));
        }
    CHECK(ldi::level_dips(slope) == slope);
    const ldi::image<float> leveled = ldi::level_dips(wavy);
    for (std::size_t i = 0; i < wavy.size(); ++i) REQUIRE(leveled.data()[i] >= wavy.data()[i]);
}

TEST_CASE("leveling removes a ring around an object, so that no step remains between the ring and the background") {
    ldi::image<float> map(60, 80);
    for (std::size_t y = 0; y < map.height(); ++y)
        for (std::size_t x = 0; x < map.width(); ++x) {
            const float distance = std::hypot(static_cast<float>(x) - 40.0F, static_cast<float>(y) - 30.0F);
            map(y, x) = distance < 15 ? 0.9F : distance < 18 ? 0.06F : 0.2F;
        }
    const ldi::image<float> leveled = ldi::level_dips(map);
    for (std::size_t i = 0; i < map.size(); ++i) REQUIRE(leveled.data()[i] == std::max(map.data()[i], 0.2F));
}

TEST_CASE("maps smaller than the window, and empty maps, are accepted; options out of range are refused") {
    for (const std::size_t side : {std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
        const ldi::image<float> flat(side, 1, 1, 0.5F);
        CHECK(ldi::level_dips(flat) == flat);
    }
    CHECK(ldi::level_dips(ldi::image<float>()).empty());
    using options = ldi::level_options;
    for (const options& wrong : {options{.radius = -1}, {.radius = 65}, {.max_depth = 1.5F}, {.max_depth = std::nanf("")}})
        CHECK(ldi::testing::raised([&] { ldi::level_dips(ldi::image<float>(3, 3), wrong); }) == ldi::error_code::invalid_option);
}
