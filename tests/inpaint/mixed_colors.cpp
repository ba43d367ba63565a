#include <ldi/inpaint/mixed_colors.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/lifted_scene.hpp"

#include <ldi/base/executor.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

namespace {

using color = std::array<float, 3>;

/// A disc in front of a background, both textured, seen by a camera whose pixels mix both along the rim.
struct disc_scene {
    static constexpr std::size_t size = 120;
    ldi::photo_layer photo;
    ldi::image<float> alpha{size, size};  ///< true share of the disc
    ldi::image<float> front{size, size, 3}, back{size, size, 3};

    disc_scene(std::mt19937& random, float blur) {
        std::uniform_real_distribution<float> unit(0.0F, 1.0F);
        const float x0 = 60 + 4 * unit(random), y0 = 60 + 4 * unit(random), radius = 30 + 8 * unit(random);
        // Two different colors, both with waves of amplitude 10.
        const color disc{200 + 40 * unit(random), 20 + 60 * unit(random), 20 + 80 * unit(random)};
        const color wall{20 + 60 * unit(random), 120 + 60 * unit(random), 150 + 60 * unit(random)};
        ldi::image<std::uint8_t> picture(size, size, 3);
        ldi::image<float> disparity(size, size);
        for (std::size_t y = 0; y < size; ++y)
            for (std::size_t x = 0; x < size; ++x) {
                const float u = static_cast<float>(x), v = static_cast<float>(y);
                const float inside = radius - std::hypot(u + 0.5F - x0, v + 0.5F - y0);
                const float share = alpha(y, x) = std::clamp(0.5F + inside / blur, 0.0F, 1.0F);
                disparity(y, x) = inside > 0 ? 0.8F : 0.2F;
                for (std::size_t c = 0; c < 3; ++c) {
                    front(y, x, c) = disc[c] + 10 * std::sin(0.3F * u + 0.1F * v);
                    back(y, x, c) = wall[c] + 10 * std::sin(0.2F * v - 0.15F * u);
                    const float mixed = share * front(y, x, c) + (1 - share) * back(y, x, c);
                    picture(y, x, c) = static_cast<std::uint8_t>(std::clamp(mixed + 0.5F, 0.0F, 255.0F));
                }
            }
        photo = ldi::lift(picture, disparity);
    }

    float distance(const ldi::photo_layer& layer, std::size_t i, const ldi::image<float>& truth) const {
        float sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float d = static_cast<float>(layer.column<ldi::color_column>()[3 * i + c]) - truth.data()[3 * i + c];
            sum += d * d;
        }
        return std::sqrt(sum);
    }
};

}  // namespace

TEST_CASE("the matte of a blurred silhouette is accurate to a tenth on average, and foreground colors are cleaned") {
    std::mt19937 random(5);
    for (int round = 0; round < 20; ++round) {
        const disc_scene scene(random, 1.0F + 0.15F * static_cast<float>(round % 10));
        ldi::photo_layer layer = scene.photo;
        ldi::unmix_colors(layer);
        const auto matte = layer.column<ldi::matte_column>();
        double off = 0, mixed = 0, before = 0, after = 0, kept = 0, leaked = 0;
        for (std::size_t i = 0; i < layer.size(); ++i) {
            const float alpha = scene.alpha.data()[i];
            const bool in_front = layer.column<ldi::disparity_column>()[i] > 0.5F;
            if (alpha > 0 && alpha < 1) {
                off += std::abs(static_cast<double>(matte.data()[i]) / 255 - static_cast<double>(alpha)), mixed += 1;
                if (in_front) {
                    before += static_cast<double>(scene.distance(scene.photo, i, scene.front));
                    after += static_cast<double>(scene.distance(layer, i, scene.front));
                }
            }
            if (in_front) REQUIRE(layer.column<ldi::known_column>()[i] == 1);
            if (in_front || layer.column<ldi::known_column>()[i] == 0) continue;
            kept += 1;
            leaked = std::max(leaked, static_cast<double>(alpha));
        }
        CHECK(off / mixed < 0.1);
        CHECK(after < 0.7 * before);
        CHECK(leaked < 0.5);  // pixels with more of the foreground's color are refilled
        CHECK(kept > 9000);
    }
}

