// k x k convolution of unsigned bytes. It approximates kernels/conv_f32.hpp: stored values are rounded to 8 bits and occupy a
// quarter of the memory. Each instruction set has a file in conv_u8/; all of them return the same bits.
//
// An input byte x represents (x - zero point) * scale. Sums are exact. Scale, ratio, bias and activation are float32, and every
// instruction set computes the same fused multiply-adds.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/conv_u8/avx2.hpp>
#include <ldi/kernels/conv_u8/avx512vnni.hpp>
#include <ldi/kernels/conv_u8/avx_vnni.hpp>
#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/conv_u8/neon.hpp>
#include <ldi/kernels/conv_u8/scalar.hpp>
#include <ldi/kernels/conv_u8/wasm.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One kernel per instruction set.
inline constexpr conv_u8_kernel conv_u8_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, avx2::conv_u8_tiles::layout, 0, avx2::conv<avx2::conv_u8_tiles>, avx2::conv<avx2::conv_u8_tiles>},
    {isa::avx_vnni, avx_vnni::conv_u8_tiles::layout, 0, avx_vnni::conv<avx_vnni::conv_u8_tiles>,
     avx_vnni::conv<avx_vnni::conv_u8_tiles>},
    {isa::avx512vnni, avx512vnni::conv_u8_tiles::layout, 0, avx512vnni::conv<avx512vnni::conv_u8_tiles>,
     avx512vnni::conv<avx512vnni::conv_u8_tiles>},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, neon::conv_u8_tiles::layout, 128, neon::conv<neon::conv_u8_tiles>, neon::conv<neon::conv_u8_tiles>},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, wasm_simd128::conv_u8_tiles::layout, 0, wasm_simd128::conv<wasm_simd128::conv_u8_tiles>,
     wasm_simd128::conv<wasm_simd128::conv_u8_tiles>},
#endif
    {isa::scalar, scalar::panels, 0, scalar::conv_u8<std::uint8_t>, scalar::conv_u8<float>},
};
static_assert(find_kernel(conv_u8_kernels, isa::scalar).set == isa::scalar);

/// Packs weights for conv_u8().
///
/// target             instruction set to pack for; must be available (is_available()), else raises invalid_option
/// weights            outputs x rows x inputs, row-major, at most max_conv_u8_weight in absolute value; rows x inputs at most
///                    max_conv_u8_inputs
/// zero_points        one per input of a piece (see `rows`), at least one; the same for all pieces
/// scales, bias       one each per output: sum * scale + bias is in units of the result's scale
/// rows               number of contiguous pieces of memory per pixel: k for a k x k convolution, each with k pixels
/// after              activation to apply after the bias; slope 0 to 1
/// result_zero_point  zero point of results that are bytes
inline conv_u8_weights pack_conv_u8(isa target, std::span<const std::int8_t> weights, std::span<const std::uint8_t> zero_points,
                                    std::span<const float> scales, std::span<const float> bias, std::size_t rows,
                                    activation after, std::uint8_t result_zero_point) {
    LDI_ASSERT(!bias.empty() && scales.size() == bias.size() && rows >= 1 && !zero_points.empty());
    LDI_ASSERT(weights.size() == bias.size() * rows * zero_points.size() && rows * zero_points.size() <= max_conv_u8_inputs);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F);
    LDI_ASSERT(
        std::all_of(weights.begin(), weights.end(), [](int w) { return w >= -max_conv_u8_weight && w <= max_conv_u8_weight; }));
    const conv_u8_kernel& kernel = find_kernel(conv_u8_kernels, target);
    check_available("pack_conv_u8", target);
    conv_u8_data packed;
    packed.target = kernel.set;
    packed.rows = rows;
    packed.inputs = zero_points.size();
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    packed.result_zero_point = result_zero_point;
    detail::append_panels(packed.values, {packed.outputs, rows, packed.inputs}, kernel.layout,
                          [weights](std::size_t i) { return weights[i]; });
    const std::size_t padded = detail::groups_of(packed.outputs, kernel.layout.lanes) * kernel.layout.lanes;
    packed.scales.assign(scales.begin(), scales.end()), packed.scales.resize(padded, 0.0F);
    packed.bias.assign(bias.begin(), bias.end()), packed.bias.resize(padded, 0.0F);
    packed.offsets.assign(padded, 0);
    const std::int8_t* weight = weights.data();
    for (std::size_t piece = 0; piece < packed.outputs * rows; ++piece)
        for (const std::uint8_t zero_point : zero_points)
            packed.offsets[piece / rows] -= *weight++ * (zero_point - kernel.subtrahend);
    return detail::prepared_from(std::move(packed));
}

/// Computes result = activation((sum of weight * (input - zero point)) * (scale * ratio) + bias). If results are bytes, also adds
/// their zero point, rounds half to even, and clamps.
///
/// rows          addresses of the first pixel's pieces, each of weights->inputs values
/// pixel_stride  distance between the pieces of adjacent pixels, in values
/// pixels        number of pixels to compute
/// ratios        one per pixel; nullptr means 1
/// result        pixels x outputs, row-major, std::uint8_t or float; must not overlap the input
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const conv_u8_kernel& kernel = find_kernel(conv_u8_kernels, weights->target);
    if constexpr (std::is_same_v<Result, std::uint8_t>)
        kernel.run(*weights, rows, pixel_stride, pixels, ratios, result);
    else
        kernel.run_to_float(*weights, rows, pixel_stride, pixels, ratios, result);
}

}}  // namespace ldi
