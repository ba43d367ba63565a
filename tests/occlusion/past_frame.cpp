#include <ldi/occlusion/past_frame.hpp>

#include <ldi/core/validate.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

using namespace ldi;

namespace {

struct grown_photo {
    photo_layers before, after;
    photo_facts facts;
};

/// Returns layers with hidden surfaces and random colors, before and after growth past the frame.
template <executor Executor = const serial_executor>
grown_photo grow(const image<float>& disparity, float motion, std::mt19937& random, Executor&& threads = {}) {
    photo_layer layer = testing::lift_disparity(disparity);
    for (std::uint8_t& value : layer.column<color_column>()) value = static_cast<std::uint8_t>(random());
    const buffer<discontinuity_curve> curves = find_discontinuity_curves(layer, {});
    grown_photo result;
    result.facts = testing::facts_of(layer.topology());
    auto expanded = expand(std::move(layer), {}, curves, expand_options{.motion = motion}, {}, nullptr, threads);
    photo_layers layers = std::move(expanded.layers);
    for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(random());
    result.facts.motion = expanded.motion;
    result.before = layers;
    result.facts.margin = grow_past_frame(layers, result.facts, threads);
    result.after = std::move(layers);
    return result;
}

image<float> any_disparity(std::mt19937& random, std::size_t rows, std::size_t columns) {
    if (random() % 2 == 0) return testing::random_disparity(random, rows, columns);
    image<float> map(rows, columns);
    for (float& value : map) value = static_cast<float>(random() % 1000) / 999.0F;
    return map;
}

bool is_in_photo(const grown_photo& g, std::int32_t pixel) {
    const graph& t = g.after.topology();
    const std::int32_t x = t.x()[pixel] - g.facts.margin, y = t.y()[pixel] - g.facts.margin;
    return x >= 0 && y >= 0 && x < g.facts.camera.width && y < g.facts.camera.height;
}

/// Returns a flat photo with stripes.
///
/// slope     pixels down per pixel to the right
/// contrast  difference of the brightest stripes from the mean, in gray levels
photo_layers stripes(std::int32_t size, float slope, float contrast, photo_facts& facts) {
    photo_layers layers =
        testing::lifted_layers(image<float>(static_cast<std::size_t>(size), static_cast<std::size_t>(size), 1, 0.0F));
    facts = testing::facts_of(layers.topology());
    facts.motion = 0.2F;
    for (std::int32_t i = 0; i < layers.topology().count(); ++i) {
        const float across = static_cast<float>(layers.topology().y()[i]) - slope * static_cast<float>(layers.topology().x()[i]);
        const std::uint8_t value = static_cast<std::uint8_t>(128.0F + contrast * std::sin(0.35F * across));
        for (std::uint8_t& channel : layers.at<color_column>(i)) channel = value;
    }
    return layers;
}

}  // namespace

TEST_CASE("layers that grow past the frame are valid, and their part inside the photo is unchanged") {
    std::mt19937 random(31);
    for (int round = 0; round < 60; ++round) {
        const std::size_t rows = 1 + random() % 50, columns = 1 + random() % 50;
        const grown_photo g = grow(any_disparity(random, rows, columns), round % 7 == 0 ? 1.0F : 0.15F, random);
        CAPTURE(round, rows, columns);
        REQUIRE_FALSE(validate_canonical(g.after.topology(), g.after.column<disparity_column>()));
        REQUIRE(g.after.topology().width() == g.before.topology().width() + 2 * g.facts.margin);
        REQUIRE(g.after.topology().height() == g.before.topology().height() + 2 * g.facts.margin);
        photo_layers kept = g.after;
        buffer<std::uint8_t> inside(kept.size());
        for (std::int32_t i = 0; i < kept.topology().count(); ++i) inside[i] = is_in_photo(g, i) ? 1 : 0;
        kept.keep(inside);
        kept.reorder(canonical_order(kept.topology(), kept.column<disparity_column>()));
        REQUIRE(kept.size() == g.before.size());
        for (const side s : all_sides) REQUIRE(kept.topology().neighbors(s) == g.before.topology().neighbors(s));
        REQUIRE(kept.column<color_column>() == g.before.column<color_column>());
        REQUIRE(kept.column<disparity_column>() == g.before.column<disparity_column>());
        REQUIRE(kept.column<known_column>() == g.before.column<known_column>());
    }
}

