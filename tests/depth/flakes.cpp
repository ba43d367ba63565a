#include <ldi/depth/flakes.hpp>

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

using namespace ldi;

namespace {

constexpr std::uint8_t of_back = 1, of_front = 255, undecided = 0;

/// Background 0.2 on the left of column 20, foreground 0.8 on the right.
image<float> two_sides() {
    image<float> map(30, 40);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x) = x < 20 ? 0.2F : 0.8F;
    return map;
}

void fill(image<float>& map, std::size_t top, std::size_t left, std::size_t height, std::size_t width, float disparity) {
    for (std::size_t y = top; y < top + height; ++y) std::fill_n(map.row(y) + left, width, disparity);
}

image<std::uint8_t> all(std::uint8_t share, const image<float>& map) { return {map.height(), map.width(), 1, share}; }

/// A map with few different disparities, so that components have random sizes and shapes.
image<float> random_map(std::mt19937& random) {
    image<float> map(1 + random() % 20, 1 + random() % 20);
    const unsigned levels = 2 + random() % 4, coarse = 1 + random() % 4;
    for (std::size_t y = 0; y < map.height(); ++y)
        for (std::size_t x = 0; x < map.width(); ++x)
            map(y, x) = y % coarse != 0   ? map(y - 1, x)
                        : x % coarse != 0 ? map(y, x - 1)
                                          : static_cast<float>(random() % levels) / 4.0F;
    return map;
}

}  // namespace

TEST_CASE("a narrow surface between both sides of a silhouette gets the disparity of the side that was decided") {
    image<float> map = two_sides();
    const image<float> clean = map;
    fill(map, 0, 17, 30, 3, 0.5F);  // 90 pixels, 3 wide
    image<float> of_decided_front = map;
    CHECK(merge_flakes(map, all(of_back, map)) == 1);
    CHECK((map == clean));

    CHECK(merge_flakes(of_decided_front, all(of_front, map)) == 1);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 40; ++x) REQUIRE(of_decided_front(y, x) == (x < 17 ? 0.2F : 0.8F));
}

TEST_CASE("a stair of narrow surfaces becomes part of the surface at its end") {
    for (const std::uint8_t share : {of_back, of_front}) {
        image<float> map = two_sides();
        for (std::size_t step = 0; step < 5; ++step) fill(map, 0, 10 + 2 * step, 30, 2, 0.3F + 0.1F * static_cast<float>(step));
        CHECK(merge_flakes(map, all(share, map)) == 5);
        for (const float disparity : map) REQUIRE((disparity == 0.2F || disparity == 0.8F));
        CHECK(map(15, 19) == (share == of_back ? 0.2F : 0.8F));
        CHECK(map(15, 10) == (share == of_back ? 0.2F : 0.8F));
    }
}

TEST_CASE("a speck gets the disparity of its surroundings, whichever side was decided") {
    for (const std::uint8_t share : {of_back, of_front, undecided})
        for (const float speck : {0.0F, 1.0F}) {
            image<float> map = two_sides();
            const image<float> clean = map;
            fill(map, 5, 5, 3, 4, speck), fill(map, 12, 30, 4, 4, speck);
            CHECK(merge_flakes(map, all(share, map)) == 2);
            CHECK((map == clean));
        }
}

TEST_CASE("flakes inside flakes all get the disparity of the surface around them") {
    for (const std::uint8_t share : {of_back, of_front, undecided})
        for (const auto& [outer, inner] : {std::pair{0.5F, 0.2F}, {0.5F, 0.8F}, {0.95F, 0.5F}}) {
            image<float> map(20, 20, 1, 0.7F);
            fill(map, 6, 6, 6, 6, outer), fill(map, 8, 8, 2, 2, inner);
            CHECK(merge_flakes(map, all(share, map), {}, {.min_size = 40}) == 2);
            for (const float disparity : map) REQUIRE(disparity == 0.7F);
        }
}

TEST_CASE("a map of flakes only does not change") {
    image<float> map(20, 20);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 20; ++x) map(y, x) = (x + y) % 2 == 0 ? 0.2F : 0.8F;
    const image<float> before = map;
    CHECK(merge_flakes(map, all(of_back, map)) == 0);
    CHECK((map == before));
}

TEST_CASE("after merging, no speck remains if any component is large") {
    std::mt19937 random(7);
    for (int round = 0; round < 300; ++round) {
        image<float> map = random_map(random);
        const flake_options options{.min_size = static_cast<std::int32_t>(random() % 12), .min_width = 0};
        const auto sizes = [&] { return detail::component_sizes(detail::find_components(map, {})); };
        const buffer<std::int32_t> before = sizes();
        merge_flakes(map, all(random() % 2 == 0 ? of_back : of_front, map), {}, options);
        if (std::none_of(before.begin(), before.end(), [&](std::int32_t size) { return size >= options.min_size; })) continue;
        for (const std::int32_t size : sizes()) REQUIRE(size >= options.min_size);
    }
}

