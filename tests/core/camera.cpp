#include <ldi/core/camera.hpp>
#include <ldi/core/photo_facts.hpp>

#include <catch2/catch.hpp>

#include <random>

using namespace ldi;

namespace {
constexpr pinhole_camera phone{1152, 1536, 1200.0F};
}

TEST_CASE("the center of the photo lies on the optical axis") {
    const std::array<float, 3> point = phone.unproject(576.0F, 768.0F, 2.0F);
    CHECK(point == std::array<float, 3>{0.0F, 0.0F, -2.0F});
}

TEST_CASE("x points right, y up, and the camera looks along -z") {
    const std::array<float, 3> top_left = phone.unproject(0.0F, 0.0F, 1.0F);
    CHECK(top_left[0] < 0);
    CHECK(top_left[1] > 0);
    CHECK(top_left[2] < 0);
    const std::array<float, 3> bottom_right = phone.unproject(1152.0F, 1536.0F, 1.0F);
    CHECK(bottom_right[0] == -top_left[0]);
    CHECK(bottom_right[1] == -top_left[1]);
}

TEST_CASE("project() inverts unproject(), and depth is measured along the optical axis") {
    std::mt19937 random(70);
    for (int repeat = 0; repeat < 1000; ++repeat) {
        const auto uniform = [&](float low, float high) {
            return low + (high - low) * static_cast<float>(random() >> 8) / 16777216.0F;
        };
        const float x = uniform(0, 1152), y = uniform(0, 1536), depth = uniform(0.1F, 100.0F);
        const std::array<float, 3> point = phone.unproject(x, y, depth);
        REQUIRE(-point[2] == depth);
        const std::array<float, 2> seen = phone.project(point);
        REQUIRE(seen[0] == Approx(x).margin(1e-3));
        REQUIRE(seen[1] == Approx(y).margin(1e-3));
    }
}

TEST_CASE("the camera of a layered image includes the margin, and a negative or huge margin is refused") {
    photo_facts facts;
    facts.camera = {640, 480, 500.0F};
    facts.margin = 10;
    CHECK((facts.layers_camera().width == 660 && facts.layers_camera().height == 500));
    CHECK(facts.layers_camera().focal_length == 500.0F);
    for (const std::int32_t margin : {-1, (1 << 29) + 1, 0x7FFFFFFF}) {
        facts.margin = margin;
        CHECK_THROWS_AS(facts.layers_camera(), error);
    }
    facts.margin = 1;
    for (const pinhole_camera& camera : {pinhole_camera{0x7FFFFFFF, 480, 500.0F}, pinhole_camera{640, 0x7FFFFFFE, 500.0F}}) {
        facts.camera = camera;
        CHECK_THROWS_AS(facts.layers_camera(), error);
    }
}

TEST_CASE("a 35 mm equivalent focal length is multiplied by the ratio of the diagonals") {
    CHECK(focal_length_from_35mm(std::hypot(36.0F, 24.0F), 300, 400) == Approx(500.0F));
    CHECK(focal_length_from_35mm(26.0F, 4032, 3024) == Approx(focal_length_from_35mm(26.0F, 3024, 4032)));
    CHECK(focal_length_from_35mm(28.0F, 3600, 2400) == Approx(2800.0F));
}

TEST_CASE("a field of view spans the longer side") {
    CHECK(focal_length_from_field_of_view(90.0F, 600, 800) == Approx(400.0F));
    CHECK(focal_length_from_field_of_view(90.0F, 800, 600) == Approx(400.0F));
    const pinhole_camera camera{800, 600, focal_length_from_field_of_view(60.0F, 800, 600)};
    const std::array<float, 3> edge = camera.unproject(800.0F, 300.0F, 1.0F);
    CHECK(std::atan(edge[0]) == Approx(30.0F * 3.14159265F / 180.0F));
}

TEST_CASE("disparity 1 is the nearest depth, disparity 0 is the farthest, and inverse depth is linear in between") {
    const depth_range range{0.5F, 20.0F};
    CHECK(range.depth(1.0F) == Approx(0.5F));
    CHECK(range.depth(0.0F) == Approx(20.0F));
    float last = 1.0F / range.depth(0.0F);
    const float step = 1.0F / range.depth(0.125F) - last;
    CHECK(step > 0);
    for (int i = 1; i <= 8; ++i) {
        const float inverse = 1.0F / range.depth(0.125F * static_cast<float>(i));
        CHECK(inverse - last == Approx(step).epsilon(1e-4));
        last = inverse;
    }
}
