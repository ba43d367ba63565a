// Matrix product of 8-bit activations and 8-bit weights, requantized to 8 bits: the 1 x 1 convolution, and any dense k x k one,
// whose windows are k stretches of image rows and need no copying. This header is the contract of the family; one file for each
// instruction set implements it, all with equal results.
#pragma once

#include <ldi/kernels/detail/gemm_u8_weights.hpp>
#include <ldi/kernels/gemm_u8_amx.hpp>
#include <ldi/kernels/gemm_u8_avx2.hpp>
#include <ldi/kernels/gemm_u8_avx512vnni.hpp>
#include <ldi/kernels/gemm_u8_neon.hpp>
#include <ldi/kernels/gemm_u8_scalar.hpp>
#include <ldi/kernels/gemm_u8_wasm.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi {

/// target            to pack for. Where it can't be exact (weights beyond 8 signed bits for VNNI and NEON, on x86 no
///                   float form of the requantization), the weights are packed for a slower one; `result.target` tells
/// weights           outputs x segments x inputs, row-major
/// bias              outputs, in units of input scale * weight scale
/// segments          stretches of memory that the inputs of one pixel lie in: 1, or k for a k x k convolution; at most 7
/// input_zero_point  of the activations
///
/// For every output, `510 * sum |weight - zero point| + |bias|` must be below 2^31, so that no order of summation overflows.
inline gemm_u8_weights pack_gemm_u8(isa target, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                                    std::span<const std::int32_t> bias, std::size_t segments, std::uint8_t input_zero_point,
                                    const requantization& output) {
    LDI_ASSERT(!bias.empty() && segments >= 1 && segments <= gemm_u8_weights::most_segments);
    LDI_ASSERT(weights.size() % (bias.size() * segments) == 0);
    gemm_u8_weights packed;
    packed.segments = segments;
    packed.inputs = weights.size() / (bias.size() * segments);
    packed.outputs = bias.size();
    packed.output = output;
    // A single output would use one column of a tile's 16.
    packed.target = detail::choose_target(bias.size() == 1 ? without_tiles(target) : target, weights, weight_zero_point, bias,
                                          output, packed.fast);
    detail::fold_zero_points(packed, weights, weight_zero_point, bias, input_zero_point);
    switch (packed.target) {
#if LDI_HAS_AMX_KERNELS
        case isa::amx_int8: detail::pack_tiles(packed, weights, weight_zero_point); break;
#endif
#if LDI_HAS_X86_KERNELS
        case isa::avx512vnni: avx512vnni::pack_gemm_u8(packed, weights, weight_zero_point); break;
        case isa::avx2: avx2::pack_gemm_u8(packed, weights, weight_zero_point); break;
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: neon::pack_gemm_u8(packed, weights, weight_zero_point); break;
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: wasm_simd128::pack_gemm_u8(packed, weights, weight_zero_point); break;
#endif
        default: scalar::pack_gemm_u8(packed, weights, weight_zero_point); break;
    }
    return packed;
}

/// segments      where the first pixel's stretches of `inputs` values begin; 3 more bytes behind each pixel's must be readable
/// pixel_stride  bytes from a pixel's stretches to the next pixel's
/// result        pixels x outputs, row-major; must not overlap the input
inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    switch (weights.target) {
#if LDI_HAS_AMX_KERNELS
        case isa::amx_int8: return amx::gemm_u8(weights, segments, pixel_stride, pixels, result);
#endif
#if LDI_HAS_X86_KERNELS
        case isa::avx512vnni: return avx512vnni::gemm_u8(weights, segments, pixel_stride, pixels, result);
        case isa::avx2: return avx2::gemm_u8(weights, segments, pixel_stride, pixels, result);
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: return neon::gemm_u8(weights, segments, pixel_stride, pixels, result);
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: return wasm_simd128::gemm_u8(weights, segments, pixel_stride, pixels, result);
#endif
        default: return scalar::gemm_u8(weights, segments, pixel_stride, pixels, result);
    }
}

}  // namespace ldi
