// kernels/add_u8.hpp with NEON: the integer form, 4 values at a time.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_neon.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

struct adder {
    int32x4_t bias, a_multiplier, b_multiplier;
    rounding_shifter round;

    explicit adder(const quantized_addition& sum)
        : bias(vdupq_n_s32(sum.bias)),
          a_multiplier(vdupq_n_s32(sum.a_multiplier)),
          b_multiplier(vdupq_n_s32(sum.b_multiplier)),
          round(sum.shift, sum.zero_point) {}

    [[gnu::always_inline]] int32x4_t four(uint16x4_t a, uint16x4_t b) const {
        const int32x4_t x = vreinterpretq_s32_u32(vmovl_u16(a)), y = vreinterpretq_s32_u32(vmovl_u16(b));
        return vmlaq_s32(vmlaq_s32(bias, x, a_multiplier), y, b_multiplier);
    }

    [[gnu::always_inline]] uint8x16_t operator()(uint8x16_t a, uint8x16_t b) const {
        const uint16x8_t a_low = vmovl_u8(vget_low_u8(a)), a_high = vmovl_high_u8(a);
        const uint16x8_t b_low = vmovl_u8(vget_low_u8(b)), b_high = vmovl_high_u8(b);
        return round(four(vget_low_u16(a_low), vget_low_u16(b_low)), four(vget_high_u16(a_low), vget_high_u16(b_low)),
                     four(vget_low_u16(a_high), vget_low_u16(b_high)), four(vget_high_u16(a_high), vget_high_u16(b_high)));
    }
};

inline void add_u8(const add_u8_constants& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    const adder add(sum.exact);
    std::size_t i = 0;
    for (; i + 16 <= count; i += 16) vst1q_u8(result + i, add(vld1q_u8(a + i), vld1q_u8(b + i)));
    if (i == count) return;
    std::uint8_t rest[2][16] = {};
    std::memcpy(rest[0], a + i, count - i);
    std::memcpy(rest[1], b + i, count - i);
    store_first(result + i, add(vld1q_u8(rest[0]), vld1q_u8(rest[1])), count - i);
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
