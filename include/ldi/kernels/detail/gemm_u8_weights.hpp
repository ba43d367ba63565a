// The packed weights of kernels/gemm_u8.hpp, and what packing has in common on all instruction sets.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace ldi {

/// The weights of one layer in the order that gemm_u8() reads them. Only pack_gemm_u8() makes sound ones.
struct gemm_u8_weights {
    static constexpr std::size_t most_segments = 7;

    isa target = isa::scalar;
    std::size_t segments = 1, inputs = 0, outputs = 0;
    buffer<std::int16_t> wide;    ///< scalar, WebAssembly, a single output with AVX2: weight minus its zero point
    buffer<std::int8_t> narrow;   ///< AVX2, VNNI, AMX: the same, or its negative, see `fast`; NEON: see `output`
    buffer<std::uint32_t> order;  ///< AVX2: in which the inputs are multiplied
    buffer<std::int32_t> bias;    ///< zero points folded in; padded with zeros to whole vectors
    requantization output;        ///< NEON: its multiplier is negated where `narrow` and `bias` are
    /// Not used by scalar and NEON; negated where `narrow` and `bias` are. On WebAssembly the constants of an
    /// unfused_requantization.
    float_requantization fast;

    /// Whether the inputs lie across the lanes and not the outputs, of which there is one: with few inputs, most of a vector of
    /// them would be empty too.
    bool is_single_output() const { return outputs == 1 && inputs >= 64; }
};

namespace detail {

struct signed_range {
    int least, most;
};

inline signed_range range_of(std::span<const std::uint8_t> weights, std::uint8_t zero_point) {
    const auto [least, most] = std::minmax_element(weights.begin(), weights.end());
    return {*least - int{zero_point}, *most - int{zero_point}};
}

/// Kernels that multiply and add in two roundings take so many inputs at most, because they widen them first.
inline constexpr std::size_t most_unfused_inputs = 4096;

/// Whether kernels without a fused multiply-add are exact; they also round in a way that takes no sums below -2^23 / scale.
inline bool fits_unfused(std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                         std::span<const std::int32_t> bias, const requantization& output, float_requantization& fast) {
    const std::size_t inputs = weights.size() / bias.size();
    const signed_range range = range_of(weights, weight_zero_point);
    const double largest_weight = (std::max)(-range.least, range.most);
    const auto [least_bias, most_bias] = std::minmax_element(bias.begin(), bias.end());
    const double largest_bias = (std::max)(-static_cast<double>(*least_bias), static_cast<double>(*most_bias));
    const std::optional<unfused_requantization> found = find_unfused_requantization(output);
    if (!found.has_value() || inputs > most_unfused_inputs) return false;
    fast = {found->scale, found->offset, found->zero_point};
    return (510 * largest_weight * static_cast<double>(inputs) + largest_bias) * double{found->scale} < 0x1p23;
}

/// The fastest set not beyond `wanted` that is exact for these weights. x86 and NEON multiply by signed bytes; weights in
/// -127..128 (a zero point of 127) fit once negated, and the requantization then takes the sums negated. AVX2 takes wider weights
/// as well. NEON's requantization is the integer form.
inline isa choose_target(isa wanted, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                         std::span<const std::int32_t> bias, const requantization& output, float_requantization& fast) {
    if (wanted == isa::scalar) return isa::scalar;
    if (wanted == isa::wasm_simd128) return fits_unfused(weights, weight_zero_point, bias, output, fast) ? wanted : isa::scalar;
    const signed_range range = range_of(weights, weight_zero_point);
    const bool fits = range.least >= -128 && range.most <= 127, fits_negated = range.least >= -127 && range.most <= 128;
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

/// Sets `bias` so that sums of `input * (weight - zero point)` start from it.
inline void fold_zero_points(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                             std::span<const std::int32_t> bias, std::uint8_t input_zero_point) {
    constexpr std::size_t largest_vector = 16;
    packed.bias.resize((packed.outputs + largest_vector - 1) / largest_vector * largest_vector);
    const std::size_t inputs = packed.segments * packed.inputs;
    for (std::size_t o = 0; o < packed.outputs; ++o) {
        std::int32_t sum = 0;
        for (std::size_t i = 0; i < inputs; ++i) sum += weights[o * inputs + i] - weight_zero_point;
        packed.bias[o] = bias[o] - sum * input_zero_point;
        if (is_negated(packed.fast)) packed.bias[o] = -packed.bias[o];
    }
}

}  // namespace detail
}  // namespace ldi
