// kernels/conv_u8.hpp in portable C++.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/scalar_tiles.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

/// Converts a sum, from which the zero points are already subtracted, to a result.
template <class Result>
inline Result finish_conv_u8(std::int32_t sum, float scale, float bias, float negative_slope, float zero_point) {
    const float value =
        (std::max)(detail::fused_multiply_add(detail::nearest_float(sum), scale, bias), detail::lowest_before(negative_slope));
    // The multiply-add is fused on every machine, so that the result does not depend on the compiler.
    const float activated = value > 0.0F ? value + zero_point : detail::fused_multiply_add(value, negative_slope, zero_point);
    if constexpr (std::is_same_v<Result, float>)
        return activated;
    else
        return activated > 0.0F ? static_cast<Result>(std::nearbyint((std::min)(activated, 255.0F))) : Result{0};  // 0 for NaN
}

/// Same parameters as conv_u8() of kernels/conv_u8.hpp.
///
/// Result  float or std::uint8_t
template <class Result>
void conv_u8(const conv_u8_data& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const auto store = [out = detail::conv_u8_panel_output<Result>(weights, ratios, result)](std::size_t p, std::size_t o,
                                                                                             std::int32_t sum) {
        const float scale = out.scales[o] * (out.ratios == nullptr ? 1.0F : out.ratios[p]);
        out.values[p * out.stride + o] =
            finish_conv_u8<Result>(sum + out.offsets[o], scale, out.bias[o], out.negative_slope, out.zero_point);
    };
    compute_tiles(
        {weights.outputs, weights.rows, weights.inputs}, rows, pixel_stride, pixels, weights.values.data(),
        [](std::size_t) { return std::int32_t{0}; }, store);
}

}}}  // namespace ldi::scalar
