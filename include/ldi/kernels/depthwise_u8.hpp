// Depthwise 3 x 3 convolution of 8-bit activations, requantized to 8 bits, one row of the result per call. The input can be
// upsampled by repeating pixels, and the upsampled image is never stored. Each instruction set has a file in depthwise_u8/; all
// of them return the same bits.
#pragma once

#include <ldi/kernels/depthwise_u8/avx2.hpp>
#include <ldi/kernels/depthwise_u8/avx512vnni.hpp>
#include <ldi/kernels/depthwise_u8/contract.hpp>
#include <ldi/kernels/depthwise_u8/neon.hpp>
#include <ldi/kernels/depthwise_u8/scalar.hpp>
#include <ldi/kernels/depthwise_u8/wasm.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One kernel per instruction set.
inline constexpr depthwise_u8_kernel depthwise_u8_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, avx2::pack_depthwise_u8, avx2::depthwise_u8},
    {isa::avx512vnni, avx512vnni::pack_depthwise_u8, avx512vnni::depthwise_u8},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, neon::pack_depthwise_u8, neon::depthwise_u8},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, wasm_simd128::pack_depthwise_u8, wasm_simd128::depthwise_u8},
#endif
    {isa::scalar, scalar::pack_depthwise_u8, scalar::depthwise_u8},
};
static_assert(find_kernel(depthwise_u8_kernels, isa::scalar).set == isa::scalar);

/// Packs weights for depthwise_u8().
///
/// target             as for pack_gemm_u8()
/// weights            channels x 3 x 3, row-major
/// weight_zero_point  zero point of the weights
/// bias               channels, in units of input scale * weight scale; |bias| must be below 2^30
/// stride             1 or 2
/// input_zero_point   zero point of the activations, and the value of pixels outside the image
/// output             constants of the conversion from sums to results
inline depthwise_u8_weights pack_depthwise_u8(isa target, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                                              std::span<const std::int32_t> bias, std::size_t stride,
                                              std::uint8_t input_zero_point, const requantization& output) {
    LDI_ASSERT(!bias.empty() && weights.size() == bias.size() * depthwise_u8_data::taps && (stride == 1 || stride == 2));
    LDI_ASSERT(std::all_of(bias.begin(), bias.end(), [](std::int64_t b) { return std::abs(b) < std::int64_t{1} << 30; }));
    const isa wanted = find_kernel(depthwise_u8_kernels, target).set;
    check_available("pack_depthwise_u8", target);
    depthwise_u8_data packed;
    packed.channels = bias.size();
    packed.stride = stride;
    packed.padding = input_zero_point;
    packed.output = output;
    packed.target = detail::choose_target(wanted, weights, weight_zero_point, bias, output, packed.fast);
    const detail::depthwise_source source{weights, bias, weight_zero_point, input_zero_point};
    find_kernel(depthwise_u8_kernels, packed.target).pack(packed, source);
    return detail::prepared_from(std::move(packed));
}

/// Computes one row of the result.
///
/// rows    the window's three input rows from top to bottom, width x channels each; nullptr for a row outside the image. The
///         function applies stride and repeat only horizontally; the caller applies them vertically by selecting the rows
/// width   number of pixels per row, before repetition; 0 does nothing
/// repeat  number of copies of each pixel in the upsampled row, 1 to 4
/// result  weights->result_width() x channels; must not overlap the rows
inline void depthwise_u8(const depthwise_u8_weights& weights, const std::uint8_t* const rows[3], std::size_t width,
                         std::size_t repeat, std::uint8_t* result) {
    LDI_ASSERT(repeat >= 1 && repeat <= 4);
    if (width == 0) return;
    find_kernel(depthwise_u8_kernels, weights->target).run(*weights, rows, width, repeat, result);
}

}}  // namespace ldi
