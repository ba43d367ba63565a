#include <ldi/core/pixel_region.hpp>

#include "tests/support/random_region.hpp"

#include <catch2/catch.hpp>

#include <type_traits>
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

template <class Region>
concept can_receive_rows = requires(Region& region) {
    region.add_run(0, 1);
}
|| requires(Region& region) { region.end_row(); };
template <class Builder>
concept can_be_read = requires(const Builder& builder) {
    builder.row(0);
}
|| requires(const Builder& builder) { builder.width(); };
static_assert(!can_receive_rows<pixel_region> && !std::is_constructible_v<pixel_region, int>,
              "a finished region does not change");
static_assert(can_receive_rows<pixel_region_builder> && !can_be_read<pixel_region_builder>,
              "an unfinished region cannot be read");

TEST_CASE("a moved-from region and the second region of one builder have no pixels") {
    pixel_region region = region_of(random_marks(9, 13, 1));
    const pixel_region other = std::move(region);
    CHECK(other.height() == 9);
    CHECK((region.width() == 0 && region.height() == 0));
    CHECK(region.size() == 0);
    pixel_region assigned;
    pixel_region source = other;
    assigned = std::move(source);
    CHECK((assigned.size() == other.size() && assigned.width() == 13));
    CHECK((source.width() == 0 && source.height() == 0 && source.size() == 0));

    pixel_region_builder builder(5);
    builder.add_run(2, 5), builder.end_row();
    const pixel_region first = std::move(builder).build();
    CHECK(first.number(4, 0) == 2);
    CHECK(first.number(5, 0) == no_pixel);
    CHECK(std::move(builder).build().width() == 0);
}

TEST_CASE("pixel_region_builder refuses columns outside the lattice or out of order, a negative width, and an unfinished row") {
    CHECK_THROWS_AS(pixel_region_builder(-1), error);
    for (const auto& [first, last] :
         {std::pair{-1, 3}, {0, 0}, {3, 2}, {8, 11}, {11, 12}, {4, 6}, {0, 2}, {0x7FFFFFFF, 0x7FFFFFFF}}) {
        pixel_region_builder builder(10);
        builder.add_run(3, 5);
        CAPTURE(first, last);
        CHECK_THROWS_AS(builder.add_run(first, last), error);
        CHECK_THROWS_AS(std::move(builder).build(), error);
        builder.add_run(5, 7), builder.end_row();  // neither error changed the builder
        const pixel_region region = std::move(builder).build();
        CHECK(region.row(0).size() == 1);
        CHECK(region.size() == 4);
    }
}

TEST_CASE("a region of 2^31 pixels or more is refused, and the widest region can be halved") {
    pixel_region_builder region(1 << 30);
    region.add_run(0, 1 << 30), region.end_row();
    region.add_run(0, (1 << 30) - 1), region.end_row();
    CHECK_THROWS_AS(region.add_run(3, 4), error);
    CHECK(std::move(region).build().count() == 0x7FFFFFFF);

    pixel_region_builder row(1 << 30);
    row.add_run((1 << 30) - 2, 1 << 30), row.end_row();
    const pixel_region half = halved(std::move(row).build());
    CHECK(half.width() == 1 << 29);
    CHECK(half.number((1 << 29) - 1, 0) == 0);
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

template <class Region>
constexpr bool shows_temporary_runs = requires {
    Region().row(0);
};
static_assert(!shows_temporary_runs<ldi::pixel_region>);
