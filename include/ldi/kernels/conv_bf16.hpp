// k x k convolution of bfloat16 values, like kernels/conv_f32.hpp: half the memory, and twice the products an instruction. Sums,
// bias, ratio and activation are float32. One file of conv_bf16/ for each instruction set that has such multiplications,
// beside portable code.
//
// A pixel's result has the same bits however the pixels are cut into calls. A result is within 1e-5 times the sum of the absolute
// values of what is added, and where it is rounded to bfloat16 within 2^-8 of itself, of the exact one, if neither values nor
// products are below 2^-126 (those may count as zero): instruction sets add in different order, and round differently.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/conv_bf16/avx512bf16.hpp>
#include <ldi/kernels/conv_bf16/contract.hpp>
#include <ldi/kernels/conv_bf16/scalar.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>

namespace ldi::inline LDI_CONFIGURATION {

/// Which instruction set has which kernel.
inline constexpr conv_bf16_kernel conv_bf16_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx512vnni, avx512bf16::pack_conv_bf16, avx512bf16::conv_bf16<float>, avx512bf16::conv_bf16<bfloat16>},
#endif
    {isa::scalar, scalar::pack_conv_bf16, scalar::conv_bf16<float>, scalar::conv_bf16<bfloat16>},
};
static_assert(find_kernel(conv_bf16_kernels, isa::scalar).set == isa::scalar);

/// target   to pack for, one that multiplies_bfloat16()
/// weights  outputs x rows x inputs, row-major, finite; rounded to bfloat16
/// bias     outputs
/// rows     stretches of memory that the inputs of one pixel lie in: k for a k x k convolution, whose stretches hold k pixels
inline conv_bf16_weights pack_conv_bf16(isa target, std::span<const float> weights, std::span<const float> bias, std::size_t rows,
                                        activation after) {
    LDI_ASSERT(!bias.empty() && rows >= 1 && weights.size() % (bias.size() * rows) == 0);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F && multiplies_bfloat16(target));
    conv_bf16_weights packed;
    packed.target = find_kernel(conv_bf16_kernels, target).set;
    packed.rows = rows;
    packed.inputs = weights.size() / (bias.size() * rows);
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    buffer<bfloat16> rounded(weights.size());
    std::transform(weights.begin(), weights.end(), rounded.begin(), to_bfloat16);
    find_kernel(conv_bf16_kernels, target).pack(packed, rounded, bias);
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
    const conv_bf16_kernel& kernel = find_kernel(conv_bf16_kernels, weights.target);
    if constexpr (std::is_same_v<Result, float>)
        kernel.run(weights, rows, pixel_stride, pixels, ratios, result);
    else
        kernel.run_to_bfloat16(weights, rows, pixel_stride, pixels, ratios, result);
}

}  // namespace ldi
