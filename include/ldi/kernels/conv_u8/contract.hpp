// Contract of the kernels of kernels/conv_u8.hpp: their inputs and results.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/prepared.hpp>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Maximum absolute value of a weight. The sum of two products with unsigned bytes then fits in 16 bits, as AVX2's vpmaddubsw
/// requires.
inline constexpr std::int32_t max_conv_u8_weight = 63;
/// Maximum number of inputs per output over all pieces, so that sums fit in 32 bits.
inline constexpr std::size_t max_conv_u8_inputs = std::size_t{1} << 17;

namespace detail {
template <class Result>
struct conv_u8_panel_output;
}

/// The weights of one layer in the order in which conv_u8() reads them.
struct conv_u8_data {
    using value_type = std::uint8_t;  ///< type of the inputs
    template <class Result>
    using panel_output = detail::conv_u8_panel_output<Result>;

    isa target = isa::scalar;
    std::size_t rows = 0, inputs = 0, outputs = 0;
    float negative_slope = 1.0F;
    std::uint8_t result_zero_point = 0;
    buffer<std::int8_t> values;
    buffer<std::int32_t> offsets;  ///< summands that subtract the zero points; padded to whole panels, like scales and bias
    buffer<float> scales, bias;
};

/// Made by pack_conv_u8().
using conv_u8_weights = prepared<conv_u8_data>;

/// One instruction set's kernel: a row of `conv_u8_kernels`.
struct conv_u8_kernel {
    isa set;
    detail::panel_layout layout;
    std::int32_t subtrahend;  ///< value that the kernel subtracts from all inputs
    /// Same parameters as conv_u8() of kernels/conv_u8.hpp; results are bytes in run(), float32 in run_to_float().
    void (*run)(const conv_u8_data& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
                const float* ratios, std::uint8_t* result);
    void (*run_to_float)(const conv_u8_data& weights, const std::uint8_t* const* rows, std::size_t pixel_stride,
                         std::size_t pixels, const float* ratios, float* result);
};

namespace detail {

/// Destination of one panel's results, and the constants that turn integer sums into results.
template <class Result>
struct conv_u8_panel_output : conv_panel_output<Result> {
    const std::int32_t* offsets;
    const float* scales;
    float zero_point;

    conv_u8_panel_output(const conv_u8_data& weights, const float* of_pixels, Result* result)
        : conv_panel_output<Result>(weights, of_pixels, result),
          offsets(weights.offsets.data()),
          scales(weights.scales.data()),
          zero_point(std::is_same_v<Result, float> ? 0.0F : weights.result_zero_point) {}

    /// Advances to the next panel.
    void skip(std::size_t lanes) {
        conv_panel_output<Result>::skip(lanes);
        offsets += lanes, scales += lanes;
    }
};

}  // namespace detail

}}  // namespace ldi
