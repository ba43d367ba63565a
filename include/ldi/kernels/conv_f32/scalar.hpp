// kernels/conv_f32.hpp in portable C++.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/scalar_tiles.hpp>

#include <algorithm>
#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

inline void conv_f32(const conv_f32_data& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    const float slope = weights.negative_slope, lowest = detail::lowest_before(slope);
    const auto store = [=, outputs = weights.outputs, bias = weights.bias.data()](std::size_t p, std::size_t o, float sum) {
        const float value = multiply_add(sum, ratios == nullptr ? 1.0F : ratios[p], bias[o]);
        result[p * outputs + o] = value > 0.0F ? value : (std::max)(value, lowest) * slope;
    };
    compute_tiles(
        {weights.outputs, weights.rows, weights.inputs}, rows, pixel_stride, pixels, weights.values.data(),
        [](std::size_t) { return 0.0F; }, store);
}

}}}  // namespace ldi::scalar
