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

namespace conv_u8_set {

inline constexpr std::size_t width = 4, max_vectors = 2, group = 2, pixels[] = {6, 4};
using sums_type = v128_t;
using inputs_type = v128_t;
using weights_type = v128_t;

[[gnu::always_inline]] inline v128_t load_inputs(const std::uint8_t* from, std::size_t count) {
    const std::int32_t second = count == group ? from[1] : 0;
    return wasm_i32x4_splat(from[0] | second << 16);
}
[[gnu::always_inline]] inline v128_t load_weights(const std::uint8_t* from) { return wasm_i16x8_load8x8(from); }
[[gnu::always_inline]] inline v128_t add_products(v128_t sums, v128_t inputs, v128_t weights) {
    return wasm_i32x4_add(sums, wasm_i32x4_dot_i16x8(inputs, weights));
}

template <class Result>
[[gnu::always_inline]] inline void finish_vector(const detail::conv_u8_panel_output<Result>& out, std::size_t pixel,
                                                 std::size_t from, v128_t sums, float ratio) {
    std::int32_t lanes[width];
    wasm_v128_store(lanes, sums);
    for (std::size_t o = from; o < from + width && o < out.count; ++o)
        out.values[pixel * out.stride + o] = scalar::finish_conv_u8<Result>(
            lanes[o - from] + out.offsets[o], out.scales[o] * ratio, out.bias[o], out.negative_slope, out.zero_point);
}

}  // namespace conv_u8_set

#include <ldi/kernels/conv_u8/generic/tiles.hpp>

#include <ldi/kernels/conv_u8/generic/conv_u8.hpp>

}}}  // namespace ldi::wasm_simd128

#endif
