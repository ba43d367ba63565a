#include <ldi/render/stereo.hpp>

#include <ldi/io/depth_map.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/render/camera_paths.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

using namespace ldi;

namespace {

image<std::uint8_t> random_picture(std::uint32_t seed, std::size_t rows, std::size_t columns) {
    std::mt19937 random(seed);
    image<std::uint8_t> result(rows, columns, 3);
    for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(random());
    return result;
}

}  // namespace

TEST_CASE("a side-by-side picture contains both pictures unchanged") {
    const image<std::uint8_t> left = random_picture(1, 7, 5), right = random_picture(2, 7, 5);
    const image<std::uint8_t> both = side_by_side(left, right);
    REQUIRE(both.width() == 10);
    for (std::size_t y = 0; y < 7; ++y)
        for (std::size_t x = 0; x < 5; ++x)
            for (std::size_t c = 0; c < 3; ++c) CHECK((both(y, x, c) == left(y, x, c) && both(y, x + 5, c) == right(y, x, c)));
}

TEST_CASE("the anaglyph of two equal gray pictures is that picture, and each eye sees only its own picture") {
    image<std::uint8_t> gray = random_picture(3, 9, 9);
    for (std::size_t i = 0; i < gray.size(); ++i) gray.data()[i] = gray.data()[i - i % 3];
    CHECK((anaglyph(gray, gray) == gray));
    const image<std::uint8_t> right = random_picture(4, 9, 9), black = image<std::uint8_t>(9, 9, 3, std::uint8_t{0});
    const image<std::uint8_t> for_left = anaglyph(gray, black), for_right = anaglyph(black, right);
    for (std::size_t i = 0; i < gray.size(); i += 3) {
        CHECK((for_left.data()[i] == gray.data()[i] && for_left.data()[i + 1] == 0 && for_left.data()[i + 2] == 0));
        CHECK((for_right.data()[i] == 0 && for_right.data()[i + 1] == right.data()[i + 1] &&
               for_right.data()[i + 2] == right.data()[i + 2]));
    }
}

TEST_CASE("for two eyes, the parallax between the ends of the depth range is the requested fraction of the picture's width") {
    const pinhole_camera camera{600, 400, 500};
    const depth_range range{1, 8};
    view middle;
    middle.camera = camera;
    const float distance = eye_distance(camera, range, 0.05F);
    const view left = beside(middle, -0.5F * distance), right = beside(middle, 0.5F * distance);
    const auto shift = [&](float depth) {
        const std::array<float, 3> point{0.1F, 0, -depth};
        return camera.project(left.to_camera(point))[0] - camera.project(right.to_camera(point))[0];
    };
    CHECK(shift(1) - shift(8) == Approx(0.05F * 600));
    CHECK(shift(1) > 0);  // the left eye sees near objects farther right
    view turned = middle;
    turned.rotation = {0, 0, 1, 0, 1, 0, -1, 0, 0};
    CHECK(beside(turned, 2).position[2] == Approx(-2));
}

TEST_CASE("if the camera moves sideways from any view, points at the window's distance keep their column in the picture") {
    std::mt19937 engine(5);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 200; ++trial) {
        const view from = look_at({600, 400, 500}, {any(), any(), any()}, {any(), any(), -3 + any()});
        const float distance = any(), window = 2 + any();
        const view moved = beside(from, distance, window);
        const std::array<float, 3> ray = from.direction_to_photo({window * any(), window * any(), -window});
        const std::array<float, 3> point{from.position[0] + ray[0], from.position[1] + ray[1], from.position[2] + ray[2]};
        const float before = from.camera.project(from.to_camera(point))[0] + from.lens_shift[0];
        CHECK(moved.camera.project(moved.to_camera(point))[0] + moved.lens_shift[0] == Approx(before).margin(0.01));
    }
}

TEST_CASE("a written depth map is read back with the same disparities and the same holes") {
    const depth_range range{0.7F, 9};
    image<float> depth(6, 8);
    for (std::size_t i = 0; i < depth.size(); ++i)
        depth.data()[i] = i % 5 == 0 ? std::numeric_limits<float>::infinity() : range.depth(static_cast<float>(i) / 48.0F);
    depth_map_options options;
    options.invalid_zero = true;
    const image<float> back = decode_depth_map(encode_png(disparity_map(depth, range)), options);
    for (std::size_t i = 0; i < depth.size(); ++i) {
        if (i % 5 == 0)
            CHECK(std::isnan(back.data()[i]));
        else
            CHECK((back.data()[i] - 1) / 65534 == Approx(static_cast<float>(i) / 48.0F).margin(2e-5));
    }
}

TEST_CASE("a depth map with a number of channels other than 1 is refused") {
    for (const std::size_t channels : {0U, 2U, 3U, 4U})
        CHECK(testing::raised([&] { disparity_map(image<float>(8, 8, channels, 2.0F), {}); }) == error_code::mismatch);
    CHECK(disparity_map({}, {}).empty());
}

TEST_CASE("two pictures of different sizes are refused as a stereo pair") {
    for (const bool is_anaglyph : {true, false}) {
        const image<std::uint8_t> a = random_picture(1, 4, 4), b = random_picture(1, 4, 5);
        CHECK(testing::raised([&] { is_anaglyph ? anaglyph(a, b) : side_by_side(a, b); }) == error_code::mismatch);
    }
}
