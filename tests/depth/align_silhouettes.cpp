#include <ldi/depth/align_silhouettes.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

namespace {

using color = std::array<std::uint8_t, 3>;

// Two surfaces that meet at a curve. In the given depth map, the curve is displaced from its place in the photo.
struct scene {
    ldi::image<std::uint8_t> photo;
    ldi::image<float> truth, given;
};

template <class IsFront>
scene make_scene(std::size_t height, std::size_t width, float moved_x, float moved_y, color front, color back, float noise,
                 IsFront&& is_front) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal(0.0F, noise);
    scene s{ldi::image<std::uint8_t>(height, width, 3), ldi::image<float>(height, width), ldi::image<float>(height, width)};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const float fx = static_cast<float>(x) + 0.5F, fy = static_cast<float>(y) + 0.5F;
            const bool here = is_front(fx, fy);
            s.truth(y, x) = here ? 0.8F : 0.2F;
            s.given(y, x) = is_front(fx - moved_x, fy - moved_y) ? 0.8F : 0.2F;
            for (std::size_t c = 0; c < 3; ++c)
                s.photo(y, x, c) = static_cast<std::uint8_t>(std::clamp(
                    static_cast<float>((here ? front : back)[c]) + (noise > 0.0F ? normal(random) : 0.0F), 0.0F, 255.0F));
        }
    return s;
}

double share_wrong(const ldi::image<float>& map, const ldi::image<float>& truth) {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < map.size(); ++i) wrong += map.data()[i] != truth.data()[i] ? 1U : 0U;
    return static_cast<double>(wrong) / static_cast<double>(map.size());
}

const auto disc = [](float x, float y) { return std::hypot(x - 48.0F, y - 40.0F) < 25.0F; };
const auto half = [](float x, float y) { return x + 0.3F * y > 55.0F; };
const color red{190, 60, 50}, gray{110, 115, 120};

}  // namespace

TEST_CASE("silhouettes displaced by no more than the uncertainty move to the color edges") {
    for (const float noise : {0.0F, 8.0F})
        for (const auto& [dx, dy] : {std::pair{2.0F, 0.0F}, {-2.0F, 0.0F}, {0.0F, 2.0F}, {-1.5F, 1.5F}}) {
            CAPTURE(noise, dx, dy);
            scene s = make_scene(80, 100, dx, dy, red, gray, noise, disc);
            const double before = share_wrong(s.given, s.truth);
            ldi::align_silhouettes(s.given, s.photo);
            CHECK(share_wrong(s.given, s.truth) < 0.25 * before);
            s = make_scene(80, 100, dx, dy, red, gray, noise, half);  // a curve from border to border
            ldi::align_silhouettes(s.given, s.photo);
            CHECK(share_wrong(s.given, s.truth) < 0.004);
        }
}

TEST_CASE("silhouettes between surfaces of equal color hardly change") {
    scene s = make_scene(80, 100, 2.0F, 0.0F, gray, gray, 8.0F, disc);
    const ldi::image<float> before = s.given;
    ldi::align_silhouettes(s.given, s.photo);
    CHECK(share_wrong(s.given, before) < 0.01);
}

TEST_CASE("a silhouette moves by no more than its uncertainty") {
    scene s = make_scene(80, 100, 9.0F, 0.0F, red, gray, 0.0F, half);
    const ldi::image<float> before = s.given;
    ldi::align_silhouettes(s.given, s.photo);
    for (std::size_t y = 0; y < 80; ++y)
        for (std::size_t x = 5; x + 5 < 100; ++x)
            if (before(y, x - 5) == before(y, x + 5)) REQUIRE(s.given(y, x) == before(y, x));
    s.given = before;
    ldi::align_silhouettes(s.given, s.photo, {}, {.uncertainty = 0.0F});
    CHECK(s.given == before);
}

