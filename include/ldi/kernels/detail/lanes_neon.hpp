// Shared parts of the NEON kernels: the dot product, products of tiles, requantization of 32-bit sums, and the loops of
// convolutions. NEON has instructions for the steps of the integer requantization (sqrdmulh, srshl). The integer form costs 2 to
// 4 instructions for 4 values, fewer than the float form on other instruction sets, and is exact for every scale.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/detail/target.hpp>
#include <ldi/kernels/requantize.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

// The functions below use inline assembly, because clang before version 16 has the intrinsics only in translation units
// compiled for this instruction set.

/// Adds four products of signed bytes to each of 4 sums.
[[gnu::always_inline]] inline int32x4_t add_products(int32x4_t sums, int8x16_t a, int8x16_t b) {
    asm("sdot %0.4s, %1.16b, %2.16b" : "+w"(sums) : "w"(a), "w"(b));
    return sums;
}

/// Same as add_products(), but multiplies every group of four bytes of a by the same group of b: bytes 4 * lane to 4 * lane +
/// 3.
template <int lane>
[[gnu::always_inline]] inline int32x4_t add_products_with(int32x4_t sums, int8x16_t a, int8x16_t b) {
    asm("sdot %0.4s, %1.16b, %2.4b[%3]" : "+w"(sums) : "w"(a), "w"(b), "i"(lane));
    return sums;
}

// Wrappers, because clang's vld1q_*() are macros that expand to statement expressions, which cannot contain a parameter pack.
[[gnu::always_inline]] inline int8x16_t load(const std::int8_t* from) { return vld1q_s8(from); }
[[gnu::always_inline]] inline int32x4_t load(const std::int32_t* from) { return vld1q_s32(from); }
[[gnu::always_inline]] inline float32x4_t load(const float* from) { return vld1q_f32(from); }

// Products of tiles. The class Products has these members:
//
//     group                                      inputs per lane of a vector of inputs, and weights per output
//     inputs_type                                vector of inputs, or of the weights of 4 outputs
//     load_inputs<count>(from)                   loads 1, 2 or 4 groups of inputs into the first lanes
//     multiply_add<lane>(sums, weights, inputs)  multiply-adds the weights of 4 outputs and one lane of the inputs

/// Multiplies the weights of 4 outputs by one lane of every pixel's inputs, and adds the products to one vector of sums per
/// pixel.
template <class Products, int lane, class Sums, class Inputs, std::size_t... p>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, Sums* sums, std::size_t vectors, Inputs weights,
                                                const Inputs* inputs) {
    ((sums[p * vectors] = Products::template multiply_add<lane>(sums[p * vectors], weights, inputs[p])), ...);
}

/// Multiply-adds one lane of every pixel's inputs. Loads one vector of weights at a time, so that weights occupy one register.
template <class Products, int lane, class Sums, class Weight, class Inputs, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...> pixels, std::index_sequence<v...>, Sums* sums,
                                                const Weight* weights, const Inputs* inputs) {
    constexpr std::size_t vector = 4 * Products::group;
    (multiply_add<Products, lane>(pixels, sums + v, sizeof...(v), load(weights + (lane * sizeof...(v) + v) * vector), inputs),
     ...);
}

/// Multiply-adds sizeof...(lane) groups of inputs of every pixel.
template <class Products, int... lane, class Sums, class Weight, class Input, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::integer_sequence<int, lane...>, std::index_sequence<p...> pixels,
                                                std::index_sequence<v...> vectors, Sums* sums, const Weight*& weights,
                                                const Input*& inputs, std::size_t stride) {
    const typename Products::inputs_type x[] = {Products::template load_inputs<sizeof...(lane)>(inputs + p * stride)...};
    (multiply_add<Products, lane>(pixels, vectors, sums, weights, x), ...);
    inputs += sizeof...(lane) * Products::group;
    weights += sizeof...(lane) * sizeof...(v) * 4 * Products::group;
}

/// Multiply-adds `groups` groups of inputs of every pixel, and advances `weights` past the weights of these groups.
template <class Products, class Pixels, class Vectors, class Sums, class Weight, class Input>
[[gnu::always_inline]] inline void multiply_add_groups(Pixels pixels, Vectors vectors, Sums* sums, const Weight*& weights,
                                                       const Input* inputs, std::size_t stride, std::size_t groups) {
    for (std::size_t i = groups / 4; i > 0; --i)
        multiply_add<Products>(std::make_integer_sequence<int, 4>{}, pixels, vectors, sums, weights, inputs, stride);
    if (groups % 4 >= 2)
        multiply_add<Products>(std::make_integer_sequence<int, 2>{}, pixels, vectors, sums, weights, inputs, stride);
    if (groups % 2 == 1)
        multiply_add<Products>(std::make_integer_sequence<int, 1>{}, pixels, vectors, sums, weights, inputs, stride);
}

