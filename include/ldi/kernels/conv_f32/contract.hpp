// Contract of the kernels of kernels/conv_f32.hpp: their inputs and results.
#pragma once

#include <ldi/kernels/conv_f32/weights.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One instruction set's kernel: a row of `conv_f32_kernels`.
struct conv_f32_kernel {
    isa set;
    detail::panel_layout layout;
    /// Same parameters as conv_f32() of kernels/conv_f32.hpp.
    void (*run)(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                const float* ratios, float* result);
};

}}  // namespace ldi
