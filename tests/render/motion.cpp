#include <ldi/render/motion.hpp>

#include <ldi/render/camera.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace ldi;

namespace {

const pinhole_camera photo_camera{300, 400, 350};
const depth_range photo_range{1.5F, 12};

/// Returns the width of the strip of the background at `depth_behind` that becomes visible when the camera moves to `position`,
/// in pixels of the photo. The foreground, at `depth_in_front`, has its edge at (x, y) in the photo.
float uncovered(const std::array<float, 3>& position, float x, float y, float depth_in_front, float depth_behind) {
    const std::array<float, 3> edge = photo_camera.unproject(x, y, depth_in_front);
    const float t = (-depth_behind - position[2]) / (edge[2] - position[2]);  // on the ray from the camera through the edge
    const std::array<float, 2> behind = photo_camera.project(
        {position[0] + t * (edge[0] - position[0]), position[1] + t * (edge[1] - position[1]), -depth_behind});
    return std::hypot(behind[0] - x, behind[1] - y);
}

}  // namespace

TEST_CASE(
    "motion_of() is an upper bound of the width that a camera position uncovers, and is exact unless the camera moves back") {
    std::mt19937 engine(7);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 300; ++trial) {
        const std::array<float, 3> position{0.2F * any(), 0.2F * any(), 0.5F * any()};
        const float allowed = motion_of(position, photo_camera, photo_range) * 400;
        float most = 0;
        for (const float x : {0.0F, 300.0F})
            for (const float y : {0.0F, 400.0F})
                most = std::max(most, uncovered(position, x, y, photo_range.z_near, photo_range.z_far));
        for (int i = 0; i < 30; ++i) {
            const float a = std::abs(any()), b = a * std::abs(any());
            const float found =
                uncovered(position, 150 + 150 * any(), 200 + 200 * any(), photo_range.depth(a), photo_range.depth(b));
            REQUIRE(found <= allowed * (a - b) * 1.0001F + 1e-3F);  // in proportion to the step of disparity
        }
        if (position[2] <= 0) REQUIRE(most == Approx(allowed).epsilon(1e-3));
    }
}

TEST_CASE("within_motion() moves a position back toward the photo's viewpoint until its motion is allowed") {
    std::mt19937 engine(8);
    const auto any = [&] { return static_cast<float>(engine()) * 0x1.0p-31F - 1; };
    for (int trial = 0; trial < 300; ++trial) {
        const std::array<float, 3> position{any(), any(), 2 * any()};
        const std::array<float, 3> kept = within_motion(position, photo_camera, photo_range, 0.08F);
        REQUIRE(motion_of(kept, photo_camera, photo_range) <= 0.08F * 1.0001F);
        const float share = kept[0] / position[0];
        REQUIRE(share <= 1);
        for (std::size_t i = 0; i < 3; ++i) REQUIRE(kept[i] == Approx(share * position[i]).margin(1e-6));
        if (share < 1) REQUIRE(motion_of(kept, photo_camera, photo_range) == Approx(0.08F));
    }
    CHECK(within_motion({0, 0, 0}, photo_camera, photo_range, 0) == std::array<float, 3>{0, 0, 0});
    CHECK(std::isinf(motion_of({0, 0, -1.5F}, photo_camera, photo_range)));
    for (const float motion : {0.0F, 0.08F}) {
        const std::array<float, 3> before_a_wall = within_motion({0.1F, 0, -5}, photo_camera, {1.5F, 1.5F}, motion);
        CHECK(before_a_wall[2] > -1.5F);
        CHECK(motion_of(before_a_wall, photo_camera, {1.5F, 1.5F}) == 0);
    }
}