TEST_CASE("pixels that are not mixed keep their colors, except for the background next to the silhouette") {
    std::mt19937 random(6);
    for (int round = 0; round < 10; ++round) {
        const disc_scene scene(random, 0.001F);
        ldi::photo_layer layer = scene.photo;
        ldi::unmix_colors(layer);
        std::size_t changed = 0;
        const auto disparity = layer.column<ldi::disparity_column>();
        for (std::int32_t i = 0; i < layer.topology().count(); ++i) {
            bool touches_silhouette = false;
            for (const ldi::side s : ldi::all_sides)
                if (layer.topology().neighbor(i, s) == ldi::no_pixel && disparity[i] < 0.5F) touches_silhouette = true;
            const std::size_t at = static_cast<std::size_t>(i);
            const bool is_same = scene.distance(layer, at, disparity[i] > 0.5F ? scene.front : scene.back) < 2;
            const bool is_known = layer.column<ldi::known_column>()[i] == 1;
            changed += touches_silhouette || (is_same && is_known) ? 0U : 1U;
        }
        CHECK(changed < 5);
    }
}

TEST_CASE(
    "the matte is correct beside a speck seven pixels long, and in a stripe twelve pixels wide whose neighbors look like "
    "mixtures") {
    const color front{220, 60, 60}, back{60, 140, 200}, speck{60, 255, 0}, mixture{108, 116, 158};
    // The foreground begins at column 20. Its share of the colors in column 19 is 0.3.
    const auto share_in_the_middle = [&](auto&& background) {
        ldi::image<float> disparity(40, 40);
        ldi::image<std::uint8_t> photo(40, 40, 3);
        for (std::size_t y = 0; y < 40; ++y)
            for (std::size_t x = 0; x < 40; ++x) {
                disparity(y, x) = x < 20 ? 0.2F : 0.8F;
                const color behind = background(x, y);
                for (std::size_t c = 0; c < 3; ++c)
                    photo(y, x, c) = static_cast<std::uint8_t>(x < 19    ? behind[c]
                                                               : x == 19 ? 0.3F * front[c] + 0.7F * behind[c]
                                                                         : front[c]);
            }
        ldi::photo_layer layer = ldi::lift(photo, disparity);
        ldi::unmix_colors(layer);
        return layer.column<ldi::matte_column>()[20 * 40 + 19] / 255.0;
    };
    CHECK(share_in_the_middle([&](std::size_t, std::size_t) { return back; }) == Approx(0.3).margin(0.1));
    const auto with_speck = [&](std::size_t x, std::size_t y) { return x < 18 && y >= 17 && y < 24 ? speck : back; };
    CHECK(share_in_the_middle(with_speck) == Approx(0.3).margin(0.1));
    const auto with_stripes = [&](std::size_t, std::size_t y) { return y >= 14 && y < 26 ? back : mixture; };
    CHECK(share_in_the_middle(with_stripes) == Approx(0.3).margin(0.1));
}

TEST_CASE("a color near a sample of one surface is assigned to that surface, even if a mixture would explain it") {
    // The color is halfway between the first foreground sample and the background samples, whose contrast is 200. A sample is
    // near if its distance is at most a third of this contrast.
    const ldi::detail::float_color middle{120, 100, 100}, backgrounds[] = {{20, 100, 100}, {20, 100, 100}};
    for (const auto& [distance, is_near] : {std::pair{30.0F, true}, {60.0F, true}, {80.0F, false}, {150.0F, false}}) {
        CAPTURE(distance);
        const ldi::detail::float_color foregrounds[] = {{220, 100, 100}, {120, 100 + distance, 100}};
        const ldi::detail::mixture found = ldi::detail::unmix(middle, foregrounds, backgrounds, 2, nullptr);
        CHECK((found.alpha > 0.7F) == is_near);
        CHECK(found.foreground == foregrounds[is_near ? 1 : 0]);
    }
}

TEST_CASE("the confidence in a mixture is full below an error of a tenth of the contrast, and 0 above half of it") {
    const ldi::detail::float_color foreground{220, 100, 100}, background{20, 100, 100};
    for (const auto& [error, confidence] : {std::pair{0.05F, 8}, {0.09F, 8}, {0.16F, 6}, {0.31F, 3}, {0.51F, 0}, {1.0F, 0}}) {
        CAPTURE(error);
        CHECK(ldi::detail::unmix({220, 100 + 200 * error, 100}, &foreground, &background, 1, nullptr).confidence == confidence);
    }
}

