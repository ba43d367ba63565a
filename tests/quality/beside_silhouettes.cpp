// Tests the measures of faults beside silhouettes on simple scenes with known results.
#include <bench/quality/beside_silhouettes.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace {

/// Counts the islands of a scene: a front at disparity 0.9 on the left, a wall at 0.1 on the right, and a strip of disparity
/// `strip`. The strip is `width` pixels wide, and lies between front and wall or, with `on_wall`, inside the wall.
std::size_t islands_of(std::size_t width, float strip, bool on_wall) {
    ldi::image<float> map(240, 1152);
    const std::size_t first = on_wall ? 700 : 400;
    for (std::size_t y = 0; y < 240; ++y)
        for (std::size_t x = 0; x < 1152; ++x) map(y, x) = x >= first && x < first + width ? strip : x < 400 ? 0.9F : 0.1F;
    ldi::photo_layer layer = ldi::testing::lift_disparity(map);
    const ldi::buffer<ldi::discontinuity_curve> curves = ldi::find_discontinuity_curves(layer, {});
    ldi::close_spurious_discontinuities(layer, curves);
    return ldi_quality::detail::count_islands(layer.topology(), curves);
}

}  // namespace

TEST_CASE("an island is a narrow surface between a nearer and a farther one") {
    CHECK(islands_of(6, 0.5F, false) == 1);
    CHECK(islands_of(30, 0.5F, false) == 0);  // too wide
    CHECK(islands_of(6, 0.5F, true) == 0);    // the wall is on both sides of it
    CHECK(islands_of(6, 0.1F, false) == 0);
}

TEST_CASE("a color beside a silhouette counts as matching neither surface only if it is not a mixture of both") {
    ldi::image<float> map(40, 80);
    ldi::image<std::uint8_t> photo(40, 80, 3);
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 80; ++x) {
            map(y, x) = x < 40 ? 0.9F : 0.1F;
            photo(y, x, x < 40 ? 0 : 1) = 200;
        }
    for (std::size_t c = 0; c < 3; ++c) {
        photo(20, 36, c) = 100;              // gray
        photo(10, 41, c) = c < 2 ? 100 : 0;  // an equal mixture of both
    }
    const ldi::photo_layer layer = ldi::lift(photo, map);
    const ldi_quality::mask result = ldi_quality::detail::fits_neither(layer);
    CHECK(result(20, 36) == 2);
    CHECK(result(10, 41) == 1);
    CHECK(result(20, 30) == 1);
    CHECK(result(20, 10) == 0);  // outside the band
    std::size_t neither = 0;
    for (const std::uint8_t r : result) neither += r == 2 ? 1U : 0U;
    CHECK(neither == 1);
}

TEST_CASE("details are magnified by a factor of four, and pictures fill a grid row by row") {
    ldi_quality::picture seen(100, 100, 3);
    seen(50, 60, 1) = 255;
    const ldi_quality::picture large = ldi_quality::enlarged(seen, 60, 50);
    REQUIRE(large.height() == 320);
    for (std::size_t y = 160; y < 164; ++y) CHECK(large(y, 160, 1) == 255);
    CHECK(large(164, 160, 1) == 0);
    CHECK(large(159, 160, 1) == 0);
    const ldi_quality::picture grid =
        ldi_quality::in_grid({ldi_quality::picture(2, 3, 3), ldi_quality::picture(2, 3, 3, std::uint8_t{9}),
                              ldi_quality::picture(2, 3, 3, std::uint8_t{7})},
                             2);
    REQUIRE(grid.height() == 4);
    REQUIRE(grid.width() == 6);
    CHECK(grid(0, 0, 0) == 0);
    CHECK(grid(1, 3, 0) == 9);
    CHECK(grid(2, 2, 0) == 7);
    CHECK(grid(2, 3, 0) == 255);  // empty
}