TEST_CASE("alignment keeps thin objects, and the depth of a third surface beside the silhouette") {
    const auto rod = [](float x, float) { return std::abs(x - 50.0F) < 2.0F; };
    scene s = make_scene(80, 100, 1.0F, 0.0F, red, gray, 4.0F, rod);
    ldi::align_silhouettes(s.given, s.photo);
    CHECK(share_wrong(s.given, s.truth) < 0.005);

    s = make_scene(80, 100, 2.0F, 0.0F, red, gray, 4.0F, disc);
    for (std::size_t y = 0; y < 80; ++y)
        for (std::size_t x = 48; x < 60; ++x) s.given(y, x) = 0.5F;  // a third surface across the disc, between both values
    const ldi::image<float> before = s.given;
    ldi::align_silhouettes(s.given, s.photo);
    for (std::size_t y = 0; y < 80; ++y)
        for (std::size_t x = 53; x < 55; ++x) REQUIRE(s.given(y, x) == 0.5F);
}

TEST_CASE("a pixel that a moving curve passes over joins the curve's other surface, unless it belongs to a third surface") {
    for (const auto& [own, changed] : {std::pair{0.85F, 0.2F}, {0.55F, 0.2F}, {0.45F, 0.8F}, {0.15F, 0.8F}, {1.5F, 1.5F}}) {
        ldi::image<float> before(1, 3);
        before(0, 0) = 0.8F, before(0, 1) = 0.2F, before(0, 2) = own;
        ldi::traced_curve t;
        t.sides.push_back({.back = 1, .front = 0, .toward_front = ldi::side::left});
        ldi::image<float> disparity = before;
        ldi::detail::curves::change_sides(t, {{2, 0}}, before, disparity);
        CHECK(disparity(0, 2) == changed);
    }
}

TEST_CASE("alignment introduces no new disparities and returns the same result on any number of threads") {
    std::mt19937 random(5);
    for (int round = 0; round < 40; ++round) {
        const ldi::image<float> map = ldi::testing::random_disparity(random, 1 + random() % 60, 1 + random() % 60);
        ldi::image<std::uint8_t> photo(map.height(), map.width(), 3);
        for (std::uint8_t& v : photo) v = static_cast<std::uint8_t>(random());
        ldi::image<float> aligned = map, by_threads = map;
        ldi::align_silhouettes(aligned, photo, {}, {.uncertainty = static_cast<float>(random() % 9), .min_length = 5});
        for (const float v : aligned) REQUIRE(std::find(map.begin(), map.end(), v) != map.end());
        aligned = map;
        ldi::align_silhouettes(aligned, photo);
        ldi::align_silhouettes(by_threads, photo, {}, {}, ldi::thread_pool(3));
        REQUIRE(by_threads == aligned);
    }
}

TEST_CASE("single bright pixels beside a silhouette do not attract it") {
    // Two surfaces of similar color. In every twelfth row, a pixel to the right of their edge is far brighter than both.
    scene s = make_scene(72, 100, 0.0F, 0.0F, {100, 100, 100}, {70, 70, 70}, 0.0F, [](float x, float) { return x < 50.0F; });
    for (const std::size_t distance : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
        CAPTURE(distance);
        scene glints = s;
        for (std::size_t y = 6; y < 72; y += 12)
            for (std::size_t c = 0; c < 3; ++c) glints.photo(y, 50 + distance, c) = 255;
        ldi::align_silhouettes(glints.given, glints.photo);
        CHECK(share_wrong(glints.given, s.truth) == 0.0);
    }
}

TEST_CASE("alignment separates surfaces whose colors differ by no more than camera noise, if the photo has no noise") {
    scene s = make_scene(80, 100, 2.0F, 0.0F, {106, 106, 106}, {100, 100, 100}, 0.0F, half);
    const double before = share_wrong(s.given, s.truth);
    ldi::align_silhouettes(s.given, s.photo);
    CHECK(share_wrong(s.given, s.truth) < 0.4 * before);
}

