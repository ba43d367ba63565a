#include <ldi/core/pixel_region.hpp>

#include "tests/support/random_region.hpp"

#include <catch2/catch.hpp>

#include <utility>

using namespace ldi;
using ldi::testing::number_in;
using ldi::testing::random_marks;
using ldi::testing::region_of;

TEST_CASE("a region numbers its pixels row by row, and other positions have no number") {
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        const image<std::uint8_t> marks = random_marks(9, 13, seed);
        const pixel_region region = region_of(marks);
        CHECK(region.height() == 9);
        for (std::int32_t y = -2; y < 11; ++y)
            for (std::int32_t x = 0; x < 15; ++x) CHECK(region.number(x, y) == number_in(marks, x, y));
        buffer<std::int32_t> row(13);
        for (std::int32_t y = 0; y < 9; ++y) {
            region.numbers(0, y, row);
            for (std::int32_t x = 0; x < 13; ++x) CHECK(row[x] == number_in(marks, x, y));
        }
    }
}

TEST_CASE("a region that was moved from is empty, and accepts rows again") {
    pixel_region region = region_of(random_marks(9, 13, 1));
    const pixel_region other = std::move(region);
    CHECK(other.height() == 9);
    CHECK(region.height() == 0);
    CHECK(region.size() == 0);
    region.add_run(2, 5);
    region.end_row();
    CHECK(region.number(4, 0) == 2);
    CHECK(region.number(5, 0) == no_pixel);
}

TEST_CASE("a region of 2^31 pixels or more is refused, and the widest region can be halved") {
    pixel_region region(1 << 30);
    region.add_run(0, 1 << 30), region.end_row();
    region.add_run(0, (1 << 30) - 1), region.end_row();
    CHECK(region.count() == 0x7FFFFFFF);
    CHECK_THROWS_AS(region.add_run(3, 4), error);
    CHECK(region.count() == 0x7FFFFFFF);

    pixel_region row(0x7FFFFFFF);
    row.add_run(0x7FFFFFFE, 0x7FFFFFFF), row.end_row();
    const pixel_region half = halved(row);
    CHECK(half.width() == 1 << 30);
    CHECK(half.number((1 << 30) - 1, 0) == 0);
}

TEST_CASE("a halved region has the pixels with even coordinates, which are the parents of their 2 x 2 blocks") {
    for (const auto& [height, width] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 2}, {2, 1}, {8, 8}, {7, 10}, {9, 5}})
        for (std::uint32_t seed = 0; seed < 10; ++seed) {
            const image<std::uint8_t> marks = random_marks(height, width, seed);
            const pixel_region region = region_of(marks), half = halved(region);
            image<std::uint8_t> expected((height + 1) / 2, (width + 1) / 2);
            for (std::size_t y = 0; y < expected.height(); ++y)
                for (std::size_t x = 0; x < expected.width(); ++x) expected(y, x) = marks(2 * y, 2 * x);
            CHECK(half.height() == static_cast<std::int32_t>(expected.height()));
            CHECK(half.width() == static_cast<std::int32_t>(expected.width()));
            const buffer<std::int32_t> parent = parents(region, half), below = pixels_below(region);
            REQUIRE(parent.size() == region.size());
            for (std::int32_t y = 0; y < region.height(); ++y)
                for (std::int32_t x = 0; x < region.width(); ++x) {
                    const std::int32_t i = region.number(x, y);
                    if (i == no_pixel) continue;
                    CHECK(parent[i] == number_in(expected, x / 2, y / 2));
                    CHECK(below[i] == number_in(marks, x, y + 1));
                }
            for (std::int32_t y = 0; y < half.height(); ++y)
                for (std::int32_t x = 0; x < half.width(); ++x) CHECK(half.number(x, y) == number_in(expected, x, y));
        }
}
