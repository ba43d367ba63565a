#include <examples/scenes/scene.hpp>

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>

#include <catch2/catch.hpp>

#include <set>
#include <string>

#ifndef LDI_SOURCE_DIR
#define LDI_SOURCE_DIR "."
#endif

using namespace ldi;
using namespace ldi::scenes;

TEST_CASE("the T-junction scene has three layers at the documented positions") {
    const std::int32_t w = 192, h = 256;
    const scene s = t_junction(w, h);
    for (std::int32_t y = 0; y < h; y += 3)
        for (std::int32_t x = 0; x < w; x += 3) {
            const double px = x + 0.5, py = y + 0.5;
            buffer<std::int32_t> expected;
            if (px < 0.4 * w) expected.push_back(0);
            if (py > 0.55 * h && px > 0.1 * w) expected.push_back(1);
            expected.push_back(2);
            const std::vector<surface> found = surfaces_at(s, px, py);
            REQUIRE(found.size() == expected.size());
            for (std::size_t i = 0; i < found.size(); ++i) {
                REQUIRE(found[i].object == expected[i]);
                REQUIRE(found[i].disparity == Approx(1 - 0.5 * expected[i]).margin(1e-6));
            }
        }
}

TEST_CASE("a sideways move shifts the T-junction's foreground by the requested number of pixels") {
    const scene s = t_junction();
    picture_options quick;
    quick.samples = 1;
    const picture moved = render(s, moved_view(s.camera, s.range, 1, 40), quick);
    // The foreground's edge moves from 76.8 by 40 pixels; the midground, at 1.6 times the depth, by 25.
    for (std::size_t x = 0; x < 192; ++x) {
        CHECK(moved.object(200, x, 0) == (x <= 116 ? 0 : 1));
        CHECK(moved.object(20, x, 0) == (x <= 116 ? 0 : 2));
    }
}

TEST_CASE("scenes fill the frame, and their disparities range from 0 to 1") {
    picture_options quick;
    quick.samples = 1;
    for (const char* name : {"t_junction", "still_life", "rods", "random0", "random1", "random2", "random17"}) {
        const scene s = scene_by_name(name, 72, 96);
        const picture photo = render(s, quick);
        const auto [least, most] = std::minmax_element(photo.disparity.begin(), photo.disparity.end());
        CHECK(*least == Approx(0).margin(1e-6));
        CHECK(*most == Approx(1).margin(1e-6));
        const std::set<std::int32_t> objects(photo.object.begin(), photo.object.end());
        CHECK(objects.count(-1) == 0);
        CHECK(objects.size() >= 2);
    }
}

TEST_CASE("unknown scene names are refused") {
    for (const std::string name : {"", "random", "random-1", "randomx", "random123456789", "house"})
        CHECK_THROWS_AS(scene_by_name(name, 8, 8), error);
}

TEST_CASE("the shipped sample photo and its depth map show the still life") {
    const std::string folder = std::string(LDI_SOURCE_DIR) + "/examples/photo3d/";
    const photo shipped = load_photo(folder + "sample.jpg");
    depth_map_options options;
    options.scale = 1.0F / 65535;
    const image<float> depth_map = load_depth_map(folder + "sample_depth.png", options);
    REQUIRE((shipped.color.width() == 1152 && shipped.color.height() == 1536));
    REQUIRE((depth_map.width() == 1152 && depth_map.height() == 1536));
    const scene s = still_life();
    view from;
    from.camera = s.camera;
    double difference = 0;
    int count = 0;
    for (std::size_t y = 0; y < 1536; y += 23)
        for (std::size_t x = 0; x < 1152; x += 23) {
            const ldi::scenes::detail::hit hit = ldi::scenes::detail::first_hit(
                s, ldi::scenes::detail::primary_ray(from, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5), 0);
            REQUIRE(depth_map(y, x, 0) == Approx(disparity(s.range, hit.distance)).margin(0.6 / 4095));
            if (x % 46 != 0 || y % 46 != 0) continue;
            picture_options coarse;
            const std::array<std::uint8_t, 3> color = ldi::scenes::detail::mixed_color(s, from, x, y, coarse);
            for (std::size_t c = 0; c < 3; ++c, ++count) difference += std::abs(color[c] - shipped.color(y, x, c));
        }
    // The shipped photo has 64 samples per pixel instead of 16, and is a JPEG file.
    CHECK(difference / count < 6);
}
