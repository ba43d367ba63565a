#include <bench/quality/micro_polygons.hpp>

#include <ldi/occlusion/lift.hpp>
#include <tests/support/lifted_scene.hpp>
#include <tests/support/scene_view.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>

namespace {

using namespace ldi;
using namespace ldi_quality;
using testing::own_view, testing::scene_range;

void color_at_random(photo_layers& layers, std::mt19937& random) {
    for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(random());
}

/// A plane at disparity 1 left of column `edge`, and one at 0 right of it.
photo_layers step_at(std::size_t height, std::size_t width, std::size_t edge, float threshold) {
    image<float> disparity(height, width);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) disparity(y, x, 0) = x < edge ? 1.0F : 0.0F;
    return expand(lift(image<std::uint8_t>(height, width, 3, std::uint8_t{90}), disparity, {.surface = {threshold}}), {threshold},
                  {})
        .layers;
}

std::size_t holes_in(const rendering& picture) {
    return static_cast<std::size_t>(std::count(picture.coverage.begin(), picture.coverage.end(), std::uint8_t{0}));
}

}  // namespace

TEST_CASE("drawn from its own viewpoint, a layered image shows its first layer unchanged") {
    std::mt19937 random(3);
    for (int trial = 0; trial < 20; ++trial) {
        const std::size_t height = 8 + random() % 30, width = 8 + random() % 30;
        const image<float> disparity = testing::random_disparity(random, height, width);
        photo_layers layers = testing::lifted_layers(disparity);
        color_at_random(layers, random);
        const view v = own_view(layers.topology());
        const rendering picture = render_layers(layers, scene_range, v, v);
        REQUIRE(holes_in(picture) == 0);
        REQUIRE(std::equal(picture.color.begin(), picture.color.end(), layers.column<color_column>().begin()));
        for (std::size_t i = 0; i < disparity.size(); ++i)
            REQUIRE(picture.depth.data()[i] == Approx(scene_range.depth(disparity.data()[i])).epsilon(1e-5));
    }
}

TEST_CASE("linked pixels leave no hole, and unlinked pixels separate by their difference in parallax") {
    const photo_layers torn = step_at(20, 60, 30, 0.05F), linked = step_at(20, 60, 30, 1.0F);
    const view v = own_view(torn.topology());
    // The near plane moves 10 pixels left, the far one 2: this opens a gap of 8 columns between them, and a gap of 2 columns at
    // the far plane's border.
    const view moved = moved_view(v.camera, scene_range, 1, -10);
    CHECK(holes_in(render_layers(torn, scene_range, v, moved)) == 20 * (8 + 2));
    CHECK(holes_in(render_layers(linked, scene_range, v, moved)) == 20 * 2);
}

TEST_CASE("colors are interpolated only between linked known pixels") {
    photo_layers layers = step_at(1, 2, 2, 0.05F);
    layers.set_column<color_column>({0, 0, 0, 200, 200, 200});
    const view v = own_view(layers.topology());
    view close = v;
    close.camera = {64, 32, 32 * v.camera.focal_length};
    const rendering smooth = render_layers(layers, scene_range, v, close);
    for (std::size_t x = 0; x < 64; ++x) {
        const float expected = std::clamp((static_cast<float>(x) + 0.5F) / 32 - 0.5F, 0.0F, 1.0F) * 200;
        CHECK(std::abs(static_cast<float>(smooth.color(16, x, 0)) - expected) <= 1);
    }
    layers.edit_links([](link_editor& links) { links.unlink(0, side::right); });
    const rendering torn = render_layers(layers, scene_range, v, close);
    for (std::size_t x = 0; x < 64; ++x) CHECK(torn.color(16, x, 0) == (x < 32 ? 0 : 200));
    photo_layers unknown = step_at(1, 2, 2, 0.05F);
    unknown.set_column<color_column>({0, 0, 0, 200, 200, 200});
    unknown.set_column<known_column>({1, 0});
    CHECK((render_layers(unknown, scene_range, v, close).color == torn.color));
}

TEST_CASE("render_layers() returns the same picture on any number of threads") {
    std::mt19937 random(8);
    photo_layers layers = testing::lifted_layers(testing::random_disparity(random, 60, 50));
    color_at_random(layers, random);
    const view v = own_view(layers.topology());
    raster_options options;
    options.samples = 2;
    thread_pool threads(3);
    const view moved = moved_view(v.camera, scene_range, 1, 5, 3);
    const rendering one = render_layers(layers, scene_range, v, moved, options);
    const rendering many = render_layers(layers, scene_range, v, moved, options, threads);
    CHECK((one.color == many.color));
    CHECK((one.depth == many.depth));
    CHECK((one.coverage == many.coverage));
}

TEST_CASE("pixels behind the camera are not drawn, and mismatched views and invalid disparities are refused") {
    const photo_layers layers = step_at(4, 6, 3, 0.05F);
    const view v = own_view(layers.topology());
    view behind = v;
    behind.position = {0, 0, -20};
    CHECK(holes_in(render_layers(layers, scene_range, v, behind)) == 24);
    view between = v;
    between.position = {0, 0, -2};
    CHECK(holes_in(render_layers(layers, scene_range, v, between)) > 0);  // only the far plane is in front
    const auto code_of = [&](const photo_layers& l, const view& taken_from) {
        return testing::raised([&] { render_layers(l, scene_range, taken_from, v); });
    };
    view other = v;
    other.camera.width = 7;
    CHECK(code_of(layers, other) == error_code::mismatch);
    photo_layers broken = layers;
    broken.column<disparity_column>()[5] = -3;
    CHECK(code_of(broken, v) == error_code::invalid_data);
    broken.column<disparity_column>()[5] = std::nanf("");
    CHECK(code_of(broken, v) == error_code::invalid_data);
}
