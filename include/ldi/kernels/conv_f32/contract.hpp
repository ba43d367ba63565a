// Contract of the kernels of kernels/conv_f32.hpp: their inputs and results.
#pragma once

#include <ldi/kernels/conv_f32/weights.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>

#include <cstddef>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One instruction set's kernel: a row of `conv_f32_kernels`.
struct conv_f32_kernel {
    isa set;
    /// Fills `values` and `bias`; the caller has set all other members. See pack_conv_f32() of kernels/conv_f32.hpp.
    void (*pack)(conv_f32_weights& packed, std::span<const float> weights, std::span<const float> bias);
    /// Same parameters as conv_f32() of kernels/conv_f32.hpp.
    void (*run)(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                const float* ratios, float* result);
};

}}  // namespace ldi
