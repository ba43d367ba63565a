// kernels/conv_f32.hpp with WebAssembly's f32x4, which has no fused multiply-add: products are rounded.
//
// A load broadcasts an input to all lanes, and the panel's vectors share it. V8 has 15 registers to allocate, and moves all loads
// to the front of the loop. A tile of 4 pixels and 2 vectors therefore has 14 live vectors: 8 of sums, 2 of weights and 4 of
// inputs. Tiles process one input at a time, because V8 would load the second input before it computes the products of the
// first.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

inline constexpr std::size_t conv_width = 4, conv_max_vectors = 2;

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, v128_t* sums, const float* input,
                                                const v128_t* weights) {
    const v128_t x = wasm_v128_load32_splat(input);
    ((sums[v] = wasm_f32x4_add(sums[v], wasm_f32x4_mul(x, weights[v]))), ...);
}

[[gnu::always_inline]] inline void store_outputs(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                                 v128_t values) {
    const v128_t finite = wasm_f32x4_pmax(values, wasm_f32x4_splat(out.lowest));
    const v128_t activated = wasm_f32x4_pmax(finite, wasm_f32x4_mul(finite, wasm_f32x4_splat(out.negative_slope)));
    float* const to = out.values + pixel * out.stride + from;
    if (out.count >= from + conv_width) return wasm_v128_store(to, activated);
    if (out.count > from) wasm_v128_store32_lane(to, activated, 0);
    if (out.count > from + 1) wasm_v128_store32_lane(to + 1, activated, 1);
    if (out.count > from + 2) wasm_v128_store32_lane(to + 2, activated, 2);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void finish(std::index_sequence<v...>, const v128_t* sums,
                                          const detail::conv_panel_output<float>& out, std::size_t pixel) {
    const v128_t ratio = wasm_f32x4_splat(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
    (store_outputs(out, pixel, v * conv_width,
                   wasm_f32x4_add(wasm_f32x4_mul(sums[v], ratio), wasm_v128_load(out.bias + v * conv_width))),
     ...);
}

struct conv_f32_tiles {
    static constexpr std::size_t group = 1, width = conv_width, max_vectors = conv_max_vectors, rest_pixels = 4;
    static constexpr std::size_t pixels[] = {6, 4};

    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void tile(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                                            const detail::conv_panel_input<float>& input, std::size_t first_pixel,
                                            const detail::conv_panel_output<float>& out) {
        v128_t sums[sizeof...(p) * sizeof...(v)] = {};
        const float* weights = input.weights;
        for (std::size_t r = 0; r < input.row_count; ++r) {
            const float* x[] = {input.rows[r] + (first_pixel + p) * input.pixel_stride...};
            for (std::size_t i = 0; i < input.inputs; ++i) {
                const v128_t w[] = {wasm_v128_load(weights + v * conv_width)...};
                (multiply_add(vectors, sums + p * sizeof...(v), x[p]++, w), ...);
                weights += sizeof...(v) * conv_width;
            }
        }
        (finish(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
    }
};

#include <ldi/kernels/conv_f32/generic/conv_f32.hpp>

}}}  // namespace ldi::wasm_simd128

#endif
