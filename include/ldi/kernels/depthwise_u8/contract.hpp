// Contract of the kernels of kernels/depthwise_u8.hpp: their inputs and results.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/detail/choose_target.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/prepared.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The weights of one layer in the order in which depthwise_u8() reads them.
struct depthwise_u8_data {
    using value_type = std::uint8_t;
    static constexpr std::size_t taps = 9;

    isa target = isa::scalar;
    std::size_t channels = 0;
    std::size_t stride = 1;
    std::uint8_t padding = 0;   ///< the input's zero point: the value of pixels outside the image
    buffer<std::int16_t> wide;  ///< weights minus their zero point, for scalar and WebAssembly
    /// Weights minus their zero point, for AVX2, VNNI and NEON; negated in the same cases as gemm_u8_data::narrow.
    buffer<std::int8_t> narrow;
    buffer<std::uint32_t> order;  ///< for AVX2: number of terms of each unit of channels (avx2_packing.hpp)
    buffer<std::int32_t> bias;    ///< zero points folded in; in the order of the kernel's sums
    requantization output;        ///< as in gemm_u8_data
    float_requantization fast;    ///< as in gemm_u8_data

    /// Number of pixels per row of the result, for `width` stored pixels that are each repeated `repeat` times.
    std::size_t result_width(std::size_t width, std::size_t repeat) const { return (width * repeat + stride - 1) / stride; }
};

/// Made by pack_depthwise_u8().
using depthwise_u8_weights = prepared<depthwise_u8_data>;

namespace detail {

/// The weights of one depthwise layer before packing.
struct depthwise_source {
    std::span<const std::uint8_t> weights;  // channels x 9
    std::span<const std::int32_t> bias;
    std::uint8_t weight_zero_point;
    int input_zero_point;

    /// Returns 0 for channels and taps beyond the last.
    int weight(std::size_t channel, std::size_t tap) const {
        if (channel >= bias.size() || tap >= depthwise_u8_data::taps) return 0;
        return weights[channel * depthwise_u8_data::taps + tap] - int{weight_zero_point};
    }
    std::int32_t folded_bias(std::size_t channel) const {
        if (channel >= bias.size()) return 0;
        std::int32_t sum = 0;
        for (std::size_t t = 0; t < depthwise_u8_data::taps; ++t) sum += weight(channel, t);
        return bias[channel] - sum * input_zero_point;
    }
};

}  // namespace detail

/// One instruction set's kernel: a row of `depthwise_u8_kernels`. In run(), `width` is at least 1.
struct depthwise_u8_kernel {
    isa set;
    /// Appends to `wide`, `narrow`, `order` and `bias` the data that run() reads; the caller has set all other members.
    void (*pack)(depthwise_u8_data& packed, const detail::depthwise_source& source);
    /// Same parameters as depthwise_u8() of kernels/depthwise_u8.hpp.
    void (*run)(const depthwise_u8_data& weights, const std::uint8_t* const rows[3], std::size_t width, std::size_t repeat,
                std::uint8_t* result);
};

}}  // namespace ldi
