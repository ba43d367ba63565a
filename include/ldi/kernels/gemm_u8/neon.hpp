// kernels/gemm_u8.hpp with sdot, which adds four products of signed bytes to each of 4 sums, exactly.
//
// One load fetches sixteen inputs of a pixel. sdot (by element) multiplies four of them by the weights of 4 outputs, without a
// separate broadcast instruction. The largest tile, 6 pixels by 4 vectors, keeps its sums in 24 of the 32 registers. Per 96 sdot
// (1536 products) it loads 22 vectors and converts 6 to signed: 12 products per instruction, compared to 16 for sdot alone.
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

inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
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

/// The primitives that multiply_add_groups() requires.
struct gemm_products {
    static constexpr std::size_t group = gemm_group;
    using inputs_type = int8x16_t;

    template <int lane>
    [[gnu::always_inline]] static int32x4_t multiply_add(int32x4_t sums, int8x16_t weights, int8x16_t inputs) {
        return add_products_with<lane>(sums, weights, inputs);
    }
    template <std::size_t count>
    [[gnu::always_inline]] static int8x16_t load_inputs(const std::uint8_t* from) {
        if constexpr (count == 4) return to_signed(vld1q_u8(from));
        if constexpr (count == 2) return to_signed(vcombine_u8(vld1_u8(from), vdup_n_u8(0)));
        std::uint32_t four = 0;
        std::memcpy(&four, from, sizeof four);
        return to_signed(vreinterpretq_u8_u32(vdupq_n_u32(four)));
    }
};

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
        multiply_add_groups<gemm_products>(pixels, vectors, sums, weights, x, panel.pixel_stride, panel.groups);
    }

    template <class Requantizer, std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void store(std::index_sequence<p...>, std::index_sequence<v...>, const int32x4_t* sums,
                                             const gemm_panel& panel, const Requantizer& requantize, std::uint8_t* result) {
        (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, panel.held, result + p * panel.outputs), ...);
    }
};
using gemm_half_kernel = gemm_kernel;

#include <ldi/kernels/gemm_u8/generic/walk.hpp>

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    gemm_u8_panels<relu_requantizer, requantizer>(
        weights.outputs, weights.output, gemm_panel(weights, weights.narrow.data(), segments, pixel_stride, pixels, result));
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
