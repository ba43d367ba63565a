#include <ldi/inpaint/uncertain_rims.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

namespace {

using layer_with_rims = decltype(std::declval<ldi::photo_layer>().with<ldi::rim_column>({}));

layer_with_rims with_rims(ldi::photo_layer layer) {
    ldi::buffer<std::uint8_t> none(layer.size());
    return std::move(layer).with<ldi::rim_column>(std::move(none));
}

/// A red object in front of a green wall, from column 20 on, and red fuzz on the wall beside it.
layer_with_rims fuzzy_scene(std::size_t fuzz) {
    ldi::image<float> disparity(20, 40);
    ldi::image<std::uint8_t> photo(20, 40, 3);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            disparity(y, x, 0) = x < 20 ? 0.2F : 0.8F;
            photo(y, x, 0) = x + fuzz < 20 ? 20 : 200;
            photo(y, x, 1) = x + fuzz < 20 ? 200 : 20;
        }
    return with_rims(ldi::lift(photo, disparity));
}

void paint_unknown(layer_with_rims& layer, std::uint8_t red, std::uint8_t green) {
    for (std::int32_t i = 0; i < layer.topology().count(); ++i)
        if (layer.column<ldi::known_column>()[i] == 0)
            layer.at<ldi::color_column>(i)[0] = red, layer.at<ldi::color_column>(i)[1] = green;
}

}  // namespace

TEST_CASE("mark_uncertain_rims() makes exactly the background's rims unknown") {
    layer_with_rims layer = fuzzy_scene(0);
    const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 3);
    CHECK(rims.size() == 3 * 20);
    for (std::int32_t i = 0; i < layer.topology().count(); ++i) {
        const std::int32_t x = layer.topology().x()[i];
        REQUIRE(layer.column<ldi::known_column>()[i] == (x >= 17 && x < 20 ? 0 : 1));
    }
}

TEST_CASE("restore_rims() refuses rims of a different image, and changes nothing") {
    layer_with_rims layer = fuzzy_scene(0);
    const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 3);
    paint_unknown(layer, 30, 190);
    const layer_with_rims before = layer;
    const ldi::buffer<ldi::uncertain_rim> too_few(rims.begin(), rims.end() - 1);
    CHECK_THROWS_AS(ldi::restore_rims(layer, too_few), ldi::error);
    layer.column<ldi::rim_column>()[0] = 1;
    CHECK_THROWS_AS(ldi::restore_rims(layer, rims), ldi::error);
    CHECK(layer.column<ldi::known_column>() == before.column<ldi::known_column>());
    CHECK(layer.column<ldi::color_column>() == before.column<ldi::color_column>());
}

TEST_CASE("marking rims of width 0 clears the rims of an earlier call") {
    layer_with_rims layer = fuzzy_scene(0);
    ldi::mark_uncertain_rims(layer, 3);
    const ldi::buffer<ldi::uncertain_rim> none = ldi::mark_uncertain_rims(layer, 0);
    CHECK(none.empty());
    CHECK_NOTHROW(ldi::restore_rims(layer, none));
}

TEST_CASE("a rim that looks like the background is restored unchanged") {
    layer_with_rims layer = fuzzy_scene(0);
    const layer_with_rims before = layer;
    const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 3);
    paint_unknown(layer, 30, 190);
    ldi::restore_rims(layer, rims);
    CHECK(layer.column<ldi::known_column>() == before.column<ldi::known_column>());
    CHECK(layer.column<ldi::color_column>() == before.column<ldi::color_column>());
}

TEST_CASE("rim pixels that look like the foreground keep the painted color, and the rest of the rim is restored") {
    layer_with_rims layer = fuzzy_scene(2);
    const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 4);
    paint_unknown(layer, 20, 200);
    ldi::restore_rims(layer, rims);
    for (std::int32_t i = 0; i < layer.topology().count(); ++i) {
        const std::int32_t x = layer.topology().x()[i];
        if (x >= 20) continue;
        REQUIRE(layer.at<ldi::color_column>(i)[0] == 20);
        REQUIRE(layer.column<ldi::known_column>()[i] == (x < 18 ? 1 : 0));
    }
}

TEST_CASE("rim pixels with the foreground's color are restored only if the colors of both surfaces differ by less than 40") {
    for (const auto& [difference, is_fuzz] : {std::pair{30, false}, {36, false}, {44, true}, {60, true}, {75, true}}) {
        CAPTURE(difference);
        layer_with_rims layer = fuzzy_scene(2);
        // Only red distinguishes the object and its fuzz from the wall.
        const int object_red = 100 + difference;
        const auto repaint = [&](std::int32_t i) {
            const auto color = layer.at<ldi::color_column>(i);
            color[0] = static_cast<std::uint8_t>(color[0] == 200 ? object_red : 100), color[1] = 50;
        };
        for (std::int32_t i = 0; i < layer.topology().count(); ++i) repaint(i);
        const layer_with_rims before = layer;
        const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 4);
        paint_unknown(layer, 100, 50);
        ldi::restore_rims(layer, rims);
        for (std::int32_t i = 0; i < layer.topology().count(); ++i) {
            const std::int32_t x = layer.topology().x()[i];
            if (x != 18 && x != 19) continue;
            REQUIRE(layer.column<ldi::known_column>()[i] == (is_fuzz ? 0 : 1));
            REQUIRE(layer.at<ldi::color_column>(i)[0] == (is_fuzz ? 100 : before.at<ldi::color_column>(i)[0]));
        }
    }
}