TEST_CASE(
    "background pixels with more than two fifths of foreground color are refilled, and foreground pixels with more than a fifth "
    "of background color are cleaned") {
    const auto unmixed = [](float behind, float in_front) {
        const color front{220, 60, 60}, back{60, 140, 200};
        ldi::image<float> disparity(30, 40);
        ldi::image<std::uint8_t> photo(30, 40, 3);
        for (std::size_t y = 0; y < 30; ++y)
            for (std::size_t x = 0; x < 40; ++x) {
                disparity(y, x) = x < 20 ? 0.2F : 0.8F;
                const float alpha = x < 18 ? 0.0F : x == 18 ? behind : x == 19 ? 0.7F : x == 20 ? in_front : 1.0F;
                for (std::size_t c = 0; c < 3; ++c)
                    photo(y, x, c) = static_cast<std::uint8_t>(alpha * front[c] + (1 - alpha) * back[c] + 0.5F);
            }
        ldi::photo_layer layer = ldi::lift(photo, disparity);
        ldi::unmix_colors(layer, {.background_margin = 1});
        return layer;
    };
    const auto at = [](std::size_t x) { return 15 * 40 + x; };
    for (const auto& [alpha, is_refilled] : {std::pair{0.2F, false}, {0.32F, false}, {0.5F, true}, {0.6F, true}}) {
        CAPTURE(alpha);
        const ldi::photo_layer layer = unmixed(alpha, 1.0F);
        CHECK(layer.column<ldi::known_column>()[at(18)] == (is_refilled ? 0 : 1));
        CHECK(layer.column<ldi::known_column>()[at(17)] == 1);
    }
    for (const auto& [alpha, is_cleaned] : {std::pair{0.6F, true}, {0.72F, true}, {0.9F, false}}) {
        CAPTURE(alpha);
        const ldi::photo_layer layer = unmixed(0.5F, alpha);
        const float before = alpha * 60 + (1 - alpha) * 140, green = layer.column<ldi::color_column>()[3 * at(20) + 1];
        CHECK((green < before - 15) == is_cleaned);
    }
}

TEST_CASE("if a pixel is half foreground, cleaning halves the deviation of its foreground color from nearby colors") {
    // Beside the silhouette, the foreground is brighter by 40 in blue, which no mixture explains.
    ldi::image<float> disparity(30, 40);
    ldi::image<std::uint8_t> photo(30, 40, 3, std::uint8_t{100});
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            disparity(y, x) = x < 20 ? 0.2F : 0.8F;
            photo(y, x, 0) = x < 20 ? 20 : x == 20 ? 120 : 220;
            if (x == 20) photo(y, x, 2) = 120;
        }
    ldi::photo_layer layer = ldi::lift(photo, disparity);
    ldi::unmix_colors(layer);
    const auto cleaned = layer.at<ldi::color_column>(15 * 40 + 20);
    CHECK(cleaned[0] == Approx(220).margin(12));
    CHECK(cleaned[2] == Approx(120).margin(4));
}

TEST_CASE("margins grow in proportion for photos whose long side exceeds 1536 pixels") {
    ldi::image<float> map(24, 3072);
    for (std::size_t y = 0; y < 24; ++y)
        for (std::size_t x = 0; x < 3072; ++x) map(y, x, 0) = x < 1500 ? 0.2F : 0.8F;
    ldi::photo_layer layers = ldi::testing::lift_disparity(map);
    ldi::unmix_colors(layers);
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const std::int32_t x = layers.topology().x()[i];
        REQUIRE(layers.column<ldi::known_column>()[i] == (x >= 1498 && x < 1504 ? 0 : 1));
    }
}

TEST_CASE("unmix_colors() returns the same colors and shares for any number of threads") {
    std::mt19937 random(21);
    const disc_scene scene(random, 3.0F);
    ldi::mixed_color_options wide;
    wide.reach = 0.2F;  // so that the band has enough pixels for several pieces
    ldi::photo_layer serial = scene.photo;
    ldi::unmix_colors(serial, wide);
    REQUIRE_FALSE((serial.column<ldi::color_column>() == scene.photo.column<ldi::color_column>()));
    for (const std::size_t count : {2U, 5U}) {
        ldi::thread_pool threads(count);
        ldi::photo_layer parallel = scene.photo;
        ldi::unmix_colors(parallel, wide, {}, threads);
        CHECK((parallel.column<ldi::color_column>() == serial.column<ldi::color_column>()));
        CHECK((parallel.column<ldi::matte_column>() == serial.column<ldi::matte_column>()));
        CHECK((parallel.column<ldi::known_column>() == serial.column<ldi::known_column>()));
    }
}

TEST_CASE("negative margins and other options outside their range are refused") {
    ldi::photo_layer layers = ldi::testing::lift_disparity(ldi::image<float>(4, 4));
    for (const ldi::mixed_color_options& options :
         {ldi::mixed_color_options{.foreground_margin = -1}, ldi::mixed_color_options{.background_margin = -1},
          ldi::mixed_color_options{.reach = 2.0F}, ldi::mixed_color_options{.contrast = 0.0F}})
        CHECK_THROWS_AS(ldi::unmix_colors(layers, options), ldi::error);
}

