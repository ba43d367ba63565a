// Tests the measures of silhouettes in bench/quality on simple scenes with known results.
#include <bench/quality/degraded_depth.hpp>
#include <bench/quality/halo.hpp>
#include <bench/quality/silhouettes.hpp>
#include <bench/quality/stretch.hpp>
#include <bench/quality/true_silhouettes.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace {

using namespace ldi_quality;

struct rectangle {
    std::size_t left, top, right, bottom;
    bool has(std::size_t x, std::size_t y) const { return x >= left && x < right && y >= top && y < bottom; }
};

ldi::image<float> disparity_of(std::size_t height, std::size_t width, const rectangle& near) {
    ldi::image<float> result(height, width);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) result(y, x) = near.has(x, y) ? 1.0F : 0.1F;
    return result;
}

/// A white rectangle on black.
picture photo_of(std::size_t height, std::size_t width, const rectangle& near) {
    picture result(height, width, 3, std::uint8_t{0});
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < 3 && near.has(x, y); ++c) result(y, x, c) = 255;
    return result;
}

mask all_of(std::size_t height, std::size_t width) { return {height, width, 1, std::uint8_t{1}}; }

/// A near rectangle in front of a background. In the other view, the rectangle appears `movement` pixels farther to the left.
subject subject_of(std::size_t height, std::size_t width, const rectangle& near, float movement) {
    subject s;
    s.photo = photo_of(height, width, near);
    s.inverse_depth = disparity_of(height, width, near);
    s.known = all_of(height, width);
    s.camera = {static_cast<std::int32_t>(width), static_cast<std::int32_t>(height), 100};
    s.other = ldi::moved_view(s.camera, s.range(), 1, -movement);
    s.seen = picture(height, width, 3);
    return s;
}

std::vector<side_middle> middles_of(const std::vector<true_side>& sides, std::int32_t half_pixels_right) {
    std::vector<side_middle> result;
    for (const true_side& s : sides) result.push_back({s.middle().x + half_pixels_right, s.middle().y});
    return result;
}

}  // namespace

TEST_CASE("degraded depth has a long side of 384 and is shifted by two samples to the right and down") {
    const ldi::image<float> result = degraded(disparity_of(400, 768, {200, 120, 600, 300}));
    REQUIRE(result.height() == 200);
    REQUIRE(result.width() == 384);
    // The rectangle starts at column 100 and row 60. The blurred step reaches half its height at the shifted border.
    const float half = 0.55F;
    CHECK(result(100, 101) < half);
    CHECK(result(100, 102) > half);
    CHECK(result(61, 200) < half);
    CHECK(result(62, 200) > half);
    CHECK((result(100, 101) + result(100, 102)) / 2 == Approx(half).margin(1e-4));
}

TEST_CASE("degradation blurs a step to the cumulative normal distribution") {
    const ldi::image<float> result = degraded(disparity_of(100, 384, {200, 0, 384, 100}), {384, 3, 0});
    for (std::size_t x = 190; x < 210; ++x) {
        const double from_step = static_cast<double>(x) + 0.5 - 200;
        const double normal = 0.5 * std::erfc(-from_step / (3 * std::sqrt(2.0)));
        CHECK(result(50, x) == Approx(0.1 + 0.9 * normal).margin(0.01));
    }
}

TEST_CASE("degradation without blur and shift leaves small depth maps unchanged") {
    const ldi::image<float> map = disparity_of(50, 70, {10, 10, 20, 30});
    CHECK(degraded(map, {384, 0, 0}) == map);
}

TEST_CASE("a rectangle's true silhouette is its perimeter, with the near pixels inside") {
    const rectangle near{20, 10, 50, 30};
    const std::vector<true_side> sides = true_silhouettes(photo_of(60, 80, near), disparity_of(60, 80, near), all_of(60, 80));
    REQUIRE(sides.size() == 2 * (30 + 20));
    for (const true_side& s : sides) {
        CHECK(near.has(static_cast<std::size_t>(s.near_x), static_cast<std::size_t>(s.near_y)));
        CHECK_FALSE(near.has(static_cast<std::size_t>(s.far_x), static_cast<std::size_t>(s.far_y)));
        CHECK(s.colors_differ);
    }
}

