// kernels/add_u8.hpp with WebAssembly SIMD128: float arithmetic on 4 values per vector.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

struct adder {
    static constexpr std::size_t width = 16;
    v128_t a_scale, b_scale, offset, magic, magic_bits;

    explicit adder(const add_u8_constants& sum)
        : a_scale(wasm_f32x4_splat(sum.a_scale)),
          b_scale(wasm_f32x4_splat(sum.b_scale)),
          offset(wasm_f32x4_splat(sum.offset)),
          magic(wasm_f32x4_splat(rounding_magic)),
          magic_bits(wasm_i32x4_splat(rounding_magic_bits)) {}

    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const v128_t x = wasm_v128_load(a), y = wasm_v128_load(b);
        const v128_t low = eight(wasm_u16x8_extend_low_u8x16(x), wasm_u16x8_extend_low_u8x16(y));
        const v128_t high = eight(wasm_u16x8_extend_high_u8x16(x), wasm_u16x8_extend_high_u8x16(y));
        wasm_v128_store(result, wasm_u8x16_narrow_i16x8(low, high));
    }

private:
    /// Converts to float. Hides the values' origin, because clang converts values that it knows to be positive as unsigned,
    /// which costs eight x86 instructions instead of one.
    [[gnu::always_inline]] static v128_t to_float(v128_t values) {
        asm("" : "+r"(values));
        return wasm_f32x4_convert_i32x4(values);
    }
    [[gnu::always_inline]] v128_t eight(v128_t a, v128_t b) const {
        return wasm_i16x8_narrow_i32x4(four(wasm_u32x4_extend_low_u16x8(a), wasm_u32x4_extend_low_u16x8(b)),
                                       four(wasm_u32x4_extend_high_u16x8(a), wasm_u32x4_extend_high_u16x8(b)));
    }
    [[gnu::always_inline]] v128_t four(v128_t a, v128_t b) const {
        const v128_t x = wasm_f32x4_mul(to_float(a), a_scale), y = wasm_f32x4_mul(to_float(b), b_scale);
        return wasm_i32x4_sub(wasm_f32x4_add(wasm_f32x4_add(x, wasm_f32x4_add(y, offset)), magic), magic_bits);
    }
};

#include <ldi/kernels/add_u8/generic/walk.hpp>

}}}  // namespace ldi::wasm_simd128

#endif
