// kernels/gemm_u8.hpp with sdot, which adds four products of signed bytes to each of 4 sums, exactly.
//
// One load fetches sixteen inputs of a pixel. sdot (by element) multiplies four of them by the weights of 4 outputs, without a
// separate instruction that broadcasts. The largest tile, 6 pixels by 4 vectors, keeps its sums in 24 of the 32 registers. Per 96
// sdot (1536 products) it loads 22 vectors and converts 6 to signed: 12 products per instruction, compared to 16 for sdot alone.
#pragma once

#include <ldi/kernels/detail/lanes_neon.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

inline constexpr std::size_t gemm_lanes = 4, gemm_max_vectors = 4, gemm_tile_pixels[] = {12, 8, 7, 6};
using detail::gemm_group;
using gemm_panel = detail::gemm_panel_of<std::uint8_t, const std::int8_t*, gemm_group>;

inline void pack_gemm_u8(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::range_of(weights, weight_zero_point).max > 127 ? -1 : 1;
    packed.output.multiplier *= sign;
    const std::size_t inputs = packed.segments * packed.inputs;
    for (std::size_t o = 0; o < packed.outputs; ++o) {
        std::int32_t sum = 0;
        for (std::size_t i = 0; i < inputs; ++i) sum += weights[o * inputs + i] - weight_zero_point;
        packed.bias[o] = sign * (packed.bias[o] + 128 * sum);  // see to_signed()
    }
    detail::append_weights(packed.narrow, packed, weights, weight_zero_point, sign, {gemm_group, gemm_lanes, gemm_max_vectors});
}

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

using gemm_vector = int32x4_t;
[[gnu::always_inline]] inline int32x4_t load_bias(const std::int32_t* from) { return load(from); }

/// Loads 4, 8 or 16 inputs into the first lanes.
template <std::size_t groups>
[[gnu::always_inline]] inline int8x16_t load_inputs(const std::uint8_t* from) {
    if constexpr (groups == 4) return to_signed(vld1q_u8(from));
    if constexpr (groups == 2) return to_signed(vcombine_u8(vld1_u8(from), vdup_n_u8(0)));
    std::uint32_t four = 0;
    std::memcpy(&four, from, sizeof four);
    return to_signed(vreinterpretq_u8_u32(vdupq_n_u32(four)));
}

template <int group, std::size_t... p>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, int32x4_t* sums, std::size_t vectors,
                                                int8x16_t weights, const int8x16_t* inputs) {
    ((sums[p * vectors] = add_products_with<group>(sums[p * vectors], weights, inputs[p])), ...);
}

/// Multiply-adds four inputs of every pixel. Loads one vector of weights at a time, so that weights occupy one register.
template <int group, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...> pixels, std::index_sequence<v...>, int32x4_t* sums,
                                                const std::int8_t* weights, const int8x16_t* inputs) {
    (multiply_add<group>(pixels, sums + v, sizeof...(v), load(weights + (group * sizeof...(v) + v) * 16), inputs), ...);
}

/// Multiply-adds sizeof...(group) groups of four inputs for every pixel.
template <int... group, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::integer_sequence<int, group...>, std::index_sequence<p...> pixels,
                                                std::index_sequence<v...> vectors, int32x4_t* sums, const std::int8_t*& weights,
                                                const std::uint8_t*& inputs, std::size_t stride) {
    const int8x16_t x[] = {load_inputs<sizeof...(group)>(inputs + p * stride)...};
    (multiply_add<group>(pixels, vectors, sums, weights, x), ...);
    inputs += sizeof...(group) * gemm_group;
    weights += sizeof...(group) * sizeof...(v) * 16;
}

template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_pixel(const int32x4_t* sums, const Requantizer& requantize, std::size_t held,
                                               std::uint8_t* result) {
    constexpr std::size_t b = vectors > 1 ? 1 : 0, c = vectors > 2 ? 2 : 0, d = vectors > 3 ? 3 : 0;
    store_first(result, requantize(sums[0], sums[b], sums[c], sums[d]), held);
}

struct gemm_kernel {
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_segment(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                   int32x4_t* sums, const std::uint8_t* x, const gemm_panel& panel,
                                                   const std::int8_t*& weights) {
        const std::size_t stride = panel.pixel_stride;
        for (std::size_t g = panel.groups / 4; g > 0; --g)
            multiply_add(std::make_integer_sequence<int, 4>{}, pixels, vectors, sums, weights, x, stride);
        if (panel.groups % 4 >= 2) multiply_add(std::make_integer_sequence<int, 2>{}, pixels, vectors, sums, weights, x, stride);
        if (panel.groups % 2 == 1) multiply_add(std::make_integer_sequence<int, 1>{}, pixels, vectors, sums, weights, x, stride);
    }

    template <class Requantizer, std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void store(std::index_sequence<p...>, std::index_sequence<v...>, const int32x4_t* sums,
                                             const gemm_panel& panel, const Requantizer& requantize, std::uint8_t* result) {
        (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, panel.held, result + p * panel.outputs), ...);
    }
};
using gemm_half_kernel = gemm_kernel;

#include <ldi/kernels/gemm_u8/generic/walk.hpp>

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    gemm_u8_panels<relu_requantizer, requantizer>(
        weights.outputs, weights.output, gemm_panel(weights, weights.narrow.data(), segments, pixel_stride, pixels, result));
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