TEST_CASE("an undecided flake gets the disparity of the side that it touches more") {
    image<float> map = two_sides();
    const image<float> clean = map;
    fill(map, 10, 20, 3, 4, 0.5F);  // 3 sides toward the background, 11 toward the foreground
    CHECK(merge_flakes(map, all(undecided, map)) == 1);
    CHECK((map == clean));
}

TEST_CASE("large surfaces that are wide, or only in front, or only behind, keep their disparities") {
    image<float> map = two_sides();
    fill(map, 0, 10, 30, 10, 0.5F);  // 10 wide, between both sides
    fill(map, 2, 2, 2, 8, 0.9F);     // too small without the next line
    fill(map, 4, 2, 20, 2, 0.9F);    // 2 wide, in front of the background
    fill(map, 2, 32, 25, 2, 0.1F);   // 2 wide, a slit in the foreground
    const image<float> before = map;
    CHECK(merge_flakes(map, all(of_back, map)) == 0);
    CHECK((map == before));
}

TEST_CASE("a photo of one surface has no flakes, however small it is") {
    for (const std::size_t side : {std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
        image<float> map(side, side, 1, 0.5F);
        CHECK(merge_flakes(map, all(of_front, map)) == 0);
    }
    image<float> empty;
    CHECK(merge_flakes(empty, image<std::uint8_t>()) == 0);
}

TEST_CASE("merging flakes introduces no new values, and changes nothing if both limits are 0") {
    std::mt19937 random(5);
    for (int round = 0; round < 300; ++round) {
        image<float> map = random_map(random);
        image<std::uint8_t> shares = all(undecided, map);
        for (std::uint8_t& share : shares) share = static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random() % 256);
        const image<float> before = map;
        merge_flakes(map, shares, {}, {.min_size = static_cast<std::int32_t>(random() % 30), .min_width = 3.0F});
        for (const float value : map) REQUIRE(std::find(before.begin(), before.end(), value) != before.end());
        const image<float> once = map;
        REQUIRE(merge_flakes(map, shares, {}, {.min_size = 0, .min_width = 0}) == 0);
        REQUIRE((map == once));
    }
}

TEST_CASE("contacts of components are the pixel sides between two components") {
    std::mt19937 random(6);
    for (int round = 0; round < 200; ++round) {
        const image<float> map = random_map(random);
        const detail::image_components components = detail::find_components(map, {});
        const std::int32_t count = detail::component_sizes(components).count();
        const buffer<detail::contacts> found = detail::contacts_of_all(components, count, map);
        buffer<detail::contacts> expected(static_cast<std::size_t>(count));
        const auto compare = [&](std::size_t y, std::size_t x, std::size_t v, std::size_t u) {
            if (v >= map.height() || u >= map.width()) return;
            const std::int32_t a = components.at(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)),
                               b = components.at(static_cast<std::int32_t>(u), static_cast<std::int32_t>(v));
            if (a == b) return;
            ++(map(y, x) > map(v, u) ? expected[a].farther : expected[a].nearer);
            ++(map(y, x) > map(v, u) ? expected[b].nearer : expected[b].farther);
        };
        for (std::size_t y = 0; y < map.height(); ++y)
            for (std::size_t x = 0; x < map.width(); ++x) compare(y, x, y, x + 1), compare(y, x, y + 1, x);
        for (std::int32_t c = 0; c < count; ++c) {
            REQUIRE(found[c].nearer == expected[c].nearer);
            REQUIRE(found[c].farther == expected[c].farther);
        }
    }
}

TEST_CASE("merge_flakes() refuses images of different shapes and a negative width") {
    image<float> map(4, 5);
    CHECK(testing::raised([&] { merge_flakes(map, image<std::uint8_t>(5, 4, 1)); }) == error_code::mismatch);
    CHECK(testing::raised([&] { merge_flakes(map, image<std::uint8_t>(4, 5, 2)); }) == error_code::mismatch);
    image<float> colors(4, 5, 3);
    CHECK(testing::raised([&] { merge_flakes(colors, image<std::uint8_t>(4, 5, 1)); }) == error_code::mismatch);
    CHECK(testing::raised([&] { merge_flakes(map, image<std::uint8_t>(4, 5, 1), {}, {.min_width = -1.0F}); }) ==
          error_code::invalid_option);
}
