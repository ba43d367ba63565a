// kernels/conv_u8.hpp with WebAssembly's i32x4.dot_i16x8_s: two products for each of 4 lanes. SIMD128 has no fused multiply-add.
// The scalar code therefore converts the sums to results, so that the bits are the same.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/conv_u8/scalar.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

struct conv_u8_set {
    static constexpr detail::panel_layout layout{2, 4, 2};
    static constexpr std::size_t pixels[] = {6, 4}, rest_pixels = 4;
    using sums_type = v128_t;
    using weights_type = v128_t;

    [[gnu::always_inline]] static v128_t load_inputs(const std::uint8_t* from, std::size_t count) {
        const std::int32_t second = count == layout.group ? from[1] : 0;
        return wasm_i32x4_splat(from[0] | second << 16);
    }
    [[gnu::always_inline]] static v128_t load_weights(const std::int8_t* from) { return wasm_i16x8_load8x8(from); }
    [[gnu::always_inline]] static v128_t add_products(v128_t sums, v128_t inputs, v128_t weights) {
        return wasm_i32x4_add(sums, wasm_i32x4_dot_i16x8(inputs, weights));
    }

    template <class Result>
    [[gnu::always_inline]] static void finish(const detail::conv_u8_panel_output<Result>& out, std::size_t pixel,
                                              std::size_t from, v128_t sums, float ratio) {
        std::int32_t lanes[layout.lanes];
        wasm_v128_store(lanes, sums);
        for (std::size_t o = from; o < from + layout.lanes && o < out.count; ++o)
            out.values[pixel * out.stride + o] = scalar::finish_conv_u8<Result>(
                lanes[o - from] + out.offsets[o], out.scales[o] * ratio, out.bias[o], out.negative_slope, out.zero_point);
    }
};
using conv_u8_tiles = conv_tiles<conv_pieces<conv_u8_set>>;

}}}  // namespace ldi::wasm_simd128

#endif
