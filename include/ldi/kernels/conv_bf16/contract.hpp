// What a kernel of kernels/conv_bf16.hpp is given and has to do.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>

#include <cstddef>
#include <span>

namespace ldi::inline LDI_CONFIGURATION {

/// One instruction set's kernel: a row of `conv_bf16_kernels`.
struct conv_bf16_kernel {
    isa set;  ///< which multiplies_bfloat16()
    /// Fills `values` and `bias`; all else is there.
    void (*pack)(conv_bf16_weights& packed, std::span<const bfloat16> weights, std::span<const float> bias);
    /// As conv_bf16() of kernels/conv_bf16.hpp, to float32 and to bfloat16.
    void (*run)(const conv_bf16_weights& weights, const bfloat16* const* rows, std::size_t pixel_stride, std::size_t pixels,
                const float* ratios, float* result);
    void (*run_to_bfloat16)(const conv_bf16_weights& weights, const bfloat16* const* rows, std::size_t pixel_stride,
                            std::size_t pixels, const float* ratios, bfloat16* result);
};

}  // namespace ldi
