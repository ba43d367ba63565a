#include <ldi/render/camera.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace ldi;

TEST_CASE("a moved view shifts points at the given disparity by the given number of pixels, and farther points less") {
    const pinhole_camera camera{300, 400, 350};
    const depth_range range{1.5F, 12};
    for (const float disparity : {1.0F, 0.6F, 0.0F}) {
        const view moved = moved_view(camera, range, disparity, 40, -15);
        const float depth = range.depth(disparity);
        const std::array<float, 2> seen = camera.project(moved.to_camera(camera.unproject(120, 250, depth)));
        CHECK(seen[0] == Approx(160).epsilon(1e-5));
        CHECK(seen[1] == Approx(235).epsilon(1e-5));
        const std::array<float, 2> farther = camera.project(moved.to_camera(camera.unproject(120, 250, 2 * depth)));
        CHECK(farther[0] == Approx(140).epsilon(1e-5));
    }
}

TEST_CASE("to_camera() inverts direction_to_photo() for a rotated view") {
    std::mt19937 engine(4);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 200; ++trial) {
        const float a = 3 * any(), b = 3 * any(), c = std::cos(a), s = std::sin(a), k = std::cos(b), t = std::sin(b);
        view v;
        v.position = {any(), any(), any()};
        v.rotation = {c, s * t, s * k, 0, k, -t, -s, c * t, c * k};
        const std::array<float, 3> local{any(), any(), any()};
        std::array<float, 3> point = v.direction_to_photo(local);
        for (std::size_t i = 0; i < 3; ++i) point[i] += v.position[i];
        const std::array<float, 3> back = v.to_camera(point);
        for (std::size_t i = 0; i < 3; ++i) CHECK(back[i] == Approx(local[i]).margin(1e-5));
    }
}
