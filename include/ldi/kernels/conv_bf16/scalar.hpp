// kernels/conv_bf16.hpp in portable C++.
#pragma once

#include <ldi/kernels/conv_bf16/contract.hpp>
#include <ldi/kernels/detail/conv_scalar.hpp>

#include <cstddef>
#include <span>

namespace ldi::inline LDI_CONFIGURATION::scalar {

inline void pack_conv_bf16(conv_bf16_weights& packed, std::span<const bfloat16> weights, std::span<const float> bias) {
    detail::append_conv_panels<1>(packed, weights, bias, conv_panel, 1);
}

template <class Result>
void conv_bf16(const conv_bf16_weights& weights, const bfloat16* const* rows, std::size_t pixel_stride, std::size_t pixels,
               const float* ratios, Result* result) {
    conv_by_panels(weights, rows, pixel_stride, pixels, ratios, result);
}

}  // namespace ldi::scalar