TEST_CASE("restore_rims() restores rims whose surfaces differ by less than the contrast, and refuses a contrast of 0 or below") {
    for (const auto& [contrast, is_fuzz] : {std::pair{40.0F, true}, {200.0F, true}, {300.0F, false}}) {
        CAPTURE(contrast);
        layer_with_rims layer = fuzzy_scene(2);
        const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 4);
        paint_unknown(layer, 20, 200);
        ldi::restore_rims(layer, rims, contrast);
        for (std::int32_t i = 0; i < layer.topology().count(); ++i)
            if (const std::int32_t x = layer.topology().x()[i]; x == 18 || x == 19)
                REQUIRE(layer.column<ldi::known_column>()[i] == (is_fuzz ? 0 : 1));
    }
    layer_with_rims layer = fuzzy_scene(2);
    for (const float contrast : {0.0F, -1.0F, std::nanf("")})
        CHECK(ldi::testing::raised([&] { ldi::restore_rims(layer, {}, contrast); }) == ldi::error_code::invalid_option);
}

TEST_CASE("rims may be up to 32767 pixels wide, and the search for mixed colors ends there") {
    ldi::image<float> map(1, 40000, 1);
    for (std::size_t x = 0; x < 40000; ++x) map(0, x) = x < 39000 ? 0.2F : 0.8F;
    layer_with_rims layer =
        ldi::testing::lift_disparity(map).with<ldi::rim_column>(ldi::buffer<std::uint8_t>(40000, std::uint8_t{0}));
    CHECK_NOTHROW(ldi::unmix_colors(layer, {.foreground_margin = 0, .background_margin = 0, .reach = 1.0F}));
    CHECK(ldi::mark_uncertain_rims(layer, 32767).size() == 32767);
    CHECK(ldi::testing::raised([&] { ldi::mark_uncertain_rims(layer, 32768); }) == ldi::error_code::invalid_option);
}

TEST_CASE("a rim is restored only if less than an eighth of its color comes from the foreground") {
    for (const auto& [percent, is_back] : {std::pair{0, true}, {5, true}, {11, true}, {14, false}, {20, false}, {60, false}}) {
        CAPTURE(percent);
        layer_with_rims layer = fuzzy_scene(0);
        for (std::int32_t i = 0; i < layer.topology().count(); ++i)
            if (const std::int32_t x = layer.topology().x()[i]; x == 18 || x == 19) {
                layer.at<ldi::color_column>(i)[0] = static_cast<std::uint8_t>(20 + 180 * percent / 100);
                layer.at<ldi::color_column>(i)[1] = static_cast<std::uint8_t>(200 - 180 * percent / 100);
            }
        const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 4);
        paint_unknown(layer, 20, 200);
        ldi::restore_rims(layer, rims);
        for (std::int32_t i = 0; i < layer.topology().count(); ++i)
            if (const std::int32_t x = layer.topology().x()[i]; x == 18 || x == 19)
                REQUIRE(layer.column<ldi::known_column>()[i] == (is_back ? 1 : 0));
    }
}

TEST_CASE("if a surface is too narrow to compare colors, its rim is restored regardless of the painted color") {
    // A wall, a post of four columns in front of it, and an object in front of both: the post is the nearer surface at its
    // nearest silhouette.
    ldi::image<float> disparity(20, 40);
    ldi::image<std::uint8_t> photo(20, 40, 3);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            disparity(y, x, 0) = x < 18 ? 0.2F : x < 22 ? 0.5F : 0.8F;
            photo(y, x, 0) = x < 18 ? 20 : x < 22 ? 120 : 220;
        }
    layer_with_rims layer = with_rims(ldi::lift(photo, disparity));
    const layer_with_rims before = layer;
    const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, 3);
    const auto nearer_to_the_wall = [&](std::int32_t i) { return layer.topology().x()[i] == 19; };
    for (std::int32_t i = 0; i < layer.topology().count(); ++i)
        if (nearer_to_the_wall(i)) REQUIRE(layer.column<ldi::known_column>()[i] == 0);
    paint_unknown(layer, 20, 0);
    ldi::restore_rims(layer, rims);
    for (std::int32_t i = 0; i < layer.topology().count(); ++i)
        if (nearer_to_the_wall(i)) REQUIRE(layer.at<ldi::color_column>(i)[0] == before.at<ldi::color_column>(i)[0]);
}

TEST_CASE("every rim pixel that was not painted over is restored") {
    std::mt19937 random(2);
    for (int round = 0; round < 200; ++round) {
        layer_with_rims layer =
            with_rims(ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 1 + random() % 40, 1 + random() % 40)));
        for (std::uint8_t& value : layer.column<ldi::color_column>()) value = static_cast<std::uint8_t>(random());
        for (std::uint8_t& known : layer.column<ldi::known_column>()) known = random() % 8 != 0;
        const layer_with_rims before = layer;
        const int width = static_cast<int>(random() % 6);
        const ldi::buffer<ldi::uncertain_rim> rims = ldi::mark_uncertain_rims(layer, width);
        const ldi::graph& g = layer.topology();
        std::int32_t marked = 0;
        for (std::int32_t i = 0; i < g.count(); ++i)
            if (layer.column<ldi::rim_column>()[i] != 0) REQUIRE(rims[marked++].position == i);
        REQUIRE(marked == rims.count());
        REQUIRE((width > 0 || rims.empty()));
        for (std::int32_t i = 0; i < g.count(); ++i)
            REQUIRE(layer.column<ldi::known_column>()[i] <= before.column<ldi::known_column>()[i]);
        ldi::restore_rims(layer, rims);
        REQUIRE(layer.column<ldi::known_column>() == before.column<ldi::known_column>());
        REQUIRE(layer.column<ldi::color_column>() == before.column<ldi::color_column>());
    }
}
