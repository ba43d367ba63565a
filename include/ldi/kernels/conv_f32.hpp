// k x k convolution of float32 values. A window consists of k contiguous pieces of memory, each with k pixels: pixels of an
// image row, or gathered pixels. Each instruction set has a file in conv_f32/.
//
// The order of summation depends neither on the number of pixels per call nor on their stride. On one instruction set, the bits
// of a pixel's result therefore do not depend on how the pixels are split into calls. The results of different instruction sets
// differ by rounding, because only some fuse multiplication and addition.
#pragma once

#include <ldi/kernels/conv_f32/avx2.hpp>
#include <ldi/kernels/conv_f32/avx512vnni.hpp>
#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/conv_f32/neon.hpp>
#include <ldi/kernels/conv_f32/scalar.hpp>
#include <ldi/kernels/conv_f32/wasm.hpp>
#include <ldi/kernels/detail/conv_weights.hpp>

#include <cstddef>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One kernel per instruction set.
inline constexpr conv_f32_kernel conv_f32_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, avx2::conv_f32_tiles::layout, avx2::conv<avx2::conv_f32_tiles>},
    {isa::avx512vnni, avx512vnni::conv_f32_tiles::layout, avx512vnni::conv<avx512vnni::conv_f32_tiles>},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, neon::conv_f32_tiles::layout, neon::conv<neon::conv_f32_tiles>},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, wasm_simd128::conv_f32_tiles::layout, wasm_simd128::conv<wasm_simd128::conv_f32_tiles>},
#endif
    {isa::scalar, scalar::panels, scalar::conv_f32},
};
static_assert(find_kernel(conv_f32_kernels, isa::scalar).set == isa::scalar);

/// Packs weights for conv_f32().
///
/// target   instruction set to pack for; must be available (is_available()), else raises invalid_option
/// weights  outputs x rows x inputs, row-major, finite; at least one input
/// bias     outputs, 1 or more
/// rows     number of contiguous pieces of memory per pixel: k for a k x k convolution, each with k pixels
/// after    activation to apply after the bias; slope 0 to 1
inline conv_f32_weights pack_conv_f32(isa target, std::span<const float> weights, std::span<const float> bias, std::size_t rows,
                                      activation after) {
    LDI_ASSERT(!bias.empty() && rows >= 1 && !weights.empty() && weights.size() % (bias.size() * rows) == 0);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F);
    const conv_f32_kernel& kernel = find_kernel(conv_f32_kernels, target);
    check_available("pack_conv_f32", target);
    conv_f32_data packed;
    packed.target = kernel.set;
    packed.rows = rows;
    packed.inputs = weights.size() / (bias.size() * rows);
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    detail::append_panels(packed.values, {packed.outputs, rows, packed.inputs}, kernel.layout,
                          [weights](std::size_t i) { return weights[i]; });
    packed.bias.assign(bias.begin(), bias.end());
    packed.bias.resize(detail::groups_of(packed.outputs, kernel.layout.lanes) * kernel.layout.lanes, 0.0F);
    return detail::prepared_from(std::move(packed));
}

/// Computes result = activation((sum of weight * input) * ratio + bias).
///
/// rows          addresses of the first pixel's pieces, each of weights->inputs values
/// pixel_stride  distance between the pieces of adjacent pixels, in values
/// pixels        number of pixels to compute
/// ratios        one per pixel; nullptr means 1
/// result        pixels x outputs, row-major; must not overlap the input
inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    find_kernel(conv_f32_kernels, weights->target).run(*weights, rows, pixel_stride, pixels, ratios, result);
}

}}  // namespace ldi
