#include <ldi/photo3d/options.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

TEST_CASE("a shrunk photo has the requested long side, and its short side is rounded to an integer of at least 1") {
    std::mt19937 random(1);
    for (int round = 0; round < 1000; ++round) {
        const std::size_t length = 1 + random() % 5000, longer = length + random() % 5000, long_side = 1 + random() % 500;
        const std::size_t found = ldi::shrunk_length(length, longer, long_side);
        const double exact = static_cast<double>(length * std::min(longer, long_side)) / static_cast<double>(longer);
        CAPTURE(length, longer, long_side);
        REQUIRE(static_cast<double>(found) == std::max(std::floor(exact + 0.5), 1.0));
        REQUIRE(ldi::shrunk_length(longer, longer, long_side) == std::min(longer, long_side));
    }
}

TEST_CASE("the size of a depth sample is the photo's width divided by the map's, at least 1 and at most the maximum size") {
    const auto size_of_sample = [](std::size_t map_width, std::size_t photo_width) {
        return ldi::sample_size(ldi::image<float>(1, map_width), ldi::image<std::uint8_t>(1, photo_width, 3), {});
    };
    CHECK(size_of_sample(100, 250) == 2.5F);
    CHECK(size_of_sample(100, 50) == 1.0F);
    CHECK(size_of_sample(10, 250) == 16.0F);
    CHECK(size_of_sample(0, 250) == 1.0F);
    CHECK(ldi::sample_size({}, ldi::image<std::uint8_t>(8, 8, 3), {}) == 1.0F);
}

TEST_CASE(
    "lengths in options scale with a depth sample's side, pixel counts scale with its area, and other options do not change") {
    std::mt19937 random(2);
    for (int round = 0; round < 100; ++round) {
        const float sample = 1.0F + static_cast<float>(random() % 1500) / 100.0F;
        ldi::curve_options curves;
        curves.min_length = random() % 100, curves.tangent_length = random() % 100;
        const ldi::curve_options scaled = ldi::scaled(curves, sample);
        CHECK(static_cast<double>(scaled.min_length) == Approx(sample * static_cast<double>(curves.min_length)).margin(0.51));
        CHECK(static_cast<double>(scaled.tangent_length) ==
              Approx(sample * static_cast<double>(curves.tangent_length)).margin(0.51));
        CHECK(scaled.max_density == curves.max_density);
        CHECK(scaled.max_sides == curves.max_sides);
        ldi::middle_component_options components;
        components.min_size = static_cast<decltype(components.min_size)>(random() % 100);
        CHECK(static_cast<double>(ldi::scaled(components, sample).min_size) ==
              Approx(sample * sample * static_cast<double>(components.min_size)).margin(0.51));
        ldi::flake_options flakes;
        flakes.min_size = components.min_size, flakes.min_width = static_cast<float>(random() % 100);
        CHECK(ldi::scaled(flakes, sample).min_size == ldi::scaled(components, sample).min_size);
        CHECK(ldi::scaled(flakes, sample).min_width == Approx(sample * flakes.min_width));
    }
}

TEST_CASE("charts of a photo are limited to the size of its sheets, and a photo or a geometry size of zero is refused") {
    for (const std::size_t factor : {std::size_t{1}, std::size_t{2}, std::size_t{3}})
        CHECK(ldi::for_sheets({}, 1536 * factor, 1000 * factor).charts.max_side ==
              std::min(ldi::photo3d_options().charts.max_side, ldi::max_chart_side(static_cast<double>(factor), {})));
    ldi::photo3d_options no_side;
    no_side.long_side = 0;
    CHECK(ldi::testing::raised([&] { ldi::for_sheets(no_side, 3, 4); }) == ldi::error_code::mismatch);
    CHECK(ldi::testing::raised([] { ldi::for_sheets({}, 0, 4); }) == ldi::error_code::mismatch);
    CHECK(ldi::testing::raised([] { ldi::for_sheets({}, 3, 0); }) == ldi::error_code::mismatch);
}
