// Contract of the kernels of kernels/conv_f32.hpp: their inputs and results.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/prepared.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Activation after the bias: x if x is positive, else negative_slope * x.
struct activation {
    float negative_slope;  ///< 0 to 1
};
inline constexpr activation no_activation{1.0F};
inline constexpr activation relu{0.0F};
constexpr activation leaky_relu(float negative_slope) { return {negative_slope}; }

/// The weights of one layer in the order in which its kernel reads them.
struct conv_f32_data {
    using value_type = float;
    template <class Result>
    using panel_output = detail::conv_panel_output<Result>;

    static constexpr float result_zero_point = 0.0F;  ///< as in conv_u8_data

    isa target = isa::scalar;
    std::size_t rows = 0, inputs = 0, outputs = 0;
    float negative_slope = 1.0F;
    buffer<float> values;
    buffer<float> bias;  ///< padded with zeros to whole panels
};

/// Made by pack_conv_f32().
using conv_f32_weights = prepared<conv_f32_data>;

/// One instruction set's kernel: a row of `conv_f32_kernels`.
struct conv_f32_kernel {
    isa set;
    detail::panel_layout layout;
    /// Same parameters as conv_f32() of kernels/conv_f32.hpp.
    void (*run)(const conv_f32_data& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                const float* ratios, float* result);
};

}}  // namespace ldi
