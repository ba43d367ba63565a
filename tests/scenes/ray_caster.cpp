#include <examples/scenes/scene.hpp>

#include <catch2/catch.hpp>

#include <limits>
#include <map>
#include <random>

using namespace ldi;
using namespace ldi::scenes;

namespace {

picture_options quick() {
    picture_options options;
    options.samples = 1;
    return options;
}

vector3 direction_through(const pinhole_camera& camera, double x, double y) {
    const double f = static_cast<double>(camera.focal_length);
    return {(x - 0.5 * camera.width) / f, (0.5 * camera.height - y) / f, -1};
}

}  // namespace

TEST_CASE("surfaces_at() returns all surfaces along a pixel's line of sight, nearest first") {
    std::mt19937 engine(1);
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
        const scene s = random_scene(seed);
        for (int trial = 0; trial < 60; ++trial) {
            const double x = static_cast<double>(engine() % 9600) * 0.01, y = static_cast<double>(engine() % 12800) * 0.01;
            const std::vector<surface> found = surfaces_at(s, x, y);
            std::multimap<double, std::int32_t> expected;
            const ray r{{0, 0, 0}, direction_through(s.camera, x, y)};
            for (std::size_t i = 0; i < s.objects.size(); ++i) {
                const crossings c = intersect(s.objects[i].form, r);
                for (int k = 0; k < c.count; ++k)
                    if (c.distance[static_cast<std::size_t>(k)] > 0)
                        expected.emplace(c.distance[static_cast<std::size_t>(k)], static_cast<std::int32_t>(i));
            }
            REQUIRE(found.size() == expected.size());
            auto next = expected.begin();
            for (const surface& each : found) {
                REQUIRE(each.depth == Approx(next->first));
                REQUIRE(each.object == next->second);
                REQUIRE(s.range.depth(each.disparity) == Approx(each.depth).epsilon(1e-4));
                ++next;
            }
        }
    }
}

TEST_CASE("a picture's depth, disparity and object are those of the first surface behind each pixel's center") {
    for (std::uint32_t seed = 0; seed < 10; ++seed) {
        const scene s = random_scene(seed, 48, 64);
        const picture photo = render(s, quick());
        float least = 2, most = -2;
        for (std::size_t y = 0; y < 64; ++y)
            for (std::size_t x = 0; x < 48; ++x) {
                const surface first = surfaces_at(s, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5).at(0);
                REQUIRE(photo.object(y, x, 0) == first.object);
                REQUIRE(photo.depth(y, x, 0) == static_cast<float>(first.depth));
                REQUIRE(photo.disparity(y, x, 0) == first.disparity);
                least = std::min(least, first.disparity), most = std::max(most, first.disparity);
            }
        CHECK(least == Approx(0).margin(1e-6));
        CHECK(most == Approx(1).margin(1e-6));
    }
}

TEST_CASE("the disparity of a plane is affine in the pixel's position") {
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        scene s = random_scene(seed);
        s.objects.resize(1);
        fit_depth_range(s);
        const picture photo = render(s, quick());
        const auto& d = photo.disparity;
        const double origin = static_cast<double>(d(0, 0, 0));
        const double per_x = (static_cast<double>(d(0, 95, 0)) - origin) / 95,
                     per_y = (static_cast<double>(d(127, 0, 0)) - origin) / 127;
        REQUIRE(std::abs(per_x) + std::abs(per_y) > 1e-4);
        for (std::size_t y = 0; y < 128; ++y)
            for (std::size_t x = 0; x < 96; ++x)
                REQUIRE(static_cast<double>(d(y, x, 0)) ==
                        Approx(origin + per_x * static_cast<double>(x) + per_y * static_cast<double>(y)).margin(1e-5));
    }
}

TEST_CASE("at a silhouette, colors are mixed and disparities are not") {
    scene s;
    s.camera = {40, 30, 40};
    s.range = {1, 2};
    s.light.sky = s.light.ground = {1, 1, 1};
    // The near rectangle ends at x = 20.5, in the middle of a pixel.
    s.add(make_rectangle({{-10 + 0.5 / 40, 0, -1}}, 20, 20), plain({0.5, 0, 0}));
    s.add(make_rectangle({{0, 0, -2}}, 20, 20), plain({0, 0, 0.5}));
    picture_options options;
    options.samples = 16;
    const picture photo = render(s, options);
    const std::array<std::uint8_t, 3> pure = scenes::detail::to_bytes({0.5, 0, 0}),
                                      half = scenes::detail::to_bytes({0.25, 0, 0.25});
    for (std::size_t y = 0; y < 30; ++y) {
        for (std::size_t x = 0; x < 40; ++x) {
            CHECK(photo.disparity(y, x, 0) == (x <= (photo.object(y, 20, 0) == 0 ? 20U : 19U) ? 1.0F : 0.0F));
            const bool mixed = x == 20;
            if (mixed) CHECK((photo.color(y, x, 0) > 0 && photo.color(y, x, 2) > 0));
            if (!mixed) CHECK((photo.color(y, x, 0) == (x < 20 ? pure[0] : 0) && photo.color(y, x, 2) == (x < 20 ? 0 : pure[0])));
        }
        CHECK(std::abs(photo.color(y, 20, 0) - half[0]) <= 6);
        CHECK(std::abs(photo.color(y, 20, 2) - half[2]) <= 6);
    }
}

