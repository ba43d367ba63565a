#include <ldi/render/camera_paths.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace ldi;

namespace {

const pinhole_camera camera{300, 400, 350};
const depth_range range{1.5F, 12};
const float focus = range.depth(0.5F);

void check_same(const view& a, const view& b) {
    CHECK(a.camera.focal_length == Approx(b.camera.focal_length).epsilon(1e-5));
    for (std::size_t i = 0; i < 3; ++i) CHECK(a.position[i] == Approx(b.position[i]).margin(1e-5));
    for (std::size_t i = 0; i < 9; ++i) CHECK(a.rotation[i] == Approx(b.rotation[i]).margin(1e-5));
}

view photo_view() {
    view v;
    v.camera = camera;
    return v;
}

std::array<float, 2> seen(const view& v, const std::array<float, 3>& point) {
    const std::array<float, 2> at = v.camera.project(v.to_camera(point));
    return {at[0] + v.lens_shift[0], at[1] + v.lens_shift[1]};
}

}  // namespace

TEST_CASE("swing, zoom and dolly zoom start at the photo's view, and circle and swing end where they start") {
    const auto at = [](camera_path path, float time) { return view_on_path(path, camera, range, time); };
    check_same(at(camera_path::swing, 0), photo_view());
    check_same(at(camera_path::swing, 0.5F), photo_view());
    check_same(at(camera_path::swing, 1), photo_view());
    check_same(at(camera_path::circle, 0), at(camera_path::circle, 1));
    check_same(at(camera_path::zoom_in, 0), photo_view());
    check_same(at(camera_path::dolly_zoom, 0), photo_view());
    CHECK(at(camera_path::swing, 0.25F).position[0] > 0);
    CHECK(at(camera_path::swing, 0.75F).position[0] == Approx(-at(camera_path::swing, 0.25F).position[0]));
    CHECK(motion_of(at(camera_path::zoom_in, 1).position, camera, range) == Approx(0.08F));
    path_options far;
    far.motion = 1;
    CHECK(view_on_path(camera_path::zoom_in, camera, range, 1, far).position[2] == Approx(-0.3F * range.z_near));
    CHECK(at(camera_path::zoom_in, 1).camera.focal_length == Approx(camera.focal_length));
}

TEST_CASE("on every path, the point in focus stays in the middle of the picture") {
    for (const camera_path path : {camera_path::circle, camera_path::swing, camera_path::zoom_in, camera_path::dolly_zoom})
        for (float time = 0; time <= 1; time += 0.1F) {
            const std::array<float, 2> middle = seen(view_on_path(path, camera, range, time), {0, 0, -focus});
            CHECK(middle[0] == Approx(150).margin(0.01));
            CHECK(middle[1] == Approx(200).margin(0.01));
        }
}

TEST_CASE("on a path, the largest parallax between the nearest and the farthest surface equals the requested motion") {
    path_options options;
    options.motion = 0.05F;
    float largest = 0;
    for (float time = 0; time < 1; time += 0.02F) {
        const view v = view_on_path(camera_path::circle, camera, range, time, options);
        const std::array<float, 2> nearest = seen(v, {0, 0, -range.z_near}), farthest = seen(v, {0, 0, -range.z_far});
        largest = std::max(largest, std::hypot(nearest[0] - farthest[0], nearest[1] - farthest[1]));
        CHECK(std::hypot(v.position[0], v.position[1]) > 0);
    }
    CHECK(largest == Approx(0.05F * 400).epsilon(0.03));
}

TEST_CASE("a circle starts at the right, and turns clockwise for a viewer: down, left, up") {
    const auto at = [](float time) { return view_on_path(camera_path::circle, camera, range, time).position; };
    const float radius = at(0)[0];
    CHECK(radius > 0);
    for (float time = 0; time < 1; time += 0.1F) {
        CHECK(at(time)[0] == Approx(radius * std::cos(6.2831853F * time)).margin(1e-5));
        CHECK(at(time)[1] == Approx(-radius * std::sin(6.2831853F * time)).margin(1e-5));  // the photo's y axis points up
    }
}

TEST_CASE("during a dolly zoom, objects in focus keep their size while the background becomes smaller") {
    const view end = view_on_path(camera_path::dolly_zoom, camera, range, 1);
    CHECK(seen(end, {0.5F, 0, -focus})[0] == Approx(seen(photo_view(), {0.5F, 0, -focus})[0]));
    CHECK(seen(end, {0.5F, 0, -range.z_far})[0] < seen(photo_view(), {0.5F, 0, -range.z_far})[0]);
    CHECK(seen(end, {0.2F, 0, -range.z_near})[0] > seen(photo_view(), {0.2F, 0, -range.z_near})[0]);
}

TEST_CASE("a path through custom key frames is smooth, and stands still before the first and after the last of them") {
    const std::vector<key_frame> keys{{0, {0, 0, 0}, {0, 0, -3}, 1},
                                      {0.3F, {0.2F, 0.1F, -0.1F}, {0.1F, 0, -3}, 1.5F},
                                      {0.5F, {-0.2F, 0.3F, 0.1F}, {0, 0.2F, -2}, 0.8F},
                                      {1, {0, 0, 0.2F}, {0, 0, -3}, 1}};
    for (const key_frame& key : keys) {
        view expected = look_at(camera, key.position, key.target);
        expected.camera.focal_length = camera.focal_length * key.zoom;
        check_same(view_between(keys, camera, key.time), expected);
    }
    check_same(view_between(keys, camera, -1), view_between(keys, camera, 0));
    check_same(view_between(keys, camera, 2), view_between(keys, camera, 1));
    for (float time = 0.01F; time < 0.98F; time += 0.01F) {  // no jump in position or speed
        const auto x = [&](float t) { return view_between(keys, camera, t).position[0]; };
        CHECK(std::abs(x(time + 0.002F) - 2 * x(time + 0.001F) + x(time)) < 1e-4F);
    }
    check_same(view_between(std::vector<key_frame>{keys[1]}, camera, 0.7F), view_between(keys, camera, 0.3F));
}

