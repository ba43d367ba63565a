// Conversions between kinds of numbers, by names that say what becomes of the value.
#pragma once

#include <ldi/base/config.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// An integer as the float nearest to it: itself up to 2^24, which holds every coordinate and length of an image.
template <std::integral Integer>
constexpr float nearest_float(Integer n) {
    return static_cast<float>(n);
}

/// The same in double precision: itself up to 2^53.
template <std::integral Integer>
constexpr double nearest_double(Integer n) {
    return static_cast<double>(n);
}

/// The nearest byte; of two that are equally near, the larger.
inline std::uint8_t rounded_to_byte(float value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 255.0F)));
}

/// The same for values that lie between 0 and 255, such as means of bytes, up to the rounding of the one addition that it takes.
constexpr std::uint8_t rounded_mean(float mean) { return static_cast<std::uint8_t>(mean + 0.5F); }

}}}  // namespace ldi::detail
