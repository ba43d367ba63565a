// kernels/conv_f32.hpp in portable C++.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/conv_scalar.hpp>

#include <cstddef>
#include <span>

namespace ldi::inline LDI_CONFIGURATION::scalar {

inline void pack_conv_f32(conv_f32_weights& packed, std::span<const float> weights, std::span<const float> bias) {
    detail::append_conv_panels<1>(packed, weights, bias, conv_panel, 1);
}

inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    conv_by_panels(weights, rows, pixel_stride, pixels, ratios, result);
}

}  // namespace ldi::scalar