TEST_CASE("look_at() returns an upright camera that sees the point in the middle of its picture") {
    std::mt19937 engine(4);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 200; ++trial) {
        const std::array<float, 3> position{any(), any(), any()}, target{any(), any(), -3 + any()};
        const view v = look_at(camera, position, target);
        const std::array<float, 2> middle = seen(v, target);
        CHECK(middle[0] == Approx(150).margin(0.01));
        CHECK(middle[1] == Approx(200).margin(0.01));
        CHECK(v.rotation[3] == Approx(0).margin(1e-6));  // the picture's horizontal axis is level
        const std::array<float, 3> up = v.direction_to_photo({0, 1, 0});
        CHECK(up[1] > 0);
    }
}

TEST_CASE("if cropped to the size that frame_within() returns, no view on a path sees past the photo's border") {
    std::vector<view> views;
    for (float time = 0; time < 1; time += 0.05F) views.push_back(view_on_path(camera_path::circle, camera, range, time));
    const float size = frame_within(views, camera, range);
    CHECK(size > 0.8F);
    CHECK(size < 0.97F);
    std::mt19937 engine(9);
    const auto share = [&] { return static_cast<float>(engine()) * 0x1.0p-32F; };
    for (int trial = 0; trial < 2000; ++trial) {
        const view v = framed(views[engine() % views.size()], size);
        const float depth = range.depth(share());
        const std::array<float, 3> ray =
            v.direction_to_photo(v.camera.unproject(300 * share() - v.lens_shift[0], 400 * share() - v.lens_shift[1], 1));
        const float scale = (-depth - v.position[2]) / ray[2];
        const std::array<float, 2> photo =
            camera.project({v.position[0] + scale * ray[0], v.position[1] + scale * ray[1], -depth});
        CHECK((photo[0] > -1 && photo[0] < 301 && photo[1] > -1 && photo[1] < 401));
    }
    CHECK(frame_within(std::vector<view>{photo_view()}, camera, range) == 1);
    CHECK(frame_within({}, camera, range) == 1);
}

TEST_CASE("through a window, points at the window's disparity stay in place from any position") {
    std::mt19937 engine(12);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 200; ++trial) {
        const float window = 0.5F + 0.5F * any();
        const view v = view_through_window(camera, range, {0.4F * any(), 0.4F * any(), 0.9F * any()}, window);
        for (const float x : {0.0F, 150.0F, 300.0F})
            for (const float y : {0.0F, 200.0F, 400.0F}) {
                const std::array<float, 2> at = seen(v, camera.unproject(x, y, range.depth(window)));
                CHECK(at[0] == Approx(x).margin(0.01));
                CHECK(at[1] == Approx(y).margin(0.01));
            }
    }
}

TEST_CASE("if surfaces continue past the border, a frame as large as the photo suffices for every named path") {
    for (const camera_path path : {camera_path::circle, camera_path::swing, camera_path::zoom_in, camera_path::dolly_zoom}) {
        std::vector<view> views;
        for (float time = 0; time <= 1; time += 0.05F) views.push_back(view_on_path(path, camera, range, time));
        CHECK(frame_within(views, camera, range, 0.08F) == 1);
        CHECK(frame_within(views, camera, range, 0.04F) <= frame_within(views, camera, range, 0.08F));
    }
}

TEST_CASE("path options and key frames out of range are refused") {
    path_options options;
    options.approach = 1;
    CHECK(testing::raised([&] { view_on_path(camera_path::zoom_in, camera, range, 0, options); }) == error_code::invalid_option);
    CHECK(testing::raised([&] { view_between({}, camera, 0); }) == error_code::invalid_option);
    std::vector<key_frame> keys(2);
    CHECK(testing::raised([&] { view_between(keys, camera, 0); }) == error_code::invalid_option);
    for (const float zoom : {0.0F, std::nanf(""), std::numeric_limits<float>::infinity()}) {
        keys[1].time = 1, keys[1].zoom = zoom;
        CHECK(testing::raised([&] { view_between(keys, camera, 0); }) == error_code::invalid_option);
    }
    for (const float time : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
        const key_frame alone{time, {0, 0, 0}, {0, 0, -1}};
        CHECK(testing::raised([&] { view_between({&alone, 1}, camera, 0); }) == error_code::invalid_option);
    }
}

TEST_CASE("a path is refused at times when the camera would look straight up or down, or at its own position") {
    const auto result_at = [](float time, const std::array<float, 3>& target) {
        const std::vector<key_frame> keys{{0, {1, 0, 0}, {0, 0, 0}}, {1, {-1, 0, 0}, target}};
        return testing::raised([&] { view_between(keys, camera, time); });
    };
    for (const float y : {-5.0F, 0.0F, 5.0F}) {
        CHECK(result_at(0.5F, {0, y, 0}) == error_code::invalid_option);
        for (const float time : {0.0F, 0.25F, 0.49F, 0.51F, 1.0F}) CHECK_FALSE(result_at(time, {0, y, 0}));
        CHECK_FALSE(result_at(0.5F, {0, y, -1}));
    }
    CHECK(result_at(1, {-1, -2, 0}) == error_code::invalid_option);  // at a key frame itself
    for (const float value : {std::nanf(""), std::numeric_limits<float>::infinity()})
        CHECK(result_at(1, {0, value, -1}) == error_code::invalid_option);
    CHECK(result_at(std::nanf(""), {0, 0, -1}) == error_code::invalid_option);
}
