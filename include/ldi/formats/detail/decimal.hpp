// Writes a number in decimal with as few digits as read back to the same number, whatever the locale: Grisu2 of Florian Loitsch,
// "Printing Floating-Point Numbers Quickly and Accurately with Integers" (PLDI 2010). The digits are those of nlohmann/json,
// whose way of rounding at ties it keeps. std::to_chars is not in every standard library that ldi is compiled with.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// significand * 2^exponent
struct binary_number {
    std::uint64_t significand;
    int exponent;
};

/// The upper 64 bits of the product, rounded half up.
inline binary_number product(binary_number a, binary_number b) {
    const std::uint64_t a_low = a.significand & 0xFFFFFFFF, a_high = a.significand >> 32;
    const std::uint64_t b_low = b.significand & 0xFFFFFFFF, b_high = b.significand >> 32;
    const std::uint64_t outer = a_low * b_high, inner = a_high * b_low;
    const std::uint64_t middle = (a_low * b_low >> 32) + (outer & 0xFFFFFFFF) + (inner & 0xFFFFFFFF) + (std::uint64_t{1} << 31);
    return {a_high * b_high + (outer >> 32) + (inner >> 32) + (middle >> 32), a.exponent + b.exponent + 64};
}

/// The significands of 10^-300, 10^-292, ... 10^324, rounded to 64 bits.
inline constexpr std::uint64_t powers_of_ten[] = {
    0xAB70FE17C79AC6CA, 0xFF77B1FCBEBCDC4F, 0xBE5691EF416BD60C, 0x8DD01FAD907FFC3C, 0xD3515C2831559A83, 0x9D71AC8FADA6C9B5,
    0xEA9C227723EE8BCB, 0xAECC49914078536D, 0x823C12795DB6CE57, 0xC21094364DFB5637, 0x9096EA6F3848984F, 0xD77485CB25823AC7,
    0xA086CFCD97BF97F4, 0xEF340A98172AACE5, 0xB23867FB2A35B28E, 0x84C8D4DFD2C63F3B, 0xC5DD44271AD3CDBA, 0x936B9FCEBB25C996,
    0xDBAC6C247D62A584, 0xA3AB66580D5FDAF6, 0xF3E2F893DEC3F126, 0xB5B5ADA8AAFF80B8, 0x87625F056C7C4A8B, 0xC9BCFF6034C13053,
    0x964E858C91BA2655, 0xDFF9772470297EBD, 0xA6DFBD9FB8E5B88F, 0xF8A95FCF88747D94, 0xB94470938FA89BCF, 0x8A08F0F8BF0F156B,
    0xCDB02555653131B6, 0x993FE2C6D07B7FAC, 0xE45C10C42A2B3B06, 0xAA242499697392D3, 0xFD87B5F28300CA0E, 0xBCE5086492111AEB,
    0x8CBCCC096F5088CC, 0xD1B71758E219652C, 0x9C40000000000000, 0xE8D4A51000000000, 0xAD78EBC5AC620000, 0x813F3978F8940984,
    0xC097CE7BC90715B3, 0x8F7E32CE7BEA5C70, 0xD5D238A4ABE98068, 0x9F4F2726179A2245, 0xED63A231D4C4FB27, 0xB0DE65388CC8ADA8,
    0x83C7088E1AAB65DB, 0xC45D1DF942711D9A, 0x924D692CA61BE758, 0xDA01EE641A708DEA, 0xA26DA3999AEF774A, 0xF209787BB47D6B85,
    0xB454E4A179DD1877, 0x865B86925B9BC5C2, 0xC83553C5C8965D3D, 0x952AB45CFA97A0B3, 0xDE469FBD99A05FE3, 0xA59BC234DB398C25,
    0xF6C69A72A3989F5C, 0xB7DCBF5354E9BECE, 0x88FCF317F22241E2, 0xCC20CE9BD35C78A5, 0x98165AF37B2153DF, 0xE2A0B5DC971F303A,
    0xA8D9D1535CE3B396, 0xFB9B7CD9A4A7443C, 0xBB764C4CA7A44410, 0x8BAB8EEFB6409C1A, 0xD01FEF10A657842C, 0x9B10A4E5E9913129,
    0xE7109BFBA19C0C9D, 0xAC2820D9623BF429, 0x80444B5E7AA7CF85, 0xBF21E44003ACDD2D, 0x8E679C2F5E44FF8F, 0xD433179D9C8CB841,
    0x9E19DB92B4E31BA9,
};

/// Digits of a number: 0.d1d2d3... * 10^point
struct decimal_digits {
    char digits[20];
    int count = 0, point = 0;
};

/// Moves the last digit down while that leads nearer to the number, which lies `distance` below the upper bound of what reads
/// back as it. All four are in units of the last place of the scaled number; `interval` is the width of what reads back.
inline void round_last_digit(decimal_digits& result, std::uint64_t distance, std::uint64_t interval, std::uint64_t rest,
                             std::uint64_t unit) {
    while (rest < distance && interval - rest >= unit && (rest + unit < distance || distance - rest > rest + unit - distance)) {
        --result.digits[result.count - 1];
        rest += unit;
    }
}

