#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <random>

namespace {

ldi::photo_layers random_unknown(std::mt19937& random, bool colored) {
    ldi::photo_layer lifted =
        ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 10 + random() % 60, 10 + random() % 60));
    if (colored)
        for (std::uint8_t& value : lifted.column<ldi::color_column>()) value = static_cast<std::uint8_t>(60 + random() % 100);
    ldi::curve_options curve_options;
    curve_options.min_length = 3;
    const auto curves = ldi::find_discontinuity_curves(lifted, {}, curve_options);
    return ldi::expand(std::move(lifted), {}, std::span<const ldi::discontinuity_curve>(curves), {.motion = 0.5F}).layers;
}

}  // namespace

TEST_CASE("diffusion keeps known colors, stays within their range, and continues a uniform color exactly") {
    std::mt19937 random(1);
    ldi::serial_executor serial;
    for (int round = 0; round < 60; ++round) {
        ldi::photo_layers layers = random_unknown(random, false);
        ldi::diffusion_inpainter().inpaint(layers, {}, serial);
        for (std::uint8_t value : layers.column<ldi::color_column>()) REQUIRE(value == 100);
        layers = random_unknown(random, true);
        const ldi::photo_layers before = layers;
        ldi::diffusion_inpainter().inpaint(layers, {}, serial);
        REQUIRE((layers.column<ldi::known_column>() == before.column<ldi::known_column>()));
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            const bool known = layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] != 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const std::uint8_t value = layers.at<ldi::color_column>(i)[c];
                if (known)
                    REQUIRE(value == before.at<ldi::color_column>(i)[c]);
                else
                    REQUIRE((value >= 60 && value < 160));
            }
        }
    }
}

TEST_CASE("diffusion continues a color ramp across a gap") {
    ldi::photo_layers layers(ldi::make_grid(100, 40));
    for (std::int32_t i = 0; i < 4000; ++i) {
        const std::int32_t x = i % 100;
        layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] = x < 20 || x >= 80 ? 1 : 0;
        if (x < 20 || x >= 80)
            for (std::uint8_t& value : layers.at<ldi::color_column>(i)) value = static_cast<std::uint8_t>(50 + x);
    }
    ldi::serial_executor serial;
    ldi::diffusion_inpainter inpainter;
    inpainter.inpaint(layers, {}, serial);
    for (std::int32_t i = 0; i < 4000; ++i) REQUIRE(std::abs(layers.at<ldi::color_column>(i)[0] - (50 + i % 100)) <= 4);
}

TEST_CASE("diffusion does not carry color across silhouettes") {
    ldi::image<float> map(60, 80);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 80; ++x) map(y, x, 0) = x < 40 ? 0.2F : 0.8F;
    ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    for (std::size_t i = 0; i < lifted.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            lifted.column<ldi::color_column>()[3 * i + c] = lifted.topology().x()[i] < 40 ? 30 : 220;
    const auto curves = ldi::find_discontinuity_curves(lifted, {});
    ldi::photo_layers layers =
        ldi::expand(std::move(lifted), {}, std::span<const ldi::discontinuity_curve>(curves), {.motion = 0.5F}).layers;
    ldi::serial_executor serial;
    ldi::diffusion_inpainter().inpaint(layers, {}, serial);
    for (std::size_t i = 0; i < layers.size(); ++i)
        REQUIRE(layers.column<ldi::color_column>()[3 * i] == (layers.column<ldi::disparity_column>()[i] < 0.5F ? 30 : 220));
}

TEST_CASE("diffusion refuses unknown pixels that are not in canonical order") {
    ldi::photo_layers layers(ldi::make_grid(8, 8));
    for (std::int32_t i = 0; i < 64; ++i) layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] = i % 8 < 2 ? 1 : 0;
    REQUIRE_NOTHROW(ldi::diffusion_inpainter().inpaint(layers));
    ldi::buffer<std::int32_t> reversed(64);
    for (std::int32_t i = 0; i < 64; ++i) reversed[i] = 63 - i;
    layers.reorder(reversed);
    CHECK_THROWS_WITH(ldi::diffusion_inpainter().inpaint(layers), Catch::Contains("canonical order"));
}