TEST_CASE("a number of shares that is neither 0 nor the number of pixels is refused") {
    ldi::image<float> map(20, 40);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x) = x < 20 ? 0.2F : 0.8F;
    ldi::photo_layer layers = ldi::testing::lift_disparity(map);
    for (const std::size_t count : {std::size_t{1}, layers.size() / 4, layers.size() - 1, layers.size() + 1}) {
        const ldi::buffer<std::uint8_t> shares(count, 128);
        CHECK(ldi::testing::raised([&] { ldi::unmix_colors(layers, {}, shares); }) == ldi::error_code::mismatch);
    }
    CHECK_NOTHROW(ldi::unmix_colors(layers, {}, ldi::buffer<std::uint8_t>(layers.size(), 128)));
}

TEST_CASE("exactly the margins on both sides of a silhouette become unknown") {
    ldi::image<float> map(20, 40);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x, 0) = x < 20 ? 0.2F : 0.8F;
    ldi::photo_layer layers = ldi::testing::lift_disparity(map);
    ldi::mixed_color_options options;
    options.foreground_margin = 3;
    options.background_margin = 1;
    ldi::unmix_colors(layers, options);
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const std::int32_t x = layers.topology().x()[i];
        REQUIRE(layers.column<ldi::known_column>()[i] == (x >= 19 && x < 23 ? 0 : 1));
    }
}

TEST_CASE("a rod thinner than its margins keeps its colors") {
    ldi::image<float> map(20, 40);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x, 0) = x >= 20 && x < 24 ? 0.8F : 0.2F;
    ldi::image<std::uint8_t> photo(20, 40, 3);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) photo(y, x, x >= 20 && x < 24 ? 0 : 1) = 200;
    ldi::photo_layer layers = ldi::lift(photo, map);
    ldi::unmix_colors(layers);
    for (std::size_t i = 0; i < layers.size(); ++i) {
        if (layers.topology().x()[i] < 20 || layers.topology().x()[i] >= 24) continue;
        const auto color = layers.at<ldi::color_column>(static_cast<std::int32_t>(i));
        REQUIRE(layers.column<ldi::known_column>()[i] == 1);
        REQUIRE((color[0] == 200 && color[1] == 0 && color[2] == 0));
    }
}

TEST_CASE("links lead from every unknown pixel to a known pixel within the width of both margins") {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        ldi::photo_layer layers =
            ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 1 + random() % 40, 1 + random() % 40));
        ldi::mixed_color_options options;
        options.foreground_margin = static_cast<int>(random() % 5);
        options.background_margin = static_cast<int>(random() % 5);
        ldi::unmix_colors(layers, options);
        // A surface may be the foreground at one silhouette and the background at another. Its two margins may then meet.
        // Together they are at most 8 steps wide.
        ldi::buffer<std::uint8_t> reached = layers.column<ldi::known_column>().copy();
        for (int step = 0; step < options.foreground_margin + options.background_margin; ++step) {
            const ldi::buffer<std::uint8_t> before = reached;
            for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i)
                for (ldi::side s : ldi::all_sides)
                    if (const std::int32_t n = layers.topology().neighbor(i, s);
                        n != ldi::no_pixel && before[static_cast<std::size_t>(n)] != 0)
                        reached[static_cast<std::size_t>(i)] = 1;
        }
        for (std::uint8_t r : reached) REQUIRE(r == 1);
    }
}

TEST_CASE("wide margins need bounded memory per pixel, and margins without a known pixel beyond them stay known") {
    ldi::image<float> disparity(128, 128);
    for (std::size_t y = 0; y < 128; ++y)
        for (std::size_t x = 0; x < 128; ++x) disparity(y, x) = x + y / 2 < 90 ? 0.2F : 0.8F;
    ldi::photo_layer layer = ldi::testing::lift_disparity(disparity);
    ldi::testing::counted_memory own;
    own.limit = 400 * layer.size();
    const ldi::memory_scope scope(own.source);
    ldi::mixed_color_options options;
    options.foreground_margin = options.background_margin = 48;
    ldi::unmix_colors(layer, options);
    const auto& known = layer.column<ldi::known_column>();
    CHECK(std::count(known.begin(), known.end(), 0) > 128 * 60);
    // With unlimited margins, no known pixel lies beyond them, so that all pixels stay known.
    layer = ldi::testing::lift_disparity(disparity);
    options.foreground_margin = options.background_margin = 1 << 30;
    ldi::unmix_colors(layer, options);
    CHECK(std::count(layer.column<ldi::known_column>().begin(), layer.column<ldi::known_column>().end(), 0) == 0);
}
