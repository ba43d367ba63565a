// Packed weights of kernels/conv_f32.hpp and the activation after a convolution.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/isa.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Activation after the bias: x if x is positive, else negative_slope * x.
struct activation {
    float negative_slope;  ///< 0 to 1
};
inline constexpr activation no_activation{1.0F};
inline constexpr activation relu{0.0F};
constexpr activation leaky_relu(float negative_slope) { return {negative_slope}; }

/// The weights of one layer in the order in which its kernel reads them. Valid only if pack_conv_f32() made them.
struct conv_f32_weights {
    using value_type = float;
    template <class Result>
    using panel_output = detail::conv_panel_output<Result>;

    static constexpr float result_zero_point = 0.0F;  ///< as in conv_u8_weights

    isa target = isa::scalar;
    std::size_t rows = 1, inputs = 0, outputs = 0;
    float negative_slope = 1.0F;
    buffer<float> values;
    buffer<float> bias;  ///< padded with zeros to whole panels
};

}}  // namespace ldi
