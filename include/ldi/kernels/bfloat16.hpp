// bfloat16: the upper half of a float32, that is its sign, its exponent and 8 significant bits.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdint>
#include <cstring>

namespace ldi::inline LDI_CONFIGURATION {

struct bfloat16 {
    std::uint16_t bits = 0;

    friend bool operator==(bfloat16, bfloat16) = default;
};

constexpr float to_float(float value) { return value; }
inline float to_float(bfloat16 value) {
    const std::uint32_t bits = std::uint32_t{value.bits} << 16;
    float result = 0.0F;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}

/// The nearest one, of two the even one; within 2^-9 of the value. What is not a number may become infinite.
inline bfloat16 to_bfloat16(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return {static_cast<std::uint16_t>((bits + 0x7FFFU + (bits >> 16 & 1U)) >> 16)};
}

}  // namespace ldi