TEST_CASE("true silhouettes exclude specks and unknown depth, and mark sides whose colors are alike") {
    const rectangle near{20, 10, 50, 30};
    ldi::image<float> disparity = disparity_of(60, 80, near);
    for (std::size_t y = 40; y < 44; ++y)  // a speck
        for (std::size_t x = 60; x < 64; ++x) disparity(y, x) = 1;
    const picture gray(60, 80, 3, std::uint8_t{90});
    const std::vector<true_side> sides = true_silhouettes(gray, disparity, all_of(60, 80));
    CHECK(sides.size() == 100);
    CHECK(std::none_of(sides.begin(), sides.end(), [](const true_side& s) { return s.colors_differ; }));

    mask known = all_of(60, 80);
    for (std::size_t y = 0; y < 60; ++y) known(y, 20) = 0;
    CHECK(true_silhouettes(gray, disparity, known).size() == 100 - 20 - 2);
}

TEST_CASE("nearest_side finds the same side as an exhaustive search") {
    std::mt19937 random(3);
    const auto any = [&](std::int32_t end) { return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(end)); };
    std::vector<side_middle> sides;
    for (int i = 0; i < 25; ++i) sides.push_back({any(121), any(81)});
    const nearest_side nearest(sides, 40, 60);
    for (int i = 0; i < 300; ++i) {
        const side_middle from{any(121), any(81)};
        double best = 8;
        for (const side_middle& s : sides) best = std::min(best, std::hypot(s.x - from.x, s.y - from.y) / 2);
        const auto [distance, found] = nearest.find(from, 8);
        REQUIRE(distance == Approx(best));
        if (found >= 0) {
            const side_middle& s = sides[static_cast<std::size_t>(found)];
            REQUIRE(std::hypot(s.x - from.x, s.y - from.y) / 2 == Approx(best));
        } else {
            REQUIRE(best == 8);
        }
    }
}

TEST_CASE(
    "distance_of_silhouettes() is 0 for true silhouettes, scales with the photo's size, and counts unmatched ones as missed") {
    const rectangle near{20, 10, 50, 200};
    const picture photo = photo_of(288, 80, near);
    const std::vector<true_side> truth = true_silhouettes(photo, disparity_of(288, 80, near), all_of(288, 80));
    const auto distance = [&](const std::vector<side_middle>& ours) { return distance_of_silhouettes(ours, truth, 288, 80); };
    CHECK(distance(middles_of(truth, 0)).pixels == 0);
    CHECK(distance(middles_of(truth, 0)).missed == 0);
    CHECK(distance(middles_of(truth, 4)).pixels == Approx(8));  // 4 half pixels of 288 rows are 8 pixels of 1152
    CHECK(distance(middles_of(truth, 4)).missed == 0);
    CHECK(distance(middles_of(truth, 8)).missed > 0.5);
    CHECK(std::isnan(distance({}).pixels));
    CHECK(distance({}).missed == 1);

    std::vector<true_side> unseen = truth;
    for (true_side& s : unseen) s.colors_differ = false;
    CHECK(std::isnan(distance_of_silhouettes(middles_of(truth, 4), unseen, 288, 80).pixels));
    CHECK(std::isnan(distance_of_silhouettes(middles_of(truth, 4), unseen, 288, 80).missed));
}

TEST_CASE("share_closed() is the fraction of discontinuities that lie on no curve") {
    ldi::image<float> disparity = disparity_of(60, 80, {20, 10, 50, 30});  // 100 sides
    disparity(50, 70) = 1;                                                 // 4 sides
    const picture photo(60, 80, 3);
    const auto curves = ldi::find_discontinuity_curves(ldi::lift(photo, disparity), {});
    CHECK(share_closed(photo, disparity, curves, {}) == Approx(4.0 / 104));
    CHECK(share_closed(photo, disparity, {}, {}) == 1);
    CHECK(share_closed(photo, ldi::image<float>(60, 80), {}, {}) == 0);
}

