#include <ldi/inpaint/grain.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

namespace {

constexpr std::int32_t width = 120, height = 80;

/// Gray with noise of this standard deviation, and an unknown band in the middle.
ldi::photo_layers noisy_around_a_band(double deviation, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 1);
    ldi::photo_layers layers(ldi::make_grid(width, height));
    for (std::int32_t i = 0; i < width * height; ++i) {
        layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] = i % width < 40 || i % width >= 80 ? 1 : 0;
        const double value = std::clamp(128 + deviation * noise(random), 0.0, 255.0);
        for (std::uint8_t& channel : layers.at<ldi::color_column>(i))
            channel = static_cast<std::uint8_t>(
                std::lround(layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] != 0 ? value : 128.0));
    }
    return layers;
}

/// Standard deviation of the band's difference from gray.
double deviation_inside(const ldi::photo_layers& layers) {
    double squares = 0, count = 0;
    for (std::int32_t i = 0; i < width * height; ++i) {
        if (layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] != 0) continue;
        const double error = layers.at<ldi::color_column>(i)[1] - 128.0;
        squares += error * error, count += 1;
    }
    return std::sqrt(squares / count);
}

}  // namespace

TEST_CASE("grain is as strong as the surrounding noise times the option `strength`") {
    for (const double deviation : {2.0, 4.0, 8.0})
        for (const float strength : {1.0F, 0.5F}) {
            ldi::photo_layers layers = noisy_around_a_band(deviation);
            ldi::grain_options options;
            options.strength = strength;
            options.limit = 64.0F;
            ldi::add_grain(layers, options);
            const double found = deviation_inside(layers), expected = strength * deviation;
            INFO("noise of " << deviation << " around, grain of " << found << " at strength " << strength);
            // Rounding to integers adds 1/12 to the variance.
            REQUIRE(std::abs(found - std::hypot(expected, std::sqrt(1.0 / 12))) < 0.12 * expected + 0.1);
        }
}

TEST_CASE("by default, grain has 0.6 times the strength of the surrounding noise, and at most 12 gray levels") {
    for (const double deviation : {4.0, 8.0, 100.0}) {
        ldi::photo_layers layers = noisy_around_a_band(deviation);
        ldi::add_grain(layers);
        CHECK(deviation_inside(layers) == Approx(0.6 * std::min(deviation, 20.0)).epsilon(0.12));
    }
}

TEST_CASE("noise in each color channel is weighted by the channel's contribution to brightness") {
    for (const auto& [channel, weight] : {std::pair<std::size_t, double>{0, 0.299}, {1, 0.587}, {2, 0.114}}) {
        ldi::photo_layers layers = noisy_around_a_band(16.0);
        for (std::int32_t i = 0; i < width * height; ++i)
            for (std::size_t c = 0; c < 3; ++c)
                if (c != channel) layers.at<ldi::color_column>(i)[c] = 128;
        ldi::add_grain(layers, {.strength = 1.0F, .limit = 64.0F});
        CAPTURE(channel);
        CHECK(deviation_inside(layers) == Approx(weight * 16.0).epsilon(0.15));
    }
}

TEST_CASE("grain changes no color in smooth surroundings, and changes colors beside a blurred edge by at most one level") {
    for (const int steepness : {0, 1, 2})
        for (const bool edge : {false, true}) {
            ldi::photo_layers layers(ldi::make_grid(width, height));
            for (std::int32_t i = 0; i < width * height; ++i) {
                const std::int32_t x = i % width, from_hole = std::max(39 - x, x - 80);
                layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] = x < 40 || x >= 80 ? 1 : 0;
                // like lens blur from a removed surface that was 150 levels brighter
                const int smear = edge && from_hole >= 0 && from_hole < 3 ? 75 >> (3 * from_hole) : 0;
                for (std::uint8_t& channel : layers.at<ldi::color_column>(i))
                    channel = static_cast<std::uint8_t>(steepness * x + smear);
            }
            const ldi::buffer<std::uint8_t> before = layers.column<ldi::color_column>().copy();
            ldi::add_grain(layers);
            INFO(steepness << (edge ? " per pixel, and an edge" : " per pixel"));
            for (std::size_t i = 0; i < before.size(); ++i)
                REQUIRE(std::abs(before[i] - layers.column<ldi::color_column>()[i]) <= (edge ? 1 : 0));
        }
}

