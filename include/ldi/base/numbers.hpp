// Conversions between number types, with descriptive names, and mathematical functions that return the same result on every
// machine. C libraries round the results of these functions differently, so ldi computes them with operations whose rounding
// IEEE 754 defines.
#pragma once

#include <ldi/base/config.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Converts an integer to the nearest float: exact up to 2^24, far beyond the width and height of any practical image.
template <std::integral Integer>
constexpr float nearest_float(Integer n) {
    return static_cast<float>(n);
}

/// Converts an integer to the nearest double: exact up to 2^53.
template <std::integral Integer>
constexpr double nearest_double(Integer n) {
    return static_cast<double>(n);
}

/// Rounds to the nearest integer, halves away from zero, for values below 2^53. Some C libraries' lround() rounds the largest
/// number below 0.5 to 1.
constexpr std::int64_t nearest_whole(double value) {
    const auto whole = static_cast<std::int64_t>(value);
    const double rest = value - static_cast<double>(whole);  // exact
    return rest >= 0.5 ? whole + 1 : rest <= -0.5 ? whole - 1 : whole;
}

/// Returns n / 2, rounded up, for n of 0 or more. (n + 1) / 2 would overflow at the largest size.
constexpr std::int32_t half_rounded_up(std::int32_t n) { return n / 2 + n % 2; }

/// Rounds to the nearest byte, halves up, and clamps. NaN becomes 0.
inline std::uint8_t rounded_to_byte(float value) {
    const float clamped = value > 0.0F ? (std::min)(value, 255.0F) : 0.0F;
    const auto whole = static_cast<std::int32_t>(clamped);
    return static_cast<std::uint8_t>(whole + (clamped - nearest_float(whole) >= 0.5F ? 1 : 0));  // the difference is exact
}

/// Rounds to the nearest byte for values between 0 and 255, such as means of bytes. Just below a half, the sum `mean + 0.5F` may
/// itself round up: 0.49999997 becomes 1.
constexpr std::uint8_t rounded_mean(float mean) { return static_cast<std::uint8_t>(mean + 0.5F); }

/// Returns the bits of an IEEE 754 float, and the float with given bits. std::bit_cast is missing in Emscripten 3.1.6.
inline std::uint32_t bits_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}
inline float float_of(std::uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// Returns a * b + c with one rounding, as std::fma does. Some C libraries (MinGW's) round std::fma wrongly, and results must
/// not depend on that.
inline float fused_multiply_add(float a, float b, float c) {
#if defined(__FMA__) || defined(__aarch64__)
    return std::fma(a, b, c);  // one instruction
#else
    // The product is exact in double precision. The sum is rounded to odd, so that the second rounding, to float, is correct (S.
    // Boldo and G. Melquiond, "Emulation of a FMA and correctly rounded sums: proved algorithms using rounding to odd", 2008).
    const double product = double{a} * double{b}, sum = product + double{c};
    const double share_of_c = sum - product;
    const double error = (product - (sum - share_of_c)) + (double{c} - share_of_c);  // exact (Knuth's TwoSum)
    if (!(error < 0.0 || error > 0.0) || !std::isfinite(sum)) return static_cast<float>(sum);
    std::uint64_t bits;
    std::memcpy(&bits, &sum, sizeof bits);
    if (bits % 2 == 0) bits += (error > 0.0) == (sum > 0.0) ? std::uint64_t{1} : ~std::uint64_t{0};
    double odd;
    std::memcpy(&odd, &bits, sizeof odd);
    return static_cast<float>(odd);
#endif
}

/// Returns a * b, rounded, for sums of products that must be the same on every machine. By default, GCC and clang compile
/// a * b + c to a fused multiply-add on machines that have one. A fused multiply-add rounds only once, so the last bit of the
/// sum may differ.
///
/// a, b  floats or doubles; with the extensions of GCC and clang, also vectors (base/four_floats.hpp)
template <class Real>
Real rounded_product(Real a, Real b) noexcept {
#if (defined(_MSC_VER) && !defined(__clang__)) || defined(__wasm__) || \
    ((defined(__x86_64__) || defined(__i386__)) && !defined(__FMA__) && !defined(__FMA4__))
    return a * b;  // not fused: MSVC fuses only with /fp:fast or /fp:contract, and the other targets have no fused multiply-add
#elif LDI_HAS_EXTENSIONS
    // The compiler must assume that the empty assembly changes the product.
    Real product = a * b;
#if defined(__x86_64__) || defined(__i386__)
    asm("" : "+x"(product));
#elif defined(__aarch64__)
    asm("" : "+w"(product));
#else
    asm("" : "+m"(product));
#endif
    return product;
#else
    const volatile Real product = a * b;
    return product;
#endif
}

/// Length of a vector. The squares are exact. Their sum and the square root of the sum are rounded in double precision, the
/// same on every machine.
inline float vector_length(float x, float y) {
    return static_cast<float>(std::sqrt(double{x} * double{x} + double{y} * double{y}));
}

/// Natural logarithm of a positive, finite number, computed to 1e-14 in double precision and then rounded, the same on every
/// machine.
inline float natural_logarithm(float x) {
    int exponent = 0;
    double mantissa = std::frexp(double{x}, &exponent);
    if (mantissa < 0.70710678118654752) mantissa *= 2, --exponent;
    // log(m) = 2 artanh(s), a series of odd powers of s. Since s^2 <= 0.0295, terms after s^19 are below 1e-15.
    const double s = (mantissa - 1) / (mantissa + 1), square = s * s;
    double sum = 0;
    for (int power = 19; power >= 1; power -= 2) sum = rounded_product(sum, square) + 2.0 / power;
    return static_cast<float>(rounded_product(nearest_double(exponent), 0.69314718055994531) + rounded_product(s, sum));
}

}}}  // namespace ldi::detail