TEST_CASE("depth is infinite where there is no surface") {
    scene s;
    s.camera = {8, 8, 8};
    s.range = {1, 2};
    s.add(make_rectangle({{-1, 0, -1}}, 2, 4), plain({0.5, 0.5, 0.5}));
    const picture photo = render(s, quick());
    CHECK(photo.object(4, 2, 0) == 0);
    CHECK(photo.object(4, 6, 0) == -1);
    CHECK(std::isinf(photo.depth(4, 6, 0)));
    CHECK(photo.disparity(4, 6, 0) == -std::numeric_limits<float>::infinity());
    CHECK(surfaces_at(s, 6.5, 4.5).empty());
}

TEST_CASE("a view from another position shows points on the scene's surfaces at the right depth") {
    for (std::uint32_t seed = 0; seed < 8; ++seed) {
        const scene s = random_scene(seed, 48, 64);
        view moved = moved_view(s.camera, s.range, 1, 9, -4);
        const float c = 0.995F, k = std::sqrt(1 - c * c);
        moved.rotation = {c, 0, k, 0, 1, 0, -k, 0, c};
        const picture seen = render(s, moved, quick());
        for (std::size_t y = 0; y < 64; ++y)
            for (std::size_t x = 0; x < 48; ++x) {
                if (seen.object(y, x, 0) < 0) continue;
                const std::array<float, 3> local =
                    s.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, seen.depth(y, x, 0));
                const std::array<float, 3> d = moved.direction_to_photo(local);
                const vector3 p{static_cast<double>(moved.position[0] + d[0]), static_cast<double>(moved.position[1] + d[1]),
                                static_cast<double>(moved.position[2] + d[2])};
                // The point lies on a surface: the line from the photo's camera to it crosses the object there.
                const crossings at = intersect(s.objects[static_cast<std::size_t>(seen.object(y, x, 0))].form, {{}, p});
                double nearest = 1;
                for (int i = 0; i < at.count; ++i)
                    nearest = std::min(nearest, std::abs(at.distance[static_cast<std::size_t>(i)] - 1));
                // At a grazing angle, float rounding moves or loses the crossing.
                const surface_description surface = describe(s.objects[static_cast<std::size_t>(seen.object(y, x, 0))].form, p);
                if (std::abs(dot(surface.normal, normalized(p))) > 0.1) CHECK(nearest < 1e-4);
            }
    }
}

TEST_CASE("pictures do not depend on the number of threads") {
    const scene s = still_life(36, 48);
    view photo;
    photo.camera = s.camera;
    const picture serial = render(s, photo, quick());
    thread_pool pool(3);
    const picture parallel = render(s, photo, quick(), pool);
    CHECK(parallel.color == serial.color);
    CHECK(parallel.disparity == serial.disparity);
}

TEST_CASE("shadows darken surfaces that the sun does not reach") {
    scene s;
    s.camera = {40, 40, 40};
    s.range = {1, 3};
    s.add(make_rectangle({{0, 0, -3}}, 20, 20), plain({0.5, 0.5, 0.5}));
    s.add(make_sphere({{0.6, 0, -2.4}}, 0.25), plain({0.5, 0.5, 0.5}));
    s.light.to_sun = normalized({1, 0, 1});
    s.light.sun = {1, 1, 1};
    s.light.sky = s.light.ground = {0.2, 0.2, 0.2};
    s.light.shadows = true;
    const picture photo = render(s);
    // The ball's shadow falls on the wall at x = 0.6 - 0.6 = 0, the middle of the picture.
    CHECK(photo.color(20, 20, 0) + 60 < photo.color(5, 20, 0));
    CHECK(std::abs(photo.color(5, 20, 0) - photo.color(35, 20, 0)) <= 2);
    CHECK(surfaces_at(s, 20.5, 20.5).at(0).color[0] + 60 < surfaces_at(s, 20.5, 5.5).at(0).color[0]);
}
