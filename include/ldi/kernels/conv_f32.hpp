// k x k convolution of float32 values whose window is k stretches of memory: a row of image pixels, or pixels gathered side by
// side. This header is the contract of the family; one file for each instruction set implements it.
//
// Sums are taken in one order whatever the number of pixels in a call and their stride: on one instruction set a pixel's result
// has the same bits however the pixels are cut into calls. Instruction sets agree to rounding: some fuse multiplication and
// addition.
#pragma once

#include <ldi/kernels/conv_f32_avx2.hpp>
#include <ldi/kernels/conv_f32_avx512.hpp>
#include <ldi/kernels/conv_f32_neon.hpp>
#include <ldi/kernels/conv_f32_wasm.hpp>
#include <ldi/kernels/conv_scalar.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>

#include <cstddef>
#include <span>

namespace ldi {

/// target   to pack for, one that is_available()
/// weights  outputs x rows x inputs, row-major, finite
/// bias     outputs
/// rows     stretches of memory that the inputs of one pixel lie in: k for a k x k convolution, whose stretches hold k pixels
inline conv_f32_weights pack_conv_f32(isa target, std::span<const float> weights, std::span<const float> bias, std::size_t rows,
                                      activation after) {
    LDI_ASSERT(!bias.empty() && rows >= 1 && weights.size() % (bias.size() * rows) == 0);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F);
    conv_f32_weights packed;
    packed.target = without_tiles(target);
    packed.rows = rows;
    packed.inputs = weights.size() / (bias.size() * rows);
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    switch (packed.target) {
#if LDI_HAS_X86_KERNELS
        case isa::avx512vnni: avx512vnni::pack_conv_f32(packed, weights, bias); break;
        case isa::avx2: avx2::pack_conv_f32(packed, weights, bias); break;
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: neon::pack_conv_f32(packed, weights, bias); break;
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: wasm_simd128::pack_conv_f32(packed, weights, bias); break;
#endif
        default: scalar::pack_conv_f32(packed, weights, bias); break;
    }
    return packed;
}

/// result = activation(sum of weight * input * ratio + bias)
///
/// rows          where the first pixel's stretches of `inputs` values begin
/// pixel_stride  values from a pixel's stretches to the next pixel's
/// ratios        one a pixel; nullptr for 1
/// result        pixels x outputs, row-major; must not overlap the input
inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    switch (weights.target) {
#if LDI_HAS_X86_KERNELS
        case isa::avx512vnni: return avx512vnni::conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
        case isa::avx2: return avx2::conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: return neon::conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: return wasm_simd128::conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
#endif
        default: return scalar::conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
    }
}

}  // namespace ldi
