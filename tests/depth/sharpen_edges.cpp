#include <ldi/depth/sharpen_edges.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

namespace {

// A step at x = `edge`, in samples, blurred by a Gaussian of standard deviation `sigma`.
ldi::image<float> washed_out_step(float low, float high, float edge, float sigma) {
    ldi::image<float> map(20, 60);
    for (std::size_t y = 0; y < map.height(); ++y)
        for (std::size_t x = 0; x < map.width(); ++x) {
            const float distance = (static_cast<float>(x) - edge) / sigma;
            map(y, x) = low + (high - low) * 0.5F * (1.0F + std::erf(distance * 0.70710678F));
        }
    return map;
}

float max_step(const ldi::image<float>& map, std::size_t y) {
    float result = 0.0F;
    for (std::size_t x = 0; x + 1 < map.width(); ++x) result = std::max(result, map(y, x + 1) - map(y, x));
    return result;
}

}  // namespace

TEST_CASE("a blurred edge becomes a single step at its steepest point") {
    for (const float sigma : {1.0F, 2.0F, 3.0F})
        for (const float height : {0.3F, 0.5F, 0.8F})
            for (const float edge : {24.5F, 30.5F, 33.5F}) {
                const ldi::image<float> washed = washed_out_step(0.1F, 0.1F + height, edge, sigma),
                                        sharp = ldi::sharpen_edges(washed);
                CAPTURE(sigma, height, edge);
                for (std::size_t y = 0; y < sharp.height(); ++y) {
                    const std::size_t before = static_cast<std::size_t>(edge - 0.5F);
                    REQUIRE(sharp(y, before + 1) - sharp(y, before) > 0.7F * height);
                    REQUIRE(max_step(sharp, y) == sharp(y, before + 1) - sharp(y, before));
                }
            }
}

TEST_CASE("smoothing before sharpening preserves the sum of a map and has a variance of 1 along rows and columns") {
    ldi::image<float> map(15, 15);
    map(7, 7) = 1.0F;
    const ldi::image<float> smooth = ldi::detail::sharpen::smoothed(map);
    double sum = 0, across = 0, down = 0;
    for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 15; ++x) {
            const double value = smooth(static_cast<std::size_t>(y), static_cast<std::size_t>(x));
            sum += value, across += value * (x - 7) * (x - 7), down += value * (y - 7) * (y - 7);
        }
    CHECK(sum == Approx(1.0));
    CHECK(across == Approx(1.0));
    CHECK(down == Approx(1.0));
}

TEST_CASE("slopes, and edges lower than three times the surface rule's maximum step, are not sharpened") {
    ldi::image<float> slope(40, 50);
    for (std::size_t y = 0; y < slope.height(); ++y)
        for (std::size_t x = 0; x < slope.width(); ++x)
            slope(y, x) = 0.02F * static_cast<float>(x) + 0.015F * static_cast<float>(y);
    CHECK(ldi::sharpen_edges(slope) == slope);
    const ldi::image<float> low = washed_out_step(0.5F, 0.64F, 30.5F, 2.0F);
    CHECK(ldi::sharpen_edges(low) == low);
    CHECK(ldi::sharpen_edges(low, {}, {.min_change = 1.5F}) != low);
    CHECK(ldi::sharpen_edges(slope, {}, {.min_share = 0.3F}) != slope);
}

TEST_CASE("an edge along the border of the map is not sharpened, because networks err there") {
    const ldi::image<float> map = washed_out_step(0.1F, 0.9F, 57.5F, 0.7F);
    CHECK(ldi::sharpen_edges(map) == map);
}

TEST_CASE("sharpening introduces no new values, and returns the same result on three threads") {
    std::mt19937 random(3);
    for (int round = 0; round < 20; ++round) {
        const ldi::image<float> map = ldi::testing::random_disparity(random, 1 + random() % 50, 1 + random() % 50);
        const ldi::image<float> sharp = ldi::sharpen_edges(map);
        for (const float v : sharp) REQUIRE(std::find(map.begin(), map.end(), v) != map.end());
        REQUIRE(ldi::sharpen_edges(map, {}, {}, ldi::thread_pool(3)) == sharp);
    }
}

TEST_CASE("a radius outside 0 to 64 is refused, and a radius of 0 changes nothing") {
    const ldi::image<float> map = washed_out_step(0.1F, 0.9F, 30.5F, 2.0F);
    CHECK_THROWS_WITH(ldi::sharpen_edges(map, {}, {.radius = -1}), Catch::Contains("0 to 64") && Catch::Contains("-1"));
    CHECK(ldi::testing::raised([&] { ldi::sharpen_edges(map, {}, {.radius = 65}); }) == ldi::error_code::invalid_option);
    CHECK(ldi::sharpen_edges(map, {}, {.radius = 0}) == map);
    for (const float limit : {-1.0F, std::numeric_limits<float>::quiet_NaN()}) {
        CHECK(ldi::testing::raised([&] { ldi::sharpen_edges(map, {}, {.min_change = limit}); }) ==
              ldi::error_code::invalid_option);
        CHECK(ldi::testing::raised([&] { ldi::sharpen_edges(map, {}, {.min_share = limit}); }) ==
              ldi::error_code::invalid_option);
    }
    CHECK(ldi::sharpen_edges(ldi::image<float>()).empty());
}
