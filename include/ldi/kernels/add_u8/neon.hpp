// kernels/add_u8.hpp with NEON: integer arithmetic on 4 values per vector.
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
    static constexpr std::size_t width = 16;
    int32x4_t bias, a_multiplier, b_multiplier;
    rounding_shifter round;

    explicit adder(const add_u8_data& sum)
        : bias(vdupq_n_s32(sum.exact.bias)),
          a_multiplier(vdupq_n_s32(sum.exact.a_multiplier)),
          b_multiplier(vdupq_n_s32(sum.exact.b_multiplier)),
          round(sum.exact.shift, sum.exact.zero_point) {}

    [[gnu::always_inline]] int32x4_t four(uint16x4_t a, uint16x4_t b) const {
        const int32x4_t x = vreinterpretq_s32_u32(vmovl_u16(a)), y = vreinterpretq_s32_u32(vmovl_u16(b));
        return vmlaq_s32(vmlaq_s32(bias, x, a_multiplier), y, b_multiplier);
    }

    [[gnu::always_inline]] void add(const std::uint8_t* from_a, const std::uint8_t* from_b, std::uint8_t* result) const {
        const uint8x16_t a = vld1q_u8(from_a), b = vld1q_u8(from_b);
        const uint16x8_t a_low = vmovl_u8(vget_low_u8(a)), a_high = vmovl_high_u8(a);
        const uint16x8_t b_low = vmovl_u8(vget_low_u8(b)), b_high = vmovl_high_u8(b);
        vst1q_u8(result,
                 round(four(vget_low_u16(a_low), vget_low_u16(b_low)), four(vget_high_u16(a_low), vget_high_u16(b_low)),
                       four(vget_low_u16(a_high), vget_low_u16(b_high)), four(vget_high_u16(a_high), vget_high_u16(b_high))));
    }
};

#include <ldi/kernels/add_u8/generic/walk.hpp>

inline void add_u8(const add_u8_data& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    add_with<adder>(sum, a, b, count, result);
}

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