TEST_CASE("every surface continues past the frame as far as the camera sees, with its disparity at the border") {
    std::mt19937 random(32);
    for (int round = 0; round < 30; ++round) {
        const grown_photo g = grow(any_disparity(random, 2 + random() % 40, 2 + random() % 40), 0.2F, random);
        const graph& t = g.after.topology();
        const auto disparity = g.after.column<disparity_column>();
        for (std::int32_t i = 0; i < t.count(); ++i) {
            if (!is_in_photo(g, i)) {
                REQUIRE(g.after.column<known_column>()[i] == 0);
                REQUIRE(g.after.column<matte_column>()[i] == 0);
                continue;
            }
            const float reach = reach_past_frame(disparity[i], g.facts.camera, g.facts.motion);
            for (const side s : all_sides) {
                std::int32_t at = i, steps = 0;
                while ((at = t.neighbor(at, s)) != no_pixel && !is_in_photo(g, at)) {
                    ++steps;
                    REQUIRE(disparity[at] == disparity[i]);
                }
                const bool on_border = s == side::left    ? t.x()[i] == g.facts.margin
                                       : s == side::right ? t.x()[i] + 1 == t.width() - g.facts.margin
                                       : s == side::up    ? t.y()[i] == g.facts.margin
                                                          : t.y()[i] + 1 == t.height() - g.facts.margin;
                REQUIRE(steps == (on_border ? static_cast<std::int32_t>(std::ceil(reach)) : 0));
            }
        }
    }
}

TEST_CASE("reach_past_frame() covers both the camera's motion and a stereo pair") {
    const pinhole_camera camera{900, 1200, 1000};
    CHECK(reach_past_frame(0, camera, 0.1F) == Approx(60 + 4.4));
    CHECK(reach_past_frame(1, camera, 0.1F) == Approx(60 + 4.4));
    CHECK(reach_past_frame(0.5F, camera, 0.1F) == Approx(7.5 + 4.4));  // half of the stereo shift, which is 1/60 of the width
    CHECK(reach_past_frame(-0.02F, camera, 0.1F) == reach_past_frame(0, camera, 0.1F));
    CHECK(reach_past_frame(0.3F, camera, 0) == 2);
}

TEST_CASE("pixels past the frame have colors of their own surface") {
    std::mt19937 random(33);
    image<float> map(30, 40, 1, 0.1F);
    for (std::size_t y = 10; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x) = 0.9F;
    photo_layers layers = testing::lifted_layers(map);
    photo_facts facts = testing::facts_of(layers.topology());
    facts.motion = 0.5F;
    for (std::int32_t i = 0; i < layers.topology().count(); ++i)
        for (std::uint8_t& value : layers.at<color_column>(i))
            value = static_cast<std::uint8_t>(layers.column<disparity_column>()[i] > 0.5F ? 200 + random() % 50 : random() % 50);
    CHECK(grow_past_frame(layers, facts) > 8);
    for (std::int32_t i = 0; i < layers.topology().count(); ++i)
        REQUIRE((layers.at<color_column>(i)[0] >= 200) == (layers.column<disparity_column>()[i] > 0.5F));
}

TEST_CASE(
    "lines at the photo's border continue straight past the frame, except faint lines, which may be noise and are mirrored") {
    // Mean error beside the middle of the left side, relative to the contrast. Near corners, lines from other sides also appear.
    const auto error_past_frame = [](float slope, float contrast) {
        photo_facts facts;
        photo_layers layers = stripes(160, slope, contrast, facts);
        const std::int32_t margin = grow_past_frame(layers, facts);
        const graph& t = layers.topology();
        double error = 0, count = 0;
        for (std::int32_t i = 0; i < t.count(); ++i) {
            const std::int32_t x = t.x()[i] - margin, y = t.y()[i] - margin;
            if (x >= 0 || y < 60 || y > 100) continue;
            const float across = static_cast<float>(y) - slope * static_cast<float>(x);
            error += std::abs(layers.at<color_column>(i)[0] -
                              (128.0 + static_cast<double>(contrast) * std::sin(0.35 * static_cast<double>(across))));
            count += 1;
        }
        return error / count / static_cast<double>(contrast);
    };
    for (const float slope : {0.0F, 0.3F, -0.5F, 0.6F}) {
        CAPTURE(slope);
        CHECK(error_past_frame(slope, 100.0F) < 0.18);  // mirroring gives 0.6 for slopes of 0.3 and more
    }
    CHECK(error_past_frame(1.0F, 100.0F) < 0.5);  // mirroring gives 0.8
    CHECK(error_past_frame(0.6F, 25.0F) < 0.4);
    CHECK(error_past_frame(0.6F, 12.0F) > 0.65);
}

TEST_CASE("a thin dark rim, such as that of a scanned slide, does not continue past the frame, but a wide rim does") {
    std::mt19937 random(34);
    const auto grown_with = [&](std::int32_t rim) {
        photo_layers layers = testing::lifted_layers(image<float>(60, 80, 1, 0.3F));
        photo_facts facts = testing::facts_of(layers.topology());
        facts.motion = 0.2F;
        for (std::int32_t i = 0; i < layers.topology().count(); ++i) {
            const std::int32_t x = layers.topology().x()[i], y = layers.topology().y()[i];
            const bool in_rim = std::min({x, y, 79 - x, 59 - y}) < rim;
            for (std::uint8_t& value : layers.at<color_column>(i))
                value = in_rim ? 20 : static_cast<std::uint8_t>(100 + random() % 100);
        }
        const photo_layers before = layers;
        const std::int32_t margin = grow_past_frame(layers, facts);
        std::size_t dark = 0;
        for (std::int32_t i = 0; i < layers.topology().count(); ++i) {
            dark += layers.at<color_column>(i)[0] == 20 ? 1U : 0U;
            if (layers.column<known_column>()[i] == 0) continue;
            const std::int32_t x = layers.topology().x()[i] - margin, y = layers.topology().y()[i] - margin;
            REQUIRE(layers.at<color_column>(i)[0] == before.at<color_column>(y * 80 + x)[0]);
        }
        return dark;
    };
    CHECK(grown_with(0) == 0);
    CHECK(grown_with(3) == 0);
    CHECK(grown_with(8) == 0);
    CHECK(grown_with(12) > 80 * 60 - 56 * 36);
}