TEST_CASE("grain continues the noise of a strip that is five pixels wide") {
    ldi::photo_layers layers = noisy_around_a_band(8.0);
    for (std::int32_t i = 0; i < width * height; ++i)
        if (const std::int32_t x = i % width; x < 35 || x >= 85)
            for (std::uint8_t& channel : layers.at<ldi::color_column>(i)) channel = 128;
    ldi::add_grain(layers, {.strength = 1.0F});
    CHECK(deviation_inside(layers) > 5.0);
}

TEST_CASE("grain is gray, unbiased and reproducible, and does not change known pixels or other columns") {
    std::mt19937 random(2);
    for (int round = 0; round < 20; ++round) {
        ldi::photo_layers layers = noisy_around_a_band(2.0 + round % 5, static_cast<unsigned>(random()));
        const ldi::photo_layers before = layers;
        ldi::add_grain(layers);
        ldi::photo_layers again = before;
        ldi::add_grain(again);
        REQUIRE((layers.column<ldi::color_column>() == again.column<ldi::color_column>()));
        REQUIRE((layers.column<ldi::known_column>() == before.column<ldi::known_column>()));
        REQUIRE((layers.column<ldi::disparity_column>() == before.column<ldi::disparity_column>()));
        double sum = 0, count = 0;
        for (std::int32_t i = 0; i < width * height; ++i) {
            const auto now = layers.at<ldi::color_column>(i);
            const auto then = before.at<ldi::color_column>(i);
            REQUIRE((now[0] == now[1] && now[1] == now[2]));
            if (layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] != 0)
                REQUIRE(now[0] == then[0]);
            else
                sum += now[0] - then[0], count += 1;
        }
        REQUIRE(std::abs(sum / count) < 0.25);
    }
}

TEST_CASE("a strength of 0 changes nothing, and `limit` bounds the grain in noisy surroundings") {
    ldi::photo_layers layers = noisy_around_a_band(6.0);
    const ldi::buffer<std::uint8_t> before = layers.column<ldi::color_column>().copy();
    ldi::grain_options options;
    options.strength = 0.0F;
    ldi::add_grain(layers, options);
    REQUIRE((layers.column<ldi::color_column>() == before));

    layers = noisy_around_a_band(100.0);
    options.strength = 1.0F;
    options.limit = 5.0F;
    ldi::add_grain(layers, options);
    REQUIRE(deviation_inside(layers) < 5.5);
}

TEST_CASE("noise on another surface adds no grain") {
    ldi::photo_layers layers = noisy_around_a_band(10.0);
    for (std::int32_t i = 0; i < width * height; ++i) {
        const std::int32_t x = i % width;
        if (x == 40 || x == 79)
            layers.edit_links([&](ldi::link_editor& links) { links.unlink(i, x == 40 ? ldi::side::left : ldi::side::right); });
        if (x == 45 || x == 74)  // a known column without noise, on the band's side of the cut
            layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] = 1;
    }
    ldi::add_grain(layers);
    for (std::int32_t i = 0; i < width * height; ++i) {
        const std::int32_t x = i % width;
        if (x >= 40 && x < 80) REQUIRE(layers.at<ldi::color_column>(i)[0] == 128);
    }
}

TEST_CASE("a negative, NaN or huge strength or limit is refused, and the error names the option") {
    ldi::photo_layers layers = noisy_around_a_band(1.0);
    for (const float wrong : {-1.0F, std::nanf(""), 1e9F}) {
        ldi::grain_options strength, limit;
        strength.strength = limit.limit = wrong;
        REQUIRE_THROWS_WITH(ldi::add_grain(layers, strength), Catch::Contains("grain_options, strength"));
        REQUIRE_THROWS_WITH(ldi::add_grain(layers, limit), Catch::Contains("grain_options, limit"));
    }
}
