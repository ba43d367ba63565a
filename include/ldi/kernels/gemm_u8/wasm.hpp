// kernels/gemm_u8.hpp with i32x4.dot_i16x8_s, which adds two products of 16-bit values in each of 4 lanes, exactly.
//
// Except for single outputs (generic/single_output.hpp), the kernel first widens to 16 bits as many pixels as fit in the
// first-level cache. A load then broadcasts two inputs, which the panel's vectors share. V8 has 15 registers to allocate, and
// moves all loads to the front of the loop. A tile therefore has at most 14 live vectors: 8 of sums, 2 of weights and 4 of
// inputs.
#pragma once

#include <ldi/kernels/detail/lanes_wasm.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

inline constexpr std::size_t gemm_lanes = 4, gemm_max_vectors = 2, gemm_tile_pixels[] = {4, 4}, gemm_group = 2;
inline constexpr std::size_t gemm_widened = 4 * detail::max_unfused_inputs;  // values widened at a time

/// Packs weights panel by panel, segment by segment, in pairs of inputs: vectors of 4 outputs x 2 inputs.
inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const detail::panel_layout panels{gemm_group, gemm_lanes, gemm_max_vectors};
    detail::append_weights(packed.wide, packed, weights, weight_zero_point, 1,
                           packed.is_single_output() ? detail::single_output_layout(8) : panels);
}

/// Pixels widened to 16 bits.
struct widened_pixels {
    std::int16_t values[gemm_widened];
    const std::int16_t* starts[gemm_u8_data::max_segments];  // start of each segment
    std::size_t segment_count, segment_stride, pixel_stride, max_pixels;

    widened_pixels(const gemm_u8_data& weights, std::size_t input_stride)
        : segment_count(weights.segments),
          segment_stride(gemm_widened / weights.segments),
          // Overlapping and adjacent windows keep their distance. Gaps between other windows are not stored.
          pixel_stride(input_stride <= weights.inputs ? input_stride : weights.inputs) {
        for (std::size_t s = 0; s < segment_count; ++s) starts[s] = values + s * segment_stride;
        const std::size_t fit = (segment_stride - weights.inputs - 1) / (pixel_stride > 0 ? pixel_stride : 1) + 1;
        max_pixels = fit < gemm_tile_pixels[0] ? fit : fit / gemm_tile_pixels[0] * gemm_tile_pixels[0];
    }

    void fill(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t input_stride, std::size_t first,
              std::size_t count) {
        for (std::size_t s = 0; s < segment_count; ++s) {
            const std::uint8_t* const from = segments[s] + first * input_stride;
            std::int16_t* const to = values + s * segment_stride;
            if (input_stride == pixel_stride)
                widen(from, (count - 1) * pixel_stride + weights.inputs, to);
            else
                for (std::size_t p = 0; p < count; ++p) widen(from + p * input_stride, weights.inputs, to + p * pixel_stride);
            to[(count - 1) * pixel_stride + weights.inputs] = 0;  // for an odd number of inputs, the kernel reads one extra value
        }
    }
};

using gemm_panel = detail::gemm_panel_of<std::int16_t, const std::int16_t*, gemm_group>;
using gemm_vector = v128_t;
[[gnu::always_inline]] inline v128_t load_bias(const std::int32_t* from) { return wasm_v128_load(from); }

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, v128_t* sums, const std::int16_t* inputs,
                                                const v128_t* weights) {
    const v128_t two = wasm_v128_load32_splat(inputs);
    ((sums[v] = wasm_i32x4_add(sums[v], wasm_i32x4_dot_i16x8(two, weights[v]))), ...);
}

/// Applies a requantization to vectors: for layers without an exact unfused_requantization.
struct integer_requantizer {
    v128_t multiplier, mask, half, zero_point;
    std::uint32_t shift;

    explicit integer_requantizer(const requantization& r)
        : multiplier(wasm_i32x4_splat(r.multiplier)),
          mask(wasm_i32x4_splat(static_cast<std::int32_t>((std::uint32_t{1} << r.shift) - 1))),
          half(wasm_u32x4_shr(mask, 1)),
          zero_point(wasm_i32x4_splat(r.zero_point)),
          shift(static_cast<std::uint32_t>(r.shift)) {}

