// kernels/add_u8.hpp with WebAssembly SIMD128: float arithmetic on 4 values per vector, or integer arithmetic where no float
// form is exact.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_wasm.hpp>

#if LDI_HAS_WASM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace wasm_simd128 {

struct float_sums {
    v128_t a_scale, b_scale, offset, magic, magic_bits;

    explicit float_sums(const add_u8_data& sum)
        : a_scale(wasm_f32x4_splat(sum.a_scale)),
          b_scale(wasm_f32x4_splat(sum.b_scale)),
          offset(wasm_f32x4_splat(sum.offset)),
          magic(wasm_f32x4_splat(rounding_magic)),
          magic_bits(wasm_i32x4_splat(rounding_magic_bits)) {}

    [[gnu::always_inline]] v128_t eight(v128_t a, v128_t b) const {
        return wasm_i16x8_narrow_i32x4(four(wasm_u32x4_extend_low_u16x8(a), wasm_u32x4_extend_low_u16x8(b)),
                                       four(wasm_u32x4_extend_high_u16x8(a), wasm_u32x4_extend_high_u16x8(b)));
    }

private:
    /// Converts to float. Hides from clang that no value is negative: otherwise, clang would convert the values as unsigned
    /// integers, which costs eight x86 instructions instead of one.
    [[gnu::always_inline]] static v128_t to_float(v128_t values) {
        asm("" : "+r"(values));
        return wasm_f32x4_convert_i32x4(values);
    }
    [[gnu::always_inline]] v128_t four(v128_t a, v128_t b) const {
        const v128_t x = wasm_f32x4_mul(to_float(a), a_scale), y = wasm_f32x4_mul(to_float(b), b_scale);
        return wasm_i32x4_sub(wasm_f32x4_add(wasm_f32x4_add(x, wasm_f32x4_add(y, offset)), magic), magic_bits);
    }
};

struct integer_sums {
    v128_t bias, a_multiplier, b_multiplier, zero_point;
    std::uint32_t shift;  ///< the addition's shift minus 1; rounding shifts by 1 more bit

    explicit integer_sums(const add_u8_data& sum)
        : bias(wasm_i32x4_splat(sum.exact.bias)),
          a_multiplier(wasm_i32x4_splat(sum.exact.a_multiplier)),
          b_multiplier(wasm_i32x4_splat(sum.exact.b_multiplier)),
          zero_point(wasm_i16x8_splat(static_cast<std::int16_t>(sum.exact.zero_point))),
          shift(static_cast<std::uint32_t>(sum.exact.shift - 1)) {}

    [[gnu::always_inline]] v128_t eight(v128_t a, v128_t b) const {
        const v128_t low = four(wasm_u32x4_extend_low_u16x8(a), wasm_u32x4_extend_low_u16x8(b));
        const v128_t high = four(wasm_u32x4_extend_high_u16x8(a), wasm_u32x4_extend_high_u16x8(b));
        return wasm_i16x8_add_sat(wasm_i16x8_narrow_i32x4(low, high), zero_point);
    }

private:
    /// To divide by a power of two, adds one half and shifts, which rounds halves up. Negative halves must round down, away from
    /// zero, so the function first subtracts 1 from negative values.
    [[gnu::always_inline]] v128_t four(v128_t a, v128_t b) const {
        const v128_t products = wasm_i32x4_add(wasm_i32x4_mul(a, a_multiplier), wasm_i32x4_mul(b, b_multiplier));
        const v128_t sums = wasm_i32x4_add(products, bias);
        const v128_t twice = wasm_i32x4_shr(wasm_i32x4_add(sums, wasm_i32x4_shr(sums, 31)), shift);
        return wasm_i32x4_shr(wasm_i32x4_add(twice, wasm_i32x4_splat(1)), 1);
    }
};

/// Adds 16 bytes. Sums::eight() adds 8 values that were extended to 16 bits.
template <class Sums>
struct adder : Sums {
    static constexpr std::size_t width = 16;
    using Sums::Sums;

    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const v128_t x = wasm_v128_load(a), y = wasm_v128_load(b);
        const v128_t low = Sums::eight(wasm_u16x8_extend_low_u8x16(x), wasm_u16x8_extend_low_u8x16(y));
        const v128_t high = Sums::eight(wasm_u16x8_extend_high_u8x16(x), wasm_u16x8_extend_high_u8x16(y));
        wasm_v128_store(result, wasm_u8x16_narrow_i16x8(low, high));
    }
};
using float_adder = adder<float_sums>;
using integer_adder = adder<integer_sums>;

#include <ldi/kernels/add_u8/generic/walk.hpp>
#include <ldi/kernels/add_u8/generic/walk_forms.hpp>

}}}  // namespace ldi::wasm_simd128

#endif
