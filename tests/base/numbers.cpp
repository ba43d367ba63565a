#include <ldi/base/numbers.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

namespace {

float float_of(std::uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

std::uint32_t bits_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

bool is_exact(float a, float b, float c) {
    const float expected = std::fma(a, b, c), found = ldi::detail::fused_multiply_add(a, b, c);
    return std::isnan(expected) ? std::isnan(found) : bits_of(found) == bits_of(expected);
}

}  // namespace

// glibc's std::fma is exact.
TEST_CASE("fused_multiply_add rounds once, as std::fma is defined") {
    std::mt19937 random(4);
    std::size_t wrong = 0;
    const auto check = [&](float a, float b, float c) { wrong += is_exact(a, b, c) ? 0 : 1; };
    const auto any = [&] { return float_of(static_cast<std::uint32_t>(random())); };
    for (int i = 0; i < 300000; ++i) check(any(), any(), any());
    // Sums whose double lies on the middle between two floats, or beside it by less than a double tells.
    const auto mantissa = [&](int exponent) {
        return std::ldexp(static_cast<float>(0x800000 | (random() & 0x7FFFFF)), exponent - 23) *
               (random() % 2 == 0 ? 1.0F : -1.0F);
    };
    for (int i = 0; i < 300000; ++i) {
        const float a = mantissa(0), b = mantissa(0);
        const double product = double{a} * double{b};
        for (int exponent : {-60, -40, -31, -30, -26, -1, 0, 1, 23, 24, 25, 26, 30, 48, 60}) check(a, b, mantissa(exponent));
        check(a, b, static_cast<float>(-product));
        check(1.0F + std::ldexp(1.0F, -12), 1.0F + std::ldexp(1.0F, -12), mantissa(-60));  // a product on a float's middle
        check(std::ldexp(a, -100), std::ldexp(b, -40), mantissa(-149));                    // subnormal results
        check(std::ldexp(a, -75), std::ldexp(b, -75), std::ldexp(mantissa(0), -149));
    }
    const float infinity = std::numeric_limits<float>::infinity(), largest = (std::numeric_limits<float>::max)();
    for (const float a : {0.0F, -0.0F, 1.0F, largest, infinity, -infinity})
        for (const float b : {0.0F, -1.0F, largest, infinity})
            for (const float c : {0.0F, -0.0F, 1.0F, -largest, infinity, -infinity}) check(a, b, c);
    CHECK(wrong == 0);
}