    /// Adds the zero point, but does not clamp to 0.
    [[gnu::always_inline]] v128_t operator()(v128_t sums) const {
        const v128_t rounding = wasm_i64x2_splat(std::int64_t{1} << 30);
        const v128_t low = wasm_i64x2_add(wasm_i64x2_extmul_low_i32x4(sums, multiplier), rounding);
        const v128_t high = wasm_i64x2_add(wasm_i64x2_extmul_high_i32x4(sums, multiplier), rounding);
        const v128_t value = wasm_i32x4_shuffle(wasm_i64x2_shr(low, 31), wasm_i64x2_shr(high, 31), 0, 2, 4, 6);
        const v128_t remainder = wasm_i32x4_add(wasm_v128_and(value, mask), wasm_i32x4_shr(value, 31));
        const v128_t rounded = wasm_i32x4_sub(wasm_i32x4_shr(value, shift), wasm_i32x4_gt(remainder, half));
        return wasm_i32x4_add(wasm_i32x4_min(rounded, wasm_i32x4_splat(255)), zero_point);
    }
};

template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_pixel(const v128_t* sums, const Requantizer& requantize, std::size_t held,
                                               std::uint8_t* result) {
    const v128_t a = requantize(sums[0]), b = vectors > 1 ? requantize(sums[vectors - 1]) : a;
    store_first(result, narrow(a, b, a, b), held);
}

struct gemm_kernel {
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_segment(std::index_sequence<p...>, std::index_sequence<v...> vectors, v128_t* sums,
                                                   const std::int16_t* x, const gemm_panel& panel, const std::int16_t*& weights) {
        const std::size_t groups = panel.groups, stride = panel.pixel_stride;
        for (std::size_t g = 0; g < groups; ++g) {
            const v128_t w[] = {wasm_v128_load(weights + v * gemm_lanes * gemm_group)...};
            (multiply_add(vectors, sums + p * sizeof...(v), x + p * stride, w), ...);
            x += gemm_group;
            weights += sizeof...(v) * gemm_lanes * gemm_group;
        }
    }

    template <class Requantizer, std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void store(std::index_sequence<p...>, std::index_sequence<v...>, const v128_t* sums,
                                             const gemm_panel& panel, const Requantizer& requantize, std::uint8_t* result) {
        (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, panel.held, result + p * panel.outputs), ...);
    }
};
using gemm_half_kernel = gemm_kernel;

#include <ldi/kernels/gemm_u8/generic/walk.hpp>

template <bool is_unfused>
void gemm_u8_widened(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                     std::size_t pixels, std::uint8_t* result) {
    widened_pixels input(weights, pixel_stride);
    for (std::size_t done = 0; done < pixels;) {
        const std::size_t count = pixels - done < input.max_pixels ? pixels - done : input.max_pixels;
        input.fill(weights, segments, pixel_stride, done, count);
        const gemm_panel panel(weights, weights.wide.data(), input.starts, input.pixel_stride, count,
                               result + done * weights.outputs);
        if constexpr (is_unfused)
            gemm_u8_panels<requantizer<true>, requantizer<false>>(weights.outputs, weights.fast, panel);
        else
            gemm_u8_panels<integer_requantizer, integer_requantizer>(weights.outputs, weights.output, panel);
        done += count;
    }
}

inline constexpr std::size_t single_output_inputs = 8, single_output_pixels = 1;

[[gnu::always_inline]] inline v128_t add_inputs(v128_t sums, const std::uint8_t* from, const std::int16_t* weights) {
    return wasm_i32x4_add(sums, wasm_i32x4_dot_i16x8(wasm_u16x8_load8x8(from), wasm_v128_load(weights)));
}
[[gnu::always_inline]] inline void store_totals(const v128_t* sums, std::int32_t start, std::int32_t* to) {
    const v128_t pairs = wasm_i32x4_add(*sums, wasm_i32x4_shuffle(*sums, *sums, 2, 3, 0, 1));
    *to = start + wasm_i32x4_extract_lane(pairs, 0) + wasm_i32x4_extract_lane(pairs, 1);
}

#include <ldi/kernels/gemm_u8/generic/single_output.hpp>

template <bool is_unfused>
void gemm_u8_single_output(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                           std::size_t pixels, std::uint8_t* result) {
    const std::int16_t* const values = weights.wide.data();
    if constexpr (is_unfused)
        gemm_u8_single_output(weights, values, requantizer<false>(weights.fast), segments, pixel_stride, pixels, result);
    else
        gemm_u8_single_output(weights, values, integer_requantizer(weights.output), segments, pixel_stride, pixels, result);
}

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    // a table, because Binaryen inlines functions with a single caller
    static constexpr void (*kinds[])(const gemm_u8_data&, const std::uint8_t* const*, std::size_t, std::size_t, std::uint8_t*) = {
        gemm_u8_widened<false>, gemm_u8_widened<true>, gemm_u8_single_output<false>, gemm_u8_single_output<true>};
    kinds[2 * std::size_t{weights.is_single_output()} + std::size_t{weights.has_float_form()}](weights, segments, pixel_stride,
                                                                                               pixels, result);
}

}}}  // namespace ldi::wasm_simd128

#endif