/// Digits of `upper`, until what is left lies inside `interval`. The exponent of `upper` is -60 to -32; decimal  of the power of
/// ten that it is to be multiplied by.
inline decimal_digits shortest_within(binary_number upper, std::uint64_t distance, std::uint64_t interval, int decimal) {
    const int fraction_bits = -upper.exponent;
    std::uint64_t whole = upper.significand >> fraction_bits;
    std::uint64_t fraction = upper.significand & ((std::uint64_t{1} << fraction_bits) - 1);
    std::uint64_t power = 1;
    int left = 1;
    for (; whole / power >= 10; power *= 10) ++left;

    decimal_digits result;
    result.point = decimal + left;
    const auto put = [&](std::uint64_t digit) { result.digits[result.count++] = static_cast<char>('0' + digit); };
    for (; left > 0; --left, power /= 10) {
        put(whole / power);
        whole %= power;
        const std::uint64_t rest = (whole << fraction_bits) + fraction;
        if (rest <= interval) {
            round_last_digit(result, distance, interval, rest, power << fraction_bits);
            return result;
        }
    }
    do {
        fraction *= 10, interval *= 10, distance *= 10;
        put(fraction >> fraction_bits);
        fraction &= (std::uint64_t{1} << fraction_bits) - 1;
    } while (fraction > interval);
    round_last_digit(result, distance, interval, fraction, std::uint64_t{1} << fraction_bits);
    return result;
}

/// value  finite, above 0
inline decimal_digits shortest_digits(double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    const std::uint64_t hidden_bit = std::uint64_t{1} << 52, fraction = bits & (hidden_bit - 1);
    const int biased = static_cast<int>(bits >> 52);
    const binary_number exact =
        biased == 0 ? binary_number{fraction, -1074} : binary_number{fraction + hidden_bit, biased - 1075};

    // Everything between the middles to the neighbors reads back as the value. Below a power of two they are closer.
    const bool is_closer_below = fraction == 0 && biased > 1;
    binary_number high{2 * exact.significand + 1, exact.exponent - 1}, middle = exact;
    binary_number low{(is_closer_below ? 4 : 2) * exact.significand - 1, exact.exponent - (is_closer_below ? 2 : 1)};
    while (high.significand >> 63 == 0) high.significand <<= 1, --high.exponent;
    low.significand <<= low.exponent - high.exponent, low.exponent = high.exponent;
    middle.significand <<= middle.exponent - high.exponent, middle.exponent = high.exponent;

    // The power of ten that brings the exponent to -60 to -32, where the digits before the point fit into 32 bits.
    const int needed = -61 - high.exponent;
    const int smallest = (needed * 78913) / (1 << 18) + (needed > 0 ? 1 : 0);
    const int index = (300 + smallest + 7) / 8, decimal = 8 * index - 300;
    const binary_number power{powers_of_ten[index], (decimal * 217706 >> 16) - 63};
    low = product(low, power), middle = product(middle, power), high = product(high, power);
    // The products are off by at most one unit.
    ++low.significand, --high.significand;
    return shortest_within(high, high.significand - middle.significand, high.significand - low.significand, -decimal);
}

/// Appends a number as nlohmann/json writes it: 1.5, 100.0, 0.001, 1e-05. value  finite
inline void append_decimal(buffer<char>& to, double value) {
    LDI_ASSERT(std::isfinite(value));
    const auto put = [&](std::string_view text) { to.append(text.begin(), text.end()); };
    if (std::signbit(value)) put("-");
    if (std::fpclassify(value) == FP_ZERO) return put("0.0");
    const decimal_digits found = shortest_digits(std::fabs(value));
    const std::string_view digits(found.digits, static_cast<std::size_t>(found.count));
    const auto zeros = [&](int count) { to.resize(to.size() + static_cast<std::size_t>(count), '0'); };
    if (found.point > 15 || found.point <= -4) {
        put(digits.substr(0, 1));
        if (found.count > 1) put("."), put(digits.substr(1));
        const int exponent = found.point - 1, size = exponent < 0 ? -exponent : exponent;
        put(exponent < 0 ? "e-" : "e+");
        const auto put_digit = [&](int digit) { to.push_back(static_cast<char>('0' + digit)); };
        if (size >= 100) put_digit(size / 100);
        put_digit(size / 10 % 10), put_digit(size % 10);
    } else if (found.point <= 0) {
        put("0."), zeros(-found.point), put(digits);
    } else if (found.point >= found.count) {
        put(digits), zeros(found.point - found.count), put(".0");
    } else {
        const std::size_t whole = static_cast<std::size_t>(found.point);
        put(digits.substr(0, whole)), put("."), put(digits.substr(whole));
    }
}

}}}  // namespace ldi::detail
