#include <ldi/render/gap_colors.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

using namespace ldi;

namespace {

constexpr std::int32_t width = 40, height = 20;

view straight_view() {
    view v;
    v.camera = {width, height, 40};
    return v;
}

/// Two colors: dark at texture coordinate 0.25, light at 0.75.
image<std::uint8_t> two_colors(std::uint8_t dark, std::uint8_t light) {
    image<std::uint8_t> texture(1, 2, 3, dark);
    for (std::size_t c = 0; c < 3; ++c) texture(0, 1, c) = light;
    return texture;
}

/// Appends the rectangle [x0, x1] x [y0, y1] of the screen at one depth, with one color of two_colors().
template <class Mesh>
void add_rectangle(Mesh& mesh, float x0, float x1, float y0, float y1, float depth, bool is_light) {
    const pinhole_camera camera = straight_view().camera;
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.vertex_count());
    for (const auto& [x, y] : {std::array{x0, y0}, {x0, y1}, {x1, y1}, {x1, y0}}) {
        const std::array<float, 3> p = camera.unproject(x, y, depth);
        mesh.positions.insert(mesh.positions.end(), p.begin(), p.end());
        mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), {is_light ? 0.75F : 0.25F, 0.5F});
    }
    for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.triangles.push_back(first + corner);
}

template <class Mesh>
void add_columns(Mesh& mesh, float x0, float x1, float depth, bool is_light) {
    add_rectangle(mesh, x0, x1, 0, static_cast<float>(height), depth, is_light);
}

int red(const image<std::uint8_t>& picture, std::size_t x) { return picture(height / 2, x, 0); }

}  // namespace

TEST_CASE("a gap between a near and a far surface gets the color of the far surface") {
    textured_mesh mesh;
    add_columns(mesh, 0, 15, 1, true), add_columns(mesh, 20.5F, 40, 3, false);
    add_rectangle(mesh, 15, 20.5F, 0, 3, 1, true), add_rectangle(mesh, 15, 20.5F, 17, 20, 1, true);
    const rendering seen = rasterize(mesh, two_colors(50, 200), straight_view());
    REQUIRE(has_gaps(seen));
    const image<std::uint8_t> filled = gap_colors(seen);
    for (std::size_t x = 0; x < width; ++x) CHECK(red(filled, x) == (x < 15 ? 200 : 50));
}

TEST_CASE("renderings whose images differ in shape are refused, and empty ones have no colors") {
    const rendering sound{image<std::uint8_t>(4, 6, 3), image<float>(4, 6), image<std::uint8_t>(4, 6)};
    CHECK_NOTHROW(gap_colors(sound));
    CHECK(gap_colors({}).empty());
    const auto result_of = [&](auto&& change) {
        rendering changed = sound;
        change(changed);
        return testing::raised([&] { gap_colors(std::move(changed)); });
    };
    for (const image<float>& depth : {image<float>(), image<float>(4, 5), image<float>(6, 4), image<float>(4, 6, 2)})
        CHECK(result_of([&](rendering& r) { r.depth = depth; }) == error_code::mismatch);
    for (const image<std::uint8_t>& other : {image<std::uint8_t>(), image<std::uint8_t>(5, 6), image<std::uint8_t>(4, 6, 2)}) {
        CHECK(result_of([&](rendering& r) { r.coverage = other; }) == error_code::mismatch);
        CHECK(result_of([&](rendering& r) { r.color = other; }) == error_code::mismatch);
    }
}

TEST_CASE("past the photo's border, near and far surfaces both continue") {
    textured_mesh mesh;
    add_rectangle(mesh, 10, 20, 5, 15, 1, true), add_rectangle(mesh, 20, 30, 5, 15, 3, false);
    const image<std::uint8_t> filled = gap_colors(rasterize(mesh, two_colors(50, 200), straight_view()));
    CHECK(red(filled, 9) > 180);
    CHECK(red(filled, 30) < 70);
    for (std::size_t x = 0; x < width; ++x) CHECK((red(filled, x) >= 50 && red(filled, x) <= 200));
}

TEST_CASE("a wide gap in one surface is filled smoothly") {
    textured_mesh mesh;
    add_columns(mesh, 0, 10, 2, false), add_columns(mesh, 30, 40, 2, true);
    const image<std::uint8_t> filled = gap_colors(rasterize(mesh, two_colors(50, 200), straight_view()));
    for (std::size_t x = 1; x < width; ++x) {
        const int step = red(filled, x) - red(filled, x - 1);
        CHECK((step >= 0 && step < 20));
    }
}

TEST_CASE("a picture without gaps stays unchanged, and one without surfaces is black") {
    textured_mesh mesh;
    const rendering nothing = rasterize(mesh, two_colors(50, 200), straight_view(), {.background = {9, 9, 9}});
    CHECK(gap_colors(nothing) == image<std::uint8_t>(height, width, 3, std::uint8_t{0}));
    add_columns(mesh, 0, 20, 2, false), add_columns(mesh, 20, 40, 1, true);
    const rendering seen = rasterize(mesh, two_colors(50, 200), straight_view());
    CHECK(!has_gaps(seen));
    CHECK(gap_colors(seen) == seen.color);
}

TEST_CASE("the rasterizer draws a backdrop behind everything, including partly covered pixels and soft edges") {
    textured_mesh mesh;
    add_columns(mesh, 0, 10.5F, 1, false);
    add_columns(mesh.soft_edges, 20, 30, 2, true);
    mesh.soft_edges.opacity.assign(4, 51);
    image<std::uint8_t> backdrop(height, width, 3, std::uint8_t{150});
    for (std::size_t y = 0; y < height; ++y) backdrop(y, 35, 0) = 77;
    raster_options options;
    options.samples = 2;
    options.backdrop = backdrop;
    const rendering seen = rasterize(mesh, two_colors(50, 200), straight_view(), options);
    CHECK(red(seen.color, 9) == 50);
    CHECK(red(seen.color, 10) == 100);
    CHECK(red(seen.color, 15) == 150);
    CHECK(red(seen.color, 25) == 160);
    CHECK(red(seen.color, 35) == 77);
    CHECK(seen.coverage(5, 15) == 0);

    const image<std::uint8_t> other(height, width - 1, 3);
    options.backdrop = other;
    CHECK_THROWS_AS(rasterize(mesh, two_colors(50, 200), straight_view(), options), error);
}
