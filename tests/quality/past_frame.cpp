// Tests that surfaces continue far enough past the photo's border: from every position that the camera may reach, a window as
// large as the photo shows no holes.
#include <ldi/photo3d.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

namespace {

struct framed_scene {
    ldi::photo_facts facts;
    ldi::textured_mesh mesh;
};

/// Makes the geometry of a 3D photo, without colors.
framed_scene make_framed(const ldi::image<float>& disparity, ldi::photo_frame frame, float motion) {
    ldi::photo_layer lifted = ldi::testing::lift_disparity(disparity);
    const ldi::buffer<ldi::discontinuity_curve> curves = ldi::find_discontinuity_curves(lifted, {});
    ldi::close_spurious_discontinuities(lifted, curves);
    framed_scene result;
    result.facts = ldi::testing::facts_of(lifted.topology());
    auto [layers, reached] = ldi::expand(std::move(lifted), {}, curves, ldi::expand_options{.motion = motion});
    result.facts.motion = reached;
    if (frame == ldi::photo_frame::grow) result.facts.margin = ldi::grow_past_frame(layers, result.facts);
    const ldi::chart_set charts = ldi::make_charts(layers, {});
    result.mesh = ldi::build_mesh(layers, result.facts, charts, ldi::make_atlas(layers, charts));
    return result;
}

std::int64_t uncovered(const framed_scene& s, const ldi::view& from) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * s.facts.range.z_near;
    const ldi::rendering seen = ldi::rasterize(s.mesh, ldi::image<std::uint8_t>(1, 1, 3), from, raster);
    return std::count(seen.coverage.begin(), seen.coverage.end(), std::uint8_t{0});
}

/// Returns views through the window from positions within the motion and at its limit: to all sides, backwards and forwards, and
/// on all paths.
std::vector<ldi::view> windows(const ldi::photo_facts& facts) {
    std::vector<ldi::view> result;
    const auto add = [&](const std::array<float, 3>& direction, float share) {
        const float far = 0.99F * facts.range.z_near;
        std::array<float, 3> place = ldi::within_motion({far * direction[0], far * direction[1], far * direction[2]},
                                                        facts.camera, facts.range, facts.motion);
        for (float& coordinate : place) coordinate *= share;
        result.push_back(ldi::view_through_window(facts.camera, facts.range, place));
    };
    for (const float share : {1.0F, 0.6F})
        for (const float forward : {-1.0F, -0.3F, 0.0F, 0.3F, 1.0F})
            for (int i = 0; i < 8; ++i) {
                const float angle = 0.785398163F * static_cast<float>(i);
                add({std::cos(angle), std::sin(angle), -forward}, share);
            }
    add({0, 0, -1}, 1), add({0, 0, 1}, 1), add({0, 0, 0}, 1);
    ldi::path_options options;
    options.motion = facts.motion;
    for (const ldi::camera_path path :
         {ldi::camera_path::circle, ldi::camera_path::swing, ldi::camera_path::zoom_in, ldi::camera_path::dolly_zoom})
        for (const float time : {0.125F, 0.25F, 0.6F, 1.0F})
            result.push_back(ldi::view_on_path(path, facts.camera, facts.range, time, options));
    return result;
}

/// Returns the views of both eyes. Their window is at the nearest surface.
std::vector<ldi::view> eyes(const ldi::photo_facts& facts) {
    ldi::view from;
    from.camera = facts.camera;
    const float half = ldi::within_motion({0.5F * ldi::eye_distance(facts.camera, facts.range), 0, 0}, facts.camera, facts.range,
                                          facts.motion)[0];
    return {ldi::beside(from, -half, facts.range.z_near), ldi::beside(from, half, facts.range.z_near)};
}

std::int64_t max_uncovered(const framed_scene& s) {
    std::int64_t most = 0;
    for (const ldi::view& from : windows(s.facts)) most = std::max(most, uncovered(s, from));
    for (const ldi::view& from : eyes(s.facts)) most = std::max(most, uncovered(s, from));
    return most;
}

}  // namespace

TEST_CASE("no camera within the supported motion sees the end of a surface inside a window as large as the photo") {
    std::mt19937 random(52);
    for (int round = 0; round < 16; ++round) {
        const float motion = round % 4 == 0 ? 0.2F : 0.08F;
        const std::size_t rows = 90 + random() % 80, columns = 90 + random() % 80;
        const framed_scene s = make_framed(ldi::testing::random_disparity(random, rows, columns), ldi::photo_frame::grow, motion);
        CAPTURE(round, rows, columns);
        CHECK(max_uncovered(s) == 0);
        CHECK(ldi::frame_within(windows(s.facts), s.facts.camera, s.facts.range, s.facts.motion) > 0.9985F);
    }
}

TEST_CASE("in a window as large as the photo, flat and slanted photos do not show where their surfaces end") {
    for (const float d : {0.0F, 0.5F, 1.0F})
        CHECK(max_uncovered(make_framed(ldi::image<float>(100, 140, 1, d), ldi::photo_frame::grow, 0.08F)) == 0);
    ldi::image<float> slanted(120, 90);
    for (std::size_t y = 0; y < 120; ++y)
        for (std::size_t x = 0; x < 90; ++x) slanted(y, x) = static_cast<float>(y + x) / 210.0F;
    CHECK(max_uncovered(make_framed(slanted, ldi::photo_frame::grow, 0.1F)) == 0);
}

TEST_CASE("surfaces that end at the photo's border leave holes in the window, which the test detects") {
    std::mt19937 random(52);
    const framed_scene s = make_framed(ldi::testing::random_disparity(random, 100, 130), ldi::photo_frame::crop, 0.08F);
    CHECK(max_uncovered(s) > 200);
}

TEST_CASE("photos of one row or one column can grow past the frame, even for large motions") {
    for (const auto& [rows, columns] : {std::pair<std::size_t, std::size_t>{1, 60}, {60, 1}, {1, 1}, {2, 3}})
        for (const float motion : {0.08F, 1.0F}) {
            CAPTURE(rows, columns, motion);
            const framed_scene s = make_framed(ldi::image<float>(rows, columns, 1, 0.2F), ldi::photo_frame::grow, motion);
            CHECK(uncovered(s, ldi::view_through_window(s.facts.camera, s.facts.range, {0, 0, 0})) == 0);
            CHECK(s.mesh.triangle_count() > 0);
        }
}