TEST_CASE("an edge is found even if stripes of higher contrast cross it") {
    scene s = make_scene(80, 100, 2.0F, 0.0F, {130, 130, 130}, {70, 70, 70}, 0.0F, half);
    for (std::size_t y = 0; y < 80; ++y)
        for (std::size_t x = 0; x < 300; ++x) {
            const int striped = s.photo.row(y)[x] + (y % 8 < 4 ? 60 : -60);
            s.photo.row(y)[x] = static_cast<std::uint8_t>(striped);
        }
    const double before = share_wrong(s.given, s.truth);
    ldi::align_silhouettes(s.given, s.photo);
    CHECK(share_wrong(s.given, s.truth) < 0.33 * before);
}

TEST_CASE(
    "a silhouette may move by at most half the width of a thin object or gap, but on a jagged edge by the depth of the teeth") {
    const auto for_each_band_row = [](std::int32_t radius, auto&& is_front, auto&& visit) {
        const scene s = make_scene(60, 80, 0.0F, 0.0F, red, gray, 0.0F, is_front);
        const ldi::corner_map lattice(80, 60);
        for (const auto& t : ldi::detail::curves::long_curves(s.given, {}, 20)) {
            const ldi::detail::curves::band b(ldi::detail::curves::make_plane_curve(t, lattice, radius / 2), t, s.photo, s.given,
                                              radius);
            for (std::int32_t k = radius; k + radius < b.size(); ++k) visit(b.min_cut(k), b.largest_cut(k));
        }
    };
    for_each_band_row(
        3, [](float x, float) { return std::abs(x - 40.5F) < 1.6F; },
        [](std::int32_t, std::int32_t most) { REQUIRE(most == 1); });
    for_each_band_row(
        3, [](float x, float) { return std::abs(x - 40.5F) > 1.6F; },
        [](std::int32_t least, std::int32_t) { REQUIRE(least == -1); });
    const auto jagged = [](float x, float y) { return x > 40.0F + (std::fmod(y, 12.0F) < 6.0F ? 2.0F : -2.0F); };
    for_each_band_row(8, jagged, [](std::int32_t least, std::int32_t most) { REQUIRE((least <= -4 && most >= 4)); });
}

TEST_CASE(
    "color models are normal densities: a color near the mean is likelier on a smooth surface, other colors on a rough one") {
    const auto model_of = [](int deviation) {
        ldi::detail::curves::color_sums sums;
        for (const int sign : {-1, 1}) {
            const std::uint8_t value = static_cast<std::uint8_t>(100 + sign * deviation);
            sums.add(color{value, value, value}.data());
        }
        return ldi::detail::curves::color_model(sums, 0.0F);
    };
    const ldi::detail::curves::color_model smooth = model_of(10), rough = model_of(20);
    for (const int offset : {0, 5, 13, 14, 40}) {
        const std::uint8_t value = static_cast<std::uint8_t>(100 + offset);
        const color c{value, value, value};
        // Logarithm of the ratio of two normal densities, in three channels.
        const double expected = 3 * (std::log(2.0) - offset * offset * (1 / 100.0 - 1 / 400.0) / 2);
        CHECK(smooth.log_likelihood(c.data()) - rough.log_likelihood(c.data()) == Approx(expected).margin(1e-3));
    }
}

TEST_CASE("images of different sizes and options outside their range are refused") {
    ldi::image<float> map(10, 12);
    const ldi::image<std::uint8_t> photo(10, 12, 3);
    CHECK_THROWS_WITH(ldi::align_silhouettes(map, ldi::image<std::uint8_t>(10, 13, 3)),
                      Catch::Contains("of the same size") && Catch::Contains("10 x 12 x 1 and 10 x 13 x 3"));
    CHECK_THROWS_WITH(ldi::align_silhouettes(map, photo, {}, {.uncertainty = 257.0F}), Catch::Contains("from 0 to 256"));
    CHECK_THROWS_WITH(ldi::align_silhouettes(map, photo, {}, {.stiffness = -1.0F}), Catch::Contains("at least 0"));
}
