#include <ldi/base/four_floats.hpp>
#include <ldi/base/numbers.hpp>

#include <catch2/catch.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

using namespace ldi::detail;

TEST_CASE("nearest_float() and nearest_double() convert an integer to the nearest floating-point number") {
    STATIC_REQUIRE(nearest_float(-3) == -3.0F);
    STATIC_REQUIRE(nearest_float(std::size_t{1} << 24) == 16777216.0F);
    STATIC_REQUIRE(nearest_float((1 << 24) + 3) == 16777220.0F);
    STATIC_REQUIRE(nearest_double((std::int64_t{1} << 53) - 1) == 9007199254740991.0);
}

TEST_CASE("conversion to a byte rounds to the nearest integer, halves up, and clamps to the range from 0 to 255") {
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
    CHECK(rounded_to_byte(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("fused_multiply_add() rounds once, even if rounding to double first would change the result") {
    // The product is 2^-24 + 2^-57. Rounded to double, the sum 1 + 2^-24 + 2^-57 is 1 + 2^-24, a tie between two floats, which
    // would round down.
    const float a = 20857.0F, b = std::ldexp(411849.0F, -57);
    CHECK(fused_multiply_add(0x1p-30F, 0x1p-30F, 1.0F) == 1.0F);
    CHECK(fused_multiply_add(a, b, 1.0F) == 1.0F + 0x1p-23F);
    CHECK(fused_multiply_add(-a, b, -1.0F) == -1.0F - 0x1p-23F);
    CHECK(fused_multiply_add(3.0F, -2.0F, 6.0F) == 0.0F);
    CHECK(fused_multiply_add(0x1p-75F, 0x1p-75F, 0.0F) == 0.0F);
    CHECK(fused_multiply_add(0x1.8p-75F, 0x1p-75F, 0.0F) == std::numeric_limits<float>::denorm_min());
    CHECK(std::isnan(fused_multiply_add(std::numeric_limits<float>::infinity(), 0.0F, 1.0F)));
    CHECK(std::isinf(fused_multiply_add(std::numeric_limits<float>::infinity(), 1.0F, 1.0F)));
}

TEST_CASE("the compiler does not fuse rounded_product() with a sum") {
    std::mt19937 random(6);
    int different = 0, different_doubles = 0;
    for (int i = 0; i < 10000; ++i) {
        const float a = nearest_float(1 + (random() & 0xFFFFFFU)), b = nearest_float(1 + (random() & 0xFFFFFFU));
        const volatile float product = a * b;
        different += rounded_product(a, b) - product != 0.0F;
        different += rounded_product(lanes::four_floats{} + a, lanes::four_floats{} + b)[3] - product != 0.0F;
        const double c = 1.0 / double{a}, d = 1.0 / double{b};
        const volatile double double_product = c * d;
        different_doubles += rounded_product(c, d) - double_product != 0.0;
    }
    CHECK(different == 0);
    CHECK(different_doubles == 0);
}

// glibc's functions are the reference: std::fma is exact, and the others return the float nearest to their result in double.
#if defined(__GLIBC__)
TEST_CASE("fused_multiply_add(), vector_length() and natural_logarithm() match glibc bit for bit") {
    std::mt19937 random(5);
    const auto any = [&] { return std::bit_cast<float>(static_cast<std::uint32_t>(random())); };
    const auto same = [](float x, float y) {
        return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y) || (std::isnan(x) && std::isnan(y));
    };
    int different_sums = 0, different_lengths = 0, different_logarithms = 0;
    for (int i = 0; i < 1000000; ++i) {
        float a = any(), b = any(), c = any();
        different_sums += !same(fused_multiply_add(a, b, c), std::fma(a, b, c));
        different_lengths += std::isfinite(a) && std::isfinite(b) && !same(vector_length(a, b), std::hypot(a, b));
        if (const float x = std::abs(c); x > 0 && std::isfinite(x))
            different_logarithms += !same(natural_logarithm(x), static_cast<float>(std::log(double{x})));

        // Sums near or on the midpoint between two floats.
        a = std::ldexp(nearest_float(1 + (random() & 0xFFFFFFU)), static_cast<int>(random() % 20) - 10);
        b = std::ldexp(nearest_float(1 + (random() & 0xFFFFFFU)), -24);
        c = std::ldexp(a * b, static_cast<int>(random() % 64) - 32) * (random() % 2 == 0 ? 1.0F : -1.0F);
        different_sums += !same(fused_multiply_add(a, b, c), std::fma(a, b, c));
        different_sums += !same(fused_multiply_add(a, b, -(a * b)), std::fma(a, b, -(a * b)));
        c = std::ldexp(1.0F, static_cast<int>(random() % 120) - 60);
        different_sums += !same(fused_multiply_add(a, b, c), std::fma(a, b, c));
    }
    CHECK(different_sums == 0);
    CHECK(different_lengths == 0);
    CHECK(different_logarithms == 0);
}
#endif

// glibc's std::fma is exact.
#if defined(__GLIBC__)
namespace {

bool is_exact(float a, float b, float c) {
    const float expected = std::fma(a, b, c), found = fused_multiply_add(a, b, c);
    return std::isnan(expected) ? std::isnan(found) : bits_of(found) == bits_of(expected);
}

}  // namespace

TEST_CASE("fused_multiply_add() matches glibc's std::fma() near ties, for subnormal results and for infinities") {
    std::mt19937 random(4);
    std::size_t wrong = 0;
    const auto check = [&](float a, float b, float c) { wrong += is_exact(a, b, c) ? std::size_t{0} : std::size_t{1}; };
    const auto any = [&] { return float_of(static_cast<std::uint32_t>(random())); };
    for (int i = 0; i < 300000; ++i) check(any(), any(), any());
    // Sums on the midpoint between two floats, or so close to it that a double cannot represent the difference.
    const auto mantissa = [&](int exponent) {
        return std::ldexp(static_cast<float>(0x800000 | (random() & 0x7FFFFF)), exponent - 23) *
               (random() % 2 == 0 ? 1.0F : -1.0F);
    };
    for (int i = 0; i < 300000; ++i) {
        const float a = mantissa(0), b = mantissa(0);
        const double product = double{a} * double{b};
        for (int exponent : {-60, -40, -31, -30, -26, -1, 0, 1, 23, 24, 25, 26, 30, 48, 60}) check(a, b, mantissa(exponent));
        check(a, b, static_cast<float>(-product));
        // a product on the midpoint between two floats
        check(1.0F + std::ldexp(1.0F, -12), 1.0F + std::ldexp(1.0F, -12), mantissa(-60));
        check(std::ldexp(a, -100), std::ldexp(b, -40), mantissa(-149));  // subnormal results
        check(std::ldexp(a, -75), std::ldexp(b, -75), std::ldexp(mantissa(0), -149));
    }
    const float infinity = std::numeric_limits<float>::infinity(), largest = (std::numeric_limits<float>::max)();
    for (const float a : {0.0F, -0.0F, 1.0F, largest, infinity, -infinity})
        for (const float b : {0.0F, -1.0F, largest, infinity})
            for (const float c : {0.0F, -0.0F, 1.0F, -largest, infinity, -infinity}) check(a, b, c);
    CHECK(wrong == 0);
}
#endif