TEST_CASE("growing past the frame is refused for a negative motion and for more pixels than an index can address") {
    photo_layers layers = testing::lifted_layers(image<float>(4, 5000, 1, 0.0F));
    photo_facts facts = testing::facts_of(layers.topology());
    facts.motion = 30.0F;
    CHECK_THROWS_AS(grow_past_frame(layers, facts), error);
    for (const float motion : {-0.1F, 1e9F, std::numeric_limits<float>::infinity(), std::nanf("")}) {
        CAPTURE(motion);
        facts.motion = motion;
        layers = testing::lifted_layers(image<float>(4, 5000, 1, 0.0F));
        CHECK_THROWS_AS(grow_past_frame(layers, facts), error);
    }
    facts.motion = std::numeric_limits<float>::infinity();
    CHECK_THROWS_WITH(grow_past_frame(layers, facts), Catch::Contains("finite"));
    photo_layers none;
    CHECK(grow_past_frame(none, photo_facts()) == 0);
}

TEST_CASE("expand() and grow_past_frame() return the same layers for any number of threads") {
    for (std::uint32_t seed = 0; seed < 12; ++seed) {
        std::mt19937 random(seed);
        const image<float> disparity = any_disparity(random, 90 + random() % 30, 80 + random() % 40);
        const std::mt19937 colors = random;
        std::mt19937 again = colors;
        const grown_photo expected = grow(disparity, 0.2F, again);
        REQUIRE(expected.after.size() > expected.before.size());
        for (const std::size_t threads : {2U, 3U, 8U}) {
            thread_pool pool(threads);
            again = colors;
            const grown_photo found = grow(disparity, 0.2F, again, pool);
            REQUIRE(found.facts.margin == expected.facts.margin);
            for (const auto& [one, other] :
                 {std::pair(&found.before, &expected.before), std::pair(&found.after, &expected.after)}) {
                REQUIRE(one->topology() == other->topology());
                REQUIRE(one->column<color_column>() == other->column<color_column>());
                REQUIRE(one->column<disparity_column>() == other->column<disparity_column>());
                REQUIRE(one->column<known_column>() == other->column<known_column>());
                REQUIRE(one->column<matte_column>() == other->column<matte_column>());
            }
        }
    }
}

TEST_CASE("growing past the frame is refused for layers that have already grown, and for a photo of a different size") {
    const image<float> map(30, 40, 1, 0.5F);
    photo_layers layers = testing::lifted_layers(map);
    photo_facts facts = testing::facts_of(layers.topology());
    facts.motion = 0.1F;
    facts.camera.width = 41;
    CHECK_THROWS_AS(grow_past_frame(layers, facts), error);
    CHECK_THROWS_AS(grow_past_frame(layers, photo_facts()), error);
    facts.camera.width = 40;
    const std::size_t before = layers.size();
    const std::int32_t margin = grow_past_frame(layers, facts);
    REQUIRE((margin > 0 && layers.size() > before));
    const std::size_t grown = layers.size();
    CHECK_THROWS_AS(grow_past_frame(layers, facts), error);  // without the margin in `facts`
    facts.margin = margin;
    CHECK_THROWS_AS(grow_past_frame(layers, facts), error);
    CHECK(layers.size() == grown);
}

TEST_CASE("growing past the frame is refused for layers that are not in canonical order, and leaves them unchanged") {
    photo_layers layers = testing::lifted_layers(image<float>(30, 40, 1, 0.9F));
    photo_facts facts = testing::facts_of(layers.topology());
    facts.motion = 0.08F;
    buffer<std::int32_t> by_column, upside_down;
    for (std::int32_t x = 0; x < 40; ++x)
        for (std::int32_t y = 0; y < 30; ++y) by_column.push_back(40 * y + x);
    for (std::int32_t y = 29; y >= 0; --y)
        for (std::int32_t x = 0; x < 40; ++x) upside_down.push_back(40 * y + x);
    for (const auto& order : {by_column, upside_down}) {
        photo_layers other = layers;
        other.reorder(order);
        CHECK(testing::raised([&] { grow_past_frame(other, facts); }) == error_code::mismatch);
        CHECK(other.size() == layers.size());
    }
    CHECK(grow_past_frame(layers, facts) > 0);
}