TEST_CASE("the band along a silhouette is six pixels wide and is moved to the silhouette's position in the other view") {
    const subject s = subject_of(60, 80, {30, 0, 50, 60}, 8);
    const mask band = silhouette_band(s, true_silhouettes(s.photo, s.inverse_depth, s.known));
    for (std::size_t x = 0; x < 80; ++x) {
        INFO(x);
        const bool beside_left = x >= 30 - 8 - 3 && x < 30 - 8 + 3, beside_right = x >= 50 - 8 - 3 && x < 50 - 8 + 3;
        CHECK((band(30, x) != 0) == (beside_left || beside_right));
    }
}

TEST_CASE("a silhouette that is hidden in the other view has no band there") {
    subject s = subject_of(60, 80, {40, 0, 48, 60}, 8);
    for (std::size_t y = 0; y < 60; ++y)  // a step in the background that the rectangle hides from the other view
        for (std::size_t x = 0; x < 36; ++x) s.inverse_depth(y, x) = 0.2F;
    const mask band = silhouette_band(s, true_silhouettes(s.photo, s.inverse_depth, s.known));
    CHECK(band(30, 32) != 0);  // left side of the rectangle
    CHECK(band(30, 40) != 0);
    CHECK(band(30, 36) == 0);  // the step's position, at about 35.1
}

TEST_CASE("color_error() averages over the pixels of the mask and all channels") {
    const picture a(10, 10, 3, std::uint8_t{100});
    picture b = a;
    b(2, 3, 1) = 130, b(7, 7, 0) = 0;
    mask where(10, 10);
    where(2, 3) = 1, where(2, 4) = 1;
    CHECK(color_error(a, b, where) == Approx(30.0 / 6));
    CHECK(color_error(a, b, mask(10, 10)) == 0);
}

TEST_CASE("spanning triangles are those that connect both surfaces at a true silhouette") {
    const subject s = subject_of(60, 80, {30, 0, 80, 60}, 20);
    const std::vector<true_side> truth = true_silhouettes(s.photo, s.inverse_depth, s.known);
    ldi::textured_mesh mesh;
    const auto add = [&](float left, float right, float left_inverse_depth, float right_inverse_depth) {
        const std::uint32_t first = static_cast<std::uint32_t>(mesh.vertex_count());
        const std::array<float, 4> xs{left, left, right, right}, ys{0, 60, 60, 0};
        for (std::size_t k = 0; k < 4; ++k) {
            const float inverse_depth = k < 2 ? left_inverse_depth : right_inverse_depth;
            for (const float value : s.camera.unproject(xs[k], ys[k], 1 / inverse_depth)) mesh.positions.push_back(value);
            mesh.pixels.push_back(0);
        }
        for (const std::uint32_t k : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.triangles.push_back(first + k);
    };
    add(0, 28, 0.1F, 0.3F);   // a slightly sloping background
    add(28, 30, 0.3F, 1.0F);  // texture stretched between both
    add(30, 80, 1.0F, 1.0F);
    add(60, 62, 0.1F, 1.0F);  // as steep, but without a silhouette
    const ldi::buffer<std::uint8_t> marked = spanning_triangles(mesh, s, truth);
    const std::vector<int> expected{0, 0, 1, 1, 0, 0, 0, 0};
    REQUIRE(marked.size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) CHECK(marked[i] == expected[i]);

    // In a view from the other side, the stretched part is wider by the relative motion of both surfaces.
    ldi::serial_executor threads;
    const ldi::view from = ldi::moved_view(s.camera, s.range(), 1, 20);
    const mask shown = shown_triangles(mesh, marked, from, threads);
    const double moved_apart = 2 + 20 * (1 - 0.3);
    CHECK(80 * share(shown) == Approx(moved_apart).margin(1));
}
