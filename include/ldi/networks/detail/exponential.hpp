// exp() in float with the same bits on every machine: it uses only operations whose results IEEE 754 defines exactly. The method
// is NumPy's (reduction by ln 2 in two parts, then a rational function), because the published disparity of Tiefenrausch was
// computed with NumPy.
#pragma once

#include <ldi/base/numbers.hpp>

#include <cmath>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Returns exp(x) within 3 units in the last place.
///
/// x  in [-87, 88]
inline float exponential(float x) {
    const float power = std::nearbyint(x * 1.442695040888963407F);
    float r = fused_multiply_add(power, -6.93145752e-1F, x);
    r = fused_multiply_add(power, -1.42860677e-6F, r);
    float numerator = 5.082762527590693718096e-04F;
    for (float coefficient : {6.757896990527504603057e-03F, 5.114512081637298353406e-02F, 2.473615434895520810817e-01F,
                              7.257664613233124478488e-01F, 9.999999999980870924916e-01F})
        numerator = fused_multiply_add(numerator, r, coefficient);
    float denominator = 2.159509375685829852307e-02F;
    for (float coefficient : {-2.742335390411667452936e-01F, 1.000000000000000000000e+00F})
        denominator = fused_multiply_add(denominator, r, coefficient);
    return std::ldexp(numerator / denominator, static_cast<int>(power));
}

}}}  // namespace ldi::detail
