// Requantization in float arithmetic. It returns the same 8-bit values as the integer form of kernels/requantize.hpp, at a third
// of the cost in vector code. The integer form is monotonic and returns at most 256 different values, so at most 255 thresholds
// define it. A float form that agrees with the integer form on both sides of each threshold agrees everywhere. With the exact
// scale and offset, a few thresholds are off by one. Constants that differ from these by a few units in the last place
// reproduce every threshold.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/kernels/requantize.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Adds the zero point to an integral float and clamps to 0..255.
inline std::uint8_t offset_and_clamp(float value, std::int32_t zero_point) {
    const float clamped = (std::min)((std::max)(value, nearest_float(-zero_point)), nearest_float(255 - zero_point));
    return static_cast<std::uint8_t>(static_cast<std::int32_t>(clamped) + zero_point);
}

}  // namespace detail

/// Computes `clamp(trunc(fma(float(acc), scale, acc < 0 ? -offset : offset)) + zero_point)`: one rounding, one truncation.
/// With scale and offset both negated, the form returns for `-acc` what the original form returns for `acc`.
struct float_requantization {
    float scale = 0, offset = 0;
    std::int32_t zero_point = 0;

    std::uint8_t operator()(std::int32_t accumulator) const {
        const float value =
            detail::fused_multiply_add(detail::nearest_float(accumulator), scale, accumulator < 0 ? -offset : offset);
        return detail::offset_and_clamp(std::trunc(value), zero_point);
    }
};

/// The form for machines without a fused multiply-add: `clamp(round_to_even(float(acc) * scale + (acc < 0 ? -offset : offset))
/// + zero_point)`, where first the product and then the sum is rounded to float.
struct unfused_requantization {
    float scale = 0, offset = 0;
    std::int32_t zero_point = 0;

    std::uint8_t operator()(std::int32_t accumulator) const {
        const float product = detail::rounded_product(detail::nearest_float(accumulator), scale);
        return detail::offset_and_clamp(std::nearbyint(product + (accumulator < 0 ? -offset : offset)), zero_point);
    }
};

namespace detail {

/// Lists the accumulators on both sides of every threshold, and the ends of the range of int32.
inline buffer<std::int32_t> requantization_checkpoints(const requantization& r) {
    constexpr std::int32_t lowest = (std::numeric_limits<std::int32_t>::min)(),
                           highest = (std::numeric_limits<std::int32_t>::max)();
    buffer<std::int32_t> points{lowest, highest};
    const auto result_at = [&r](std::int64_t point) { return requantize(static_cast<std::int32_t>(point), r); };
    std::int64_t below = lowest;  // requantizes to less than `value`
    for (int value = requantize(lowest, r) + 1; value <= requantize(highest, r); ++value) {
        // Thresholds are about 1 / scale apart. The search for the next threshold starts at the previous threshold and doubles
        // its step.
        std::int64_t above = below, step = 1;
        while (result_at(above) < value) {
            below = above;
            above = (std::min)(above + step, std::int64_t{highest});
            step *= 2;
        }
        while (above - below > 1) {
            const std::int64_t middle = below + (above - below) / 2;
            (result_at(middle) < value ? below : above) = middle;
        }
        for (const std::int64_t point : {below, above}) points.push_back(static_cast<std::int32_t>(point));
        below = above;
    }
    return points;
}

/// Searches for a float form that agrees with the integer form on every accumulator. Tries constants close to the exact scale
/// and to `offset`.
template <class Form>
std::optional<Form> search_float_form(const requantization& r, double offset) {
    const buffer<std::int32_t> points = requantization_checkpoints(r);
    buffer<std::uint8_t> expected;
    expected.reserve(points.size());
    for (std::int32_t point : points) expected.push_back(requantize(point, r));

    const float scale = static_cast<float>(std::ldexp(nearest_double(r.multiplier), -31 - r.shift));
    const float unit = scale - std::nextafter(scale, 0.0F);
    std::size_t suspect = 0;  // the point at which the last candidate failed; testing it first rejects most candidates
    for (int offset_step = 0; offset_step <= 128; ++offset_step)
        for (int scale_step = -3; scale_step <= 3; ++scale_step) {
            const int signed_step = offset_step % 2 == 0 ? offset_step / 2 : -(offset_step + 1) / 2;
            const Form candidate{scale + nearest_float(scale_step) * unit,
                                 static_cast<float>(offset + std::ldexp(signed_step, -22)), r.zero_point};
            if (candidate(points[suspect]) != expected[suspect]) continue;
            std::size_t i = 0;
            while (i < points.size() && candidate(points[i]) == expected[i]) ++i;
            if (i == points.size()) return candidate;
            suspect = i;
        }
    return std::nullopt;
}

/// Returns the distance by which the first of the integer form's two roundings moves the thresholds toward zero; 0 for a shift
/// of 0, because the integer form then rounds only once.
inline double threshold_shift(const requantization& r) { return r.shift == 0 ? 0.0 : std::ldexp(1.0, -r.shift - 1); }

}  // namespace detail

/// Returns the float form, or std::nullopt if no form near the exact scale agrees with the integer form on every accumulator.
inline std::optional<float_requantization> find_float_requantization(const requantization& r) {
    return detail::search_float_form<float_requantization>(r, 0.5 + detail::threshold_shift(r));
}

/// The same for the form without fused multiply-add.
inline std::optional<unfused_requantization> find_unfused_requantization(const requantization& r) {
    return detail::search_float_form<unfused_requantization>(r, detail::threshold_shift(r));
}

}}  // namespace ldi
