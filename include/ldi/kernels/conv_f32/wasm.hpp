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

struct conv_f32_set {
    static constexpr detail::panel_layout layout{1, 4, 2};
    static constexpr std::size_t pixels[] = {6, 4}, rest_pixels = 4;
    using sums_type = v128_t;
    using weights_type = v128_t;

    [[gnu::always_inline]] static v128_t add_products(v128_t sums, v128_t inputs, v128_t weights) {
        return wasm_f32x4_add(sums, wasm_f32x4_mul(inputs, weights));
    }

    template <std::size_t... p, std::size_t... v, class Input>
    [[gnu::always_inline]] static void add_piece(std::index_sequence<p...>, std::index_sequence<v...> vectors, v128_t* sums,
                                                 const float* inputs, const Input& from, std::size_t, const float*& weights) {
        const float* x[] = {inputs + p * from.pixel_stride...};
        for (std::size_t i = 0; i < from.inputs; ++i) {
            const v128_t w[] = {wasm_v128_load(weights + v * layout.lanes)...};
            (add_group<conv_f32_set>(vectors, sums + p * sizeof...(v), wasm_v128_load32_splat(x[p]++), w), ...);
            weights += sizeof...(v) * layout.lanes;
        }
    }

    [[gnu::always_inline]] static void finish(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                              v128_t sums, float ratio) {
        const v128_t value = wasm_f32x4_add(wasm_f32x4_mul(sums, wasm_f32x4_splat(ratio)), wasm_v128_load(out.bias + from));
        const v128_t finite = wasm_f32x4_pmax(value, wasm_f32x4_splat(out.lowest));
        const v128_t activated = wasm_f32x4_pmax(finite, wasm_f32x4_mul(finite, wasm_f32x4_splat(out.negative_slope)));
        store_first(out.values + pixel * out.stride + from, activated, out.count - from);
    }
};
using conv_f32_tiles = conv_tiles<conv_f32_set>;

}}}  // namespace ldi::wasm_simd128

#endif
