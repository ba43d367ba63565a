// Exact integer requantization to 8 bits. It converts an int32 accumulator (a sum of products) or the sum of two 8-bit tensors.
// The arithmetic is that of QNNPACK, the engine of the published depth network, so results equal the published ones bit for bit.
// Every instruction set must return the values of these functions.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/numbers.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Meaning of an 8-bit value q: `(q - zero_point) * scale`.
struct quantization {
    float scale = 1;
    std::uint8_t zero_point = 0;

    friend bool operator==(const quantization&, const quantization&) = default;
};

/// Constants of the conversion from an int32 accumulator to 8 bits: multiplies by `multiplier * 2^-31 * 2^-shift`, adds the
/// zero point, clamps to 0..255.
struct requantization {
    std::int32_t multiplier = 0;  ///< 24 significant bits, in [2^30, 2^31)
    std::int32_t shift = 0;       ///< 0..31
    std::int32_t zero_point = 0;  ///< 0..255
};

/// Constants of the addition of two 8-bit tensors with an 8-bit result.
struct quantized_addition {
    std::int32_t a_multiplier = 0, b_multiplier = 0;  ///< 0..2^22, the larger at least 2^21
    std::int32_t bias = 0;                            ///< subtracts both zero points
    std::int32_t shift = 0;                           ///< 14..31
    std::int32_t zero_point = 0;                      ///< 0..255
};

namespace detail {

inline std::int32_t biased_exponent(float value) { return static_cast<std::int32_t>((bits_of(value) >> 23) & 0xFF); }

/// Returns value / 2^shift, rounded to nearest, halves away from zero.
///
/// shift  0..31
inline std::int32_t rounding_shift(std::int32_t value, std::int32_t shift) {
    const std::int32_t mask = static_cast<std::int32_t>((std::uint32_t{1} << shift) - 1);
    const std::int32_t remainder = (value & mask) - (value < 0 ? 1 : 0);
    return (value >> shift) + (remainder > (mask >> 1) ? 1 : 0);
}

inline std::uint8_t offset_and_clamp(std::int32_t value, std::int32_t zero_point) {
    return static_cast<std::uint8_t>(std::clamp(value, -zero_point, 255 - zero_point) + zero_point);
}

}  // namespace detail

/// Whether make_requantization() accepts this scale: it must be in [2^-32, 1).
inline bool is_requantization_scale(float scale) { return scale >= 0x1p-32F && scale < 1.0F; }

/// Computes the integer form of a scale.
///
/// scale  input scale * weight scale / output scale, computed in float; in [2^-32, 1)
inline requantization make_requantization(float scale, std::uint8_t zero_point) {
    LDI_ASSERT(is_requantization_scale(scale));
    const std::uint32_t mantissa = (detail::bits_of(scale) & 0x007FFFFF) | 0x00800000;
    return {static_cast<std::int32_t>(mantissa << 7), 126 - detail::biased_exponent(scale), zero_point};
}

/// Converts a sum to a byte: multiplies and rounds halves up, shifts and rounds halves away from zero, adds the zero point, and
/// clamps.
inline std::uint8_t requantize(std::int32_t accumulator, const requantization& r) {
    const std::int64_t product = std::int64_t{accumulator} * r.multiplier;
    const std::int32_t high = static_cast<std::int32_t>((product + (std::int64_t{1} << 30)) >> 31);
    return detail::offset_and_clamp(detail::rounding_shift(high, r.shift), r.zero_point);
}

/// Whether make_quantized_addition() accepts these ratios of input scale to output scale: both positive, the larger in
/// [2^-10, 2^8).
inline bool are_addition_ratios(float a_ratio, float b_ratio) {
    const float larger = (std::max)(a_ratio, b_ratio);
    return a_ratio > 0 && b_ratio > 0 && larger >= 0x1p-10F && larger < 0x1p8F;
}

/// Computes the constants of `y = a + b`, where each tensor has its own quantization. are_addition_ratios() must accept the
/// ratios of the scales.
inline quantized_addition make_quantized_addition(quantization a, quantization b, quantization y) {
    const float a_ratio = a.scale / y.scale, b_ratio = b.scale / y.scale;
    LDI_ASSERT(are_addition_ratios(a_ratio, b_ratio));
    const std::int32_t shift = 21 - (detail::biased_exponent((std::max)(a_ratio, b_ratio)) - 127);
    quantized_addition result;
    result.a_multiplier = static_cast<std::int32_t>(std::lrint(std::ldexp(a_ratio, shift)));
    result.b_multiplier = static_cast<std::int32_t>(std::lrint(std::ldexp(b_ratio, shift)));
    result.bias = -(result.a_multiplier * a.zero_point + result.b_multiplier * b.zero_point);
    result.shift = shift;
    result.zero_point = y.zero_point;
    return result;
}

/// Adds two bytes of different quantizations. The result is rounded, halves away from zero, and clamped.
inline std::uint8_t add_quantized(std::uint8_t a, std::uint8_t b, const quantized_addition& r) {
    const std::int32_t sum = r.bias + a * r.a_multiplier + b * r.b_multiplier;
    return detail::offset_and_clamp(detail::rounding_shift(sum, r.shift), r.zero_point);
}

}}  // namespace ldi
