// Shared parts of the WebAssembly SIMD128 kernels: requantization of 32-bit sums, and the loops of convolutions.
//
// Engines first compile every function to slow code and switch a hot function to fast code at its next call. Hot loops are
// therefore separate functions that are called often. The calls go through tables, because Binaryen inlines functions that have
// a single caller.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/detail/target.hpp>
#include <ldi/kernels/requantize_float.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

/// Rounding constant. Adding it to a float between -2^22 and 2^22 rounds the float to the nearest integer, halves to even, and
/// leaves this integer in the low bits of the sum. For floats from -2^23 to -2^22, the result is monotonic but not exact.
/// WebAssembly's own conversion from float to integer would compile to six x86 instructions.
inline constexpr float rounding_magic = 0x1.8p23F;
inline constexpr std::int32_t rounding_magic_bits = 0x4B400000;

/// Applies an unfused_requantization to vectors.
///
/// positive  if true, adds the same offset to all values; if false, gives the offset the sign of each value. True requires a
///           zero point of 0, because negative values then clamp to 0 with either offset
template <bool positive>
struct requantizer {
    v128_t scale, offset, sign, magic, magic_bits;

    explicit requantizer(const float_requantization& r)
        : scale(wasm_f32x4_splat(r.scale)),
          offset(wasm_f32x4_splat(r.offset)),
          sign(wasm_i32x4_splat(-0x7FFFFFFF - 1)),
          magic(wasm_f32x4_splat(rounding_magic)),
          magic_bits(wasm_i32x4_splat(rounding_magic_bits - r.zero_point)) {}

    /// Adds the zero point, but does not clamp.
    [[gnu::always_inline]] v128_t operator()(v128_t sums) const {
        const v128_t value = wasm_f32x4_mul(wasm_f32x4_convert_i32x4(sums), scale);
        const v128_t signed_offset = positive ? offset : wasm_v128_xor(wasm_v128_and(value, sign), offset);
        return wasm_i32x4_sub(wasm_f32x4_add(wasm_f32x4_add(value, signed_offset), magic), magic_bits);
    }
};

/// Clamps four vectors of 32-bit values to bytes, in order.
[[gnu::always_inline]] inline v128_t narrow(v128_t a, v128_t b, v128_t c, v128_t d) {
    return wasm_u8x16_narrow_i16x8(wasm_i16x8_narrow_i32x4(a, b), wasm_i16x8_narrow_i32x4(c, d));
}

/// Writes the first `count` bytes, at most 16.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, v128_t values, std::size_t count) {
    if (count == 16) return wasm_v128_store(to, values);
    if (count == 8) return wasm_v128_store64_lane(to, values, 0);
    if (count == 4) return wasm_v128_store32_lane(to, values, 0);
    std::uint8_t bytes[16];
    wasm_v128_store(bytes, values);
    std::memcpy(to, bytes, count);
}

/// Widens bytes to 16-bit values.
inline void widen(const std::uint8_t* from, std::size_t count, std::int16_t* to) {
    std::size_t i = 0;
    for (; i + 16 <= count; i += 16) {
        const v128_t bytes = wasm_v128_load(from + i);
        wasm_v128_store(to + i, wasm_u16x8_extend_low_u8x16(bytes));
        wasm_v128_store(to + i + 8, wasm_u16x8_extend_high_u8x16(bytes));
    }
    for (; i < count; ++i) to[i] = from[i];
}

/// Writes the first `count` values, at least one.
[[gnu::always_inline]] inline void store_first(float* to, v128_t values, std::size_t count) {
    if (count >= 4) return wasm_v128_store(to, values);
    wasm_v128_store32_lane(to, values, 0);
    if (count > 1) wasm_v128_store32_lane(to + 1, values, 1);
    if (count > 2) wasm_v128_store32_lane(to + 2, values, 2);
}

#include <ldi/kernels/detail/generic/conv_tiles.hpp>
#include <ldi/kernels/detail/generic/conv_walk.hpp>

}}}  // namespace ldi::wasm_simd128

#endif
