// kernels/conv_u8.hpp with NEON: sdot computes four products of signed bytes for each of 4 lanes. The kernel subtracts 128 from
// the inputs; `offsets` compensates.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_neon.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

/// Rounds, clamps and writes the first `count` values, at least one.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, float32x4_t values, std::size_t count) {
    const float32x4_t clamped = vminq_f32(vmaxq_f32(values, vdupq_n_f32(0.0F)), vdupq_n_f32(255.0F));
    const uint16x4_t words = vmovn_u32(vcvtnq_u32_f32(clamped));
    const uint8x8_t bytes = vmovn_u16(vcombine_u16(words, words));
    std::uint8_t all[8];
    vst1_u8(all, bytes);
    std::memcpy(to, all, count < 4 ? count : 4);
}

struct conv_u8_set {
    static constexpr detail::panel_layout layout{4, 4, 4};
    static constexpr std::size_t pixels[] = {12, 8, 6, 5}, rest_pixels = 4;
    using sums_type = int32x4_t;
    using weights_type = int8x16_t;

    [[gnu::always_inline]] static int8x16_t load_inputs(const std::uint8_t* from, std::size_t count) {
        std::uint32_t four = 0;
        std::memcpy(&four, from, count);
        return to_signed(vreinterpretq_u8_u32(vdupq_n_u32(four)));
    }
    [[gnu::always_inline]] static int8x16_t load_weights(const std::int8_t* from) { return load(from); }
    [[gnu::always_inline]] static int32x4_t add_products(int32x4_t sums, int8x16_t inputs, int8x16_t weights) {
        return neon::add_products(sums, inputs, weights);
    }

    template <class Result>
    [[gnu::always_inline]] static void finish(const detail::conv_u8_panel_output<Result>& out, std::size_t pixel,
                                              std::size_t from, int32x4_t sums, float ratio) {
        const float32x4_t exact = vcvtq_f32_s32(vaddq_s32(sums, load(out.offsets + from)));
        const float32x4_t scales = vmulq_f32(load(out.scales + from), vdupq_n_f32(ratio));
        const float32x4_t value = vmaxq_f32(vdupq_n_f32(out.lowest), vfmaq_f32(load(out.bias + from), exact, scales));
        const float32x4_t zero_point = vdupq_n_f32(out.zero_point);
        const float32x4_t activated =
            vmaxnmq_f32(vfmaq_f32(zero_point, value, vdupq_n_f32(out.negative_slope)), vaddq_f32(value, zero_point));
        store_first(out.values + pixel * out.stride + from, activated, out.count - from);
    }
};
using conv_u8_tiles = conv_tiles<conv_pieces<conv_u8_set>>;

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
