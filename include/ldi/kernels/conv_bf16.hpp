// k x k convolution of bfloat16 values, like kernels/conv_f32.hpp: half the memory, and twice the products an instruction. Sums,
// bias, ratio and activation are float32. This header is the contract of the family; one file for each instruction set that has
// such multiplications implements it, beside portable code.
//
// A pixel's result has the same bits however the pixels are cut into calls. A result is within 1e-5 times the sum of the absolute
// values of what is added, and where it is rounded to bfloat16 within 2^-8 of itself, of the exact one, if neither values nor
// products are below 2^-126 (those may count as zero): instruction sets add in different order, and round differently.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/kernels/conv_bf16_avx512bf16.hpp>
#include <ldi/kernels/conv_scalar.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>

#include <algorithm>
#include <cstddef>
#include <span>

namespace ldi {

/// target   to pack for, one that multiplies_bfloat16()
/// weights  outputs x rows x inputs, row-major, finite; rounded to bfloat16
/// bias     outputs
/// rows     stretches of memory that the inputs of one pixel lie in: k for a k x k convolution, whose stretches hold k pixels
inline conv_bf16_weights pack_conv_bf16(isa target, std::span<const float> weights, std::span<const float> bias, std::size_t rows,
                                        activation after) {
    LDI_ASSERT(!bias.empty() && rows >= 1 && weights.size() % (bias.size() * rows) == 0);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F && multiplies_bfloat16(target));
    conv_bf16_weights packed;
    packed.target = without_tiles(target);
    packed.rows = rows;
    packed.inputs = weights.size() / (bias.size() * rows);
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    buffer<bfloat16> rounded(weights.size());
    std::transform(weights.begin(), weights.end(), rounded.begin(), to_bfloat16);
#if LDI_HAS_X86_KERNELS
    if (packed.target == isa::avx512vnni) {
        avx512bf16::pack_conv_bf16(packed, rounded, bias);
        return packed;
    }
#endif
    scalar::pack_conv_bf16(packed, rounded, bias);
    return packed;
}

/// result = activation(sum of weight * input * ratio + bias)
///
/// rows          where the first pixel's stretches of `inputs` values begin
/// pixel_stride  values from a pixel's stretches to the next pixel's
/// ratios        one a pixel; nullptr for 1
/// result        pixels x outputs, row-major, float or bfloat16; must not overlap the input
template <class Result>
void conv_bf16(const conv_bf16_weights& weights, const bfloat16* const* rows, std::size_t pixel_stride, std::size_t pixels,
               const float* ratios, Result* result) {
#if LDI_HAS_X86_KERNELS
    if (weights.target == isa::avx512vnni) return avx512bf16::conv_bf16(weights, rows, pixel_stride, pixels, ratios, result);
#endif
    scalar::conv_bf16(weights, rows, pixel_stride, pixels, ratios, result);
}

}  // namespace ldi
