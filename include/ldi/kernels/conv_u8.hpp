// k x k convolution of unsigned bytes, like kernels/conv_f32.hpp in a quarter of the memory: what float arithmetic computes,
// rounded to 8 bits wherever it is stored. One file of conv_u8/ for each instruction set, all with equal results.
//
// A byte x of an input stands for (x - zero point) * its scale. Sums are exact; scale, ratio, bias and activation are float32, in
// the same operations everywhere: each product is added to what follows it with one rounding.
#pragma once

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

namespace ldi::inline LDI_CONFIGURATION {

/// Which instruction set has which kernel.
inline constexpr conv_u8_kernel conv_u8_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, avx2::pack_conv_u8, avx2::conv_u8<std::uint8_t>, avx2::conv_u8<float>},
    {isa::avx_vnni, avx_vnni::pack_conv_u8, avx_vnni::conv_u8<std::uint8_t>, avx_vnni::conv_u8<float>},
    {isa::avx512vnni, avx512vnni::pack_conv_u8, avx512vnni::conv_u8<std::uint8_t>, avx512vnni::conv_u8<float>},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, neon::pack_conv_u8, neon::conv_u8<std::uint8_t>, neon::conv_u8<float>},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, wasm_simd128::pack_conv_u8, wasm_simd128::conv_u8<std::uint8_t>, wasm_simd128::conv_u8<float>},
#endif
    {isa::scalar, scalar::pack_conv_u8, scalar::conv_u8<std::uint8_t>, scalar::conv_u8<float>},
};
static_assert(find_kernel(conv_u8_kernels, isa::scalar).set == isa::scalar);

/// target             to pack for, one that is_available()
/// weights            outputs x rows x inputs, row-major, at most largest_conv_u8_weight in absolute value; rows x inputs at most
///                    most_conv_u8_inputs
/// zero_points        of the inputs of one stretch
/// scales, bias       outputs: what a sum is multiplied by, and what is added then, in units of the result's scale
/// rows               stretches of memory that the inputs of one pixel lie in: k for a k x k convolution, whose stretches hold k
///                    pixels
/// result_zero_point  of results that are bytes
inline conv_u8_weights pack_conv_u8(isa target, std::span<const std::int8_t> weights, std::span<const std::uint8_t> zero_points,
                                    std::span<const float> scales, std::span<const float> bias, std::size_t rows,
                                    activation after, std::uint8_t result_zero_point) {
    LDI_ASSERT(!bias.empty() && scales.size() == bias.size() && rows >= 1);
    LDI_ASSERT(weights.size() == bias.size() * rows * zero_points.size() && rows * zero_points.size() <= most_conv_u8_inputs);
    LDI_ASSERT(after.negative_slope >= 0.0F && after.negative_slope <= 1.0F);
    LDI_ASSERT(std::all_of(weights.begin(), weights.end(),
                           [](int w) { return w >= -largest_conv_u8_weight && w <= largest_conv_u8_weight; }));
    conv_u8_weights packed;
    packed.target = find_kernel(conv_u8_kernels, target).set;
    packed.rows = rows;
    packed.inputs = zero_points.size();
    packed.outputs = bias.size();
    packed.negative_slope = after.negative_slope;
    packed.result_zero_point = result_zero_point;
    find_kernel(conv_u8_kernels, target).pack(packed, weights, zero_points, scales, bias);
    return packed;
}

/// result = activation(sum of weight * (input - zero point) * (scale * ratio) + bias), and where it is a byte plus the zero
/// point, rounded, of two the even one, and clamped
///
/// rows          where the first pixel's stretches of `inputs` values begin
/// pixel_stride  values from a pixel's stretches to the next pixel's
/// ratios        one a pixel; nullptr for 1
/// result        pixels x outputs, row-major, std::uint8_t or float; must not overlap the input
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const conv_u8_kernel& kernel = find_kernel(conv_u8_kernels, weights.target);
    if constexpr (std::is_same_v<Result, std::uint8_t>)
        kernel.run(weights, rows, pixel_stride, pixels, ratios, result);
    else
        kernel.run_to_float(weights, rows, pixel_stride, pixels, ratios, result);
}

}  // namespace ldi
