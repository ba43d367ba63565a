// Chooses the instruction set to pack 8-bit weights for, because not every kernel is exact for all weights.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct signed_range {
    int min, max;
};

inline signed_range range_of(std::span<const std::uint8_t> weights, std::uint8_t zero_point) {
    std::uint8_t min = 255, max = 0;  // compilers do not vectorize std::minmax_element()
    for (const std::uint8_t w : weights) min = (std::min)(min, w), max = (std::max)(max, w);
    return {min - int{zero_point}, max - int{zero_point}};
}

/// Maximum number of inputs per output in kernels without a fused multiply-add. These kernels first widen the inputs into a
/// buffer of fixed size.
inline constexpr std::size_t max_unfused_inputs = 4096;

/// Whether kernels without a fused multiply-add are exact for these weights. Their rounding requires sums of at least -2^23 /
/// scale. Writes the constants of their requantization to `fast`.
inline bool fits_unfused(std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                         std::span<const std::int32_t> bias, const requantization& output, float_requantization& fast) {
    const std::size_t inputs = weights.size() / bias.size();
    const signed_range range = range_of(weights, weight_zero_point);
    const double largest_weight = (std::max)(-range.min, range.max);
    const auto [min_bias, max_bias] = std::minmax_element(bias.begin(), bias.end());
    const double largest_bias = (std::max)(-nearest_double(*min_bias), nearest_double(*max_bias));
    const std::optional<unfused_requantization> found = find_unfused_requantization(output);
    if (!found.has_value() || inputs > max_unfused_inputs) return false;
    fast = {found->scale, found->offset, found->zero_point};
    return (510 * largest_weight * nearest_double(inputs) + largest_bias) * double{found->scale} < 0x1p23;
}

/// Returns the fastest instruction set up to `wanted` that is exact for these weights. Writes the constants of the set's float
/// requantization to `fast`. Scalar and NEON requantize in integers and do not use `fast`.
///
/// x86 and NEON multiply by signed bytes. Weights in -127..128 (for example with a zero point of 127) fit after negation; the
/// kernel then requantizes negated sums. AVX2 also accepts larger weights, because its packing splits them.
inline isa choose_target(isa wanted, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                         std::span<const std::int32_t> bias, const requantization& output, float_requantization& fast) {
    if (wanted == isa::scalar) return isa::scalar;
    if (wanted == isa::wasm_simd128) return fits_unfused(weights, weight_zero_point, bias, output, fast) ? wanted : isa::scalar;
    const signed_range range = range_of(weights, weight_zero_point);
    const bool fits = range.min >= -128 && range.max <= 127, fits_negated = range.min >= -127 && range.max <= 128;
    if (wanted == isa::neon_dot_product) return fits || fits_negated ? wanted : isa::scalar;
    const std::optional<float_requantization> found = find_float_requantization(output);
    if (!found.has_value()) return isa::scalar;
    fast = *found;
    if (fits) return wanted;
    if (!fits_negated) return isa::avx2;
    fast.scale = -fast.scale, fast.offset = -fast.offset;
    return wanted;
}

inline bool is_negated(const float_requantization& fast) { return fast.scale < 0; }

}}}  // namespace ldi::detail
