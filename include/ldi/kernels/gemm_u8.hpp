// Matrix product of 8-bit activations and 8-bit weights, requantized to 8 bits. It computes 1 x 1 convolutions and dense k x k
// convolutions. A k x k window consists of k pieces of image rows, which the kernel reads in place. Each instruction set has a
// file in gemm_u8/; all of them return the same bits.
#pragma once

#include <ldi/kernels/gemm_u8/avx2.hpp>
#include <ldi/kernels/gemm_u8/avx512vnni.hpp>
#include <ldi/kernels/gemm_u8/avx_vnni.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>
#include <ldi/kernels/gemm_u8/neon.hpp>
#include <ldi/kernels/gemm_u8/scalar.hpp>
#include <ldi/kernels/gemm_u8/wasm.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One kernel per instruction set.
inline constexpr gemm_u8_kernel gemm_u8_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, 1, avx2::pack_gemm_u8, avx2::gemm_u8},
    {isa::avx_vnni, 2, avx_vnni::pack_gemm_u8, avx_vnni::gemm_u8},
    {isa::avx512vnni, 1, avx512vnni::pack_gemm_u8, avx512vnni::gemm_u8},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, 1, neon::pack_gemm_u8, neon::gemm_u8},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, 1, wasm_simd128::pack_gemm_u8, wasm_simd128::gemm_u8},
#endif
    {isa::scalar, 1, scalar::pack_gemm_u8, scalar::gemm_u8},
};
static_assert(find_kernel(gemm_u8_kernels, isa::scalar).set == isa::scalar);

/// Packs weights for gemm_u8().
///
/// target             requested instruction set; raises invalid_option if it is not available (is_available()). If its kernel is
///                    not exact for this layer, or needs more outputs, packs for a slower set; the result's `target` names the
///                    set that was used. VNNI and NEON kernels are exact if all differences `weight - zero point`, or all negated
///                    differences, fit in a signed byte. x86 kernels also require a float form of the requantization
///                    (find_float_requantization())
/// weights            outputs x segments x inputs, row-major
/// weight_zero_point  zero point of the weights
/// bias               one value per output, in units of input scale * weight scale; at least one
/// segments           number of contiguous pieces of memory per pixel: 1, or k for a k x k convolution; at most 7
/// input_zero_point   zero point of the activations
/// output             constants of the conversion from sums to results
///
/// For every output, `510 * sum |weight - zero point| + |bias|` must be below 2^31, so that no order of summation overflows.
inline gemm_u8_weights pack_gemm_u8(isa target, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                                    std::span<const std::int32_t> bias, std::size_t segments, std::uint8_t input_zero_point,
                                    const requantization& output) {
    LDI_ASSERT(!bias.empty() && segments >= 1 && segments <= gemm_u8_data::max_segments);
    LDI_ASSERT(weights.size() % (bias.size() * segments) == 0);
    const gemm_u8_kernel& kernel = find_kernel(gemm_u8_kernels, target);
    check_available("pack_gemm_u8", target);
    gemm_u8_data packed;
    packed.segments = segments;
    packed.inputs = weights.size() / (bias.size() * segments);
    packed.outputs = bias.size();
    packed.output = output;
    const isa wanted = packed.outputs < kernel.min_outputs ? find_instruction_set(kernel.set).otherwise : kernel.set;
    packed.target = detail::choose_target(wanted, weights, weight_zero_point, bias, output, packed.fast);
    if (wanted == isa::wasm_simd128 && packed.target == isa::scalar && segments * packed.inputs <= detail::max_unfused_inputs)
        packed.target = wanted, packed.fast = {};  // WebAssembly's kernel can also requantize in integers
    detail::fold_zero_points(packed, weights, weight_zero_point, bias, input_zero_point);
    find_kernel(gemm_u8_kernels, packed.target).pack(packed, weights, weight_zero_point);
    return detail::prepared_from(std::move(packed));
}

/// Computes the requantized matrix product.
///
/// segments      addresses of the first pixel's pieces, each of weights->inputs values; 3 more bytes after each piece must be
///               readable
/// pixel_stride  distance between the pieces of adjacent pixels, in bytes
/// pixels        number of pixels to compute
/// result        pixels x outputs, row-major; must not overlap the input
inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    find_kernel(gemm_u8_kernels, weights->target).run(*weights, segments, pixel_stride, pixels, result);
}

}}  // namespace ldi
