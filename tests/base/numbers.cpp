#include <ldi/base/numbers.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

using namespace ldi::detail;

TEST_CASE("an integer becomes the float nearest to it") {
    STATIC_REQUIRE(nearest_float(-3) == -3.0F);
    STATIC_REQUIRE(nearest_float(std::size_t{1} << 24) == 16777216.0F);
    STATIC_REQUIRE(nearest_float((1 << 24) + 3) == 16777220.0F);
    STATIC_REQUIRE(nearest_double((std::int64_t{1} << 53) - 1) == 9007199254740991.0);
}

TEST_CASE("the nearest byte is that of the nearest whole number, and none lies outside 0 to 255") {
    for (int i = 0; i < 255; ++i) {
        const float whole = nearest_float(i);
        CHECK(rounded_to_byte(whole) == i);
        CHECK(rounded_to_byte(whole + 0.5F) == i + 1);
        CHECK(rounded_to_byte(std::nextafter(whole + 0.5F, 0.0F)) == i);
        CHECK(rounded_mean(whole) == i);
        CHECK(rounded_mean(whole + 0.5F) == i + 1);
    }
    CHECK(rounded_mean(255.0F) == 255);
    CHECK(rounded_to_byte(-1e30F) == 0);
    CHECK(rounded_to_byte(255.6F) == 255);
    CHECK(rounded_to_byte(std::numeric_limits<float>::infinity()) == 255);
}