/// Subtracts 128 from activations, because sdot multiplies signed bytes. The packed biases or offsets compensate for this.
[[gnu::always_inline]] inline int8x16_t to_signed(uint8x16_t values) {
    return vreinterpretq_s8_u8(veorq_u8(values, vdupq_n_u8(0x80)));
}

/// Applies detail::rounding_shift() and detail::offset_and_clamp() to vectors.
struct rounding_shifter {
    int32x4_t shift, away_from_zero;
    int16x8_t zero_point;

    rounding_shifter(std::int32_t right, std::int32_t zero)
        : shift(vdupq_n_s32(-right)),
          away_from_zero(vdupq_n_s32(right == 0 ? 0 : -1)),
          zero_point(vdupq_n_s16(static_cast<std::int16_t>(zero))) {}

    /// srshl rounds halves up. Negative halves must round down, away from zero, so the function first subtracts 1 from negative
    /// values.
    [[gnu::always_inline]] int32x4_t operator()(int32x4_t values) const {
        return vrshlq_s32(vsraq_n_s32(values, vandq_s32(values, away_from_zero), 31), shift);
    }

    [[gnu::always_inline]] uint8x16_t operator()(int32x4_t a, int32x4_t b, int32x4_t c, int32x4_t d) const {
        const int16x8_t low = vqmovn_high_s32(vqmovn_s32((*this)(a)), (*this)(b));
        const int16x8_t high = vqmovn_high_s32(vqmovn_s32((*this)(c)), (*this)(d));
        return vqmovun_high_s16(vqmovun_s16(vqaddq_s16(low, zero_point)), vqaddq_s16(high, zero_point));
    }
};

/// Applies requantize() to vectors.
struct requantizer {
    int32x4_t multiplier;
    rounding_shifter round;

    explicit requantizer(const requantization& r) : multiplier(vdupq_n_s32(r.multiplier)), round(r.shift, r.zero_point) {}

    [[gnu::always_inline]] uint8x16_t operator()(int32x4_t a, int32x4_t b, int32x4_t c, int32x4_t d) const {
        return round(vqrdmulhq_s32(a, multiplier), vqrdmulhq_s32(b, multiplier), vqrdmulhq_s32(c, multiplier),
                     vqrdmulhq_s32(d, multiplier));
    }
};

/// Requantizes with a zero point of 0. Negative values need no special rounding, because they become 0.
struct relu_requantizer {
    int32x4_t multiplier, shift;

    explicit relu_requantizer(const requantization& r) : multiplier(vdupq_n_s32(r.multiplier)), shift(vdupq_n_s32(-r.shift)) {}

    [[gnu::always_inline]] int32x4_t scaled(int32x4_t sums) const { return vrshlq_s32(vqrdmulhq_s32(sums, multiplier), shift); }

    [[gnu::always_inline]] uint8x16_t operator()(int32x4_t a, int32x4_t b, int32x4_t c, int32x4_t d) const {
        const uint16x8_t low = vqmovun_high_s32(vqmovun_s32(scaled(a)), scaled(b));
        const uint16x8_t high = vqmovun_high_s32(vqmovun_s32(scaled(c)), scaled(d));
        return vqmovn_high_u16(vqmovn_u16(low), high);
    }
};

/// Writes the first `count` bytes, at most 16.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, uint8x16_t values, std::size_t count) {
    if (count == 16) {
        vst1q_u8(to, values);
    } else if (count == 12) {
        vst1_u8(to, vget_low_u8(values));
        const std::uint32_t four = vgetq_lane_u32(vreinterpretq_u32_u8(values), 2);
        std::memcpy(to + 8, &four, sizeof four);
    } else if (count == 8) {
        vst1_u8(to, vget_low_u8(values));
    } else {
        std::uint8_t bytes[16];
        vst1q_u8(bytes, values);
        std::memcpy(to, bytes, count);
    }
}

/// Writes the first `count` values, at least one.
[[gnu::always_inline]] inline void store_first(float* to, float32x4_t values, std::size_t count) {
    if (count >= 4) return vst1q_f32(to, values);
    vst1q_lane_f32(to, values, 0);
    if (count > 1) vst1q_lane_f32(to + 1, values, 1);
    if (count > 2) vst1q_lane_f32(to + 2, values, 2);
}

#include <ldi/kernels/detail/generic/conv_tiles.hpp>
#include <ldi/kernels/detail/generic/conv_walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
