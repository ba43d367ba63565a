#include <ldi/depth/merge_flakes.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>

namespace {

struct scene {
    ldi::image<float> disparity;
    ldi::image<std::uint8_t> photo;
};

/// A red front, where in_front says so, before a green background.
template <class InFront>
scene two_surfaces(std::size_t rows, std::size_t columns, float front, float back, InFront&& in_front) {
    scene s{ldi::image<float>(rows, columns), ldi::image<std::uint8_t>(rows, columns, 3)};
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const bool near = in_front(x, y);
            s.disparity(y, x) = near ? front : back;
            s.photo(y, x, near ? 0 : 1) = 200;
        }
    return s;
}

}  // namespace

TEST_CASE("a strip of middle depth between two surfaces joins the one of its color") {
    for (const std::size_t width : {1U, 3U, 8U}) {
        scene s = two_surfaces(40, 60, 0.9F, 0.1F, [](std::size_t x, std::size_t) { return x < 30; });
        const ldi::image<float> truth = s.disparity;
        for (const std::size_t first : {30 - width, std::size_t{30}}) {
            for (std::size_t y = 0; y < 40; ++y)
                for (std::size_t x = first; x < first + width; ++x) s.disparity(y, x) = 0.5F;
            CHECK(ldi::merge_flakes(s.disparity, s.photo) == 40 * width);
            CHECK(s.disparity == truth);
        }
    }
}

TEST_CASE("a surface between two others stays if it is wide") {
    scene s = two_surfaces(40, 60, 0.9F, 0.1F, [](std::size_t x, std::size_t) { return x < 30; });
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 30; x < 40; ++x) s.disparity(y, x) = 0.5F;
    const ldi::image<float> before = s.disparity;
    CHECK(ldi::merge_flakes(s.disparity, s.photo) == 0);
    CHECK(s.disparity == before);
}

TEST_CASE("thin things in front of one surface, and small holes in one, stay") {
    std::mt19937 random(1);
    for (int round = 0; round < 40; ++round) {
        const std::size_t at = 10 + random() % 30, width = 1 + random() % 5;
        const bool is_hole = random() % 2 == 0;
        scene s =
            two_surfaces(40, 60, 0.9F, 0.1F, [&](std::size_t x, std::size_t) { return (x >= at && x < at + width) != is_hole; });
        CHECK(ldi::merge_flakes(s.disparity, s.photo) == 0);
    }
}

TEST_CASE("a slope stays, and so do the corners of a midground") {
    scene s = two_surfaces(60, 60, 0.9F, 0.1F, [](std::size_t x, std::size_t) { return x < 30; });
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 60; ++x) {
            if (x >= 30 && y >= 30) s.disparity(y, x) = 0.5F;  // a T-junction
            s.disparity(y, x) += 0.001F * static_cast<float>(y);
        }
    CHECK(ldi::merge_flakes(s.disparity, s.photo) == 0);
}

TEST_CASE("in any map every sample keeps its disparity or takes that of a solid surface nearby, on either side of its own") {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    for (int round = 0; round < 60; ++round) {
        const std::size_t rows = 1 + random() % 40, columns = 1 + random() % 40;
        ldi::flake_options options;
        options.radius = static_cast<std::int32_t>(random() % 5);
        ldi::image<float> map(rows, columns);
        ldi::image<std::uint8_t> photo(rows, columns, 3);
        const std::size_t block = 1 + random() % 12;
        ldi::image<float> coarse(rows / block + 1, columns / block + 1);
        for (float& value : coarse) value = unit(random);
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x) map(y, x) = coarse(y / block, x / block);
        for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(random());
        const ldi::image<float> before = map;
        const std::size_t changed = ldi::merge_flakes(map, photo, {}, options);
        const std::ptrdiff_t reach = 2 * options.radius + 1;
        std::size_t differing = 0;
        for (std::ptrdiff_t y = 0; y < static_cast<std::ptrdiff_t>(rows); ++y)
            for (std::ptrdiff_t x = 0; x < static_cast<std::ptrdiff_t>(columns); ++x) {
                const float now = map(static_cast<std::size_t>(y), static_cast<std::size_t>(x));
                const float own = before(static_cast<std::size_t>(y), static_cast<std::size_t>(x));
                if (now == own) continue;
                ++differing;
                bool nearer = false, farther = false, is_nearby = false;
                for (std::ptrdiff_t v = std::max<std::ptrdiff_t>(y - reach, 0);
                     v <= std::min(y + reach, static_cast<std::ptrdiff_t>(rows) - 1); ++v)
                    for (std::ptrdiff_t u = std::max<std::ptrdiff_t>(x - reach, 0);
                         u <= std::min(x + reach, static_cast<std::ptrdiff_t>(columns) - 1); ++u) {
                        const float there = before(static_cast<std::size_t>(v), static_cast<std::size_t>(u));
                        nearer = nearer || there > own + 0.05F, farther = farther || there < own - 0.05F;
                        is_nearby = is_nearby || there == now;
                    }
                REQUIRE((nearer && farther && is_nearby));
            }
        REQUIRE(changed == differing);
        if (options.radius == 0) REQUIRE(changed == 0);
    }
}

TEST_CASE("merge_flakes refuses a photo of another size, and options outside their range") {
    ldi::image<float> map(4, 5);
    CHECK_THROWS_AS(ldi::merge_flakes(map, ldi::image<std::uint8_t>(5, 4, 3)), ldi::error);
    CHECK_THROWS_AS(ldi::merge_flakes(map, ldi::image<std::uint8_t>(4, 5, 1)), ldi::error);
    const ldi::image<std::uint8_t> photo(4, 5, 3);
    CHECK_THROWS_AS(ldi::merge_flakes(map, photo, {}, {-1, 2}), ldi::error);
    CHECK_THROWS_AS(ldi::merge_flakes(map, photo, {}, {9, 2}), ldi::error);
    CHECK_THROWS_AS(ldi::merge_flakes(map, photo, {}, {3, 0}), ldi::error);
}
