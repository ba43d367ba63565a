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

namespace conv_u8_set {

inline constexpr std::size_t width = 4, max_vectors = 4, group = 4, pixels[] = {12, 8, 6, 5};
using sums_type = int32x4_t;
using inputs_type = int8x16_t;
using weights_type = int8x16_t;

[[gnu::always_inline]] inline int8x16_t load_inputs(const std::uint8_t* from, std::size_t count) {
    std::uint32_t four = 0;
    std::memcpy(&four, from, count);
    return to_signed(vreinterpretq_u8_u32(vdupq_n_u32(four)));
}
[[gnu::always_inline]] inline int8x16_t load_weights(const std::uint8_t* from) { return vreinterpretq_s8_u8(vld1q_u8(from)); }
[[gnu::always_inline]] inline int32x4_t add_products(int32x4_t sums, int8x16_t inputs, int8x16_t weights) {
    return neon::add_products(sums, inputs, weights);
}

[[gnu::always_inline]] inline void store_outputs(float* to, std::size_t count, float32x4_t values) {
    if (count >= width) return vst1q_f32(to, values);
    float all[width];
    vst1q_f32(all, values);
    std::memcpy(to, all, count * sizeof(float));
}
[[gnu::always_inline]] inline void store_outputs(std::uint8_t* to, std::size_t count, float32x4_t values) {
    const float32x4_t clamped = vminq_f32(vmaxq_f32(values, vdupq_n_f32(0.0F)), vdupq_n_f32(255.0F));
    const uint16x4_t words = vmovn_u32(vcvtnq_u32_f32(clamped));
    const uint8x8_t bytes = vmovn_u16(vcombine_u16(words, words));
    std::uint8_t all[8];
    vst1_u8(all, bytes);
    std::memcpy(to, all, count < width ? count : width);
}

template <class Result>
[[gnu::always_inline]] inline void finish_vector(const detail::conv_u8_panel_output<Result>& out, std::size_t pixel,
                                                 std::size_t from, int32x4_t sums, float ratio) {
    if (out.count <= from) return;
    const float32x4_t exact = vcvtq_f32_s32(vaddq_s32(sums, load(out.offsets + from)));
    const float32x4_t scales = vmulq_f32(load(out.scales + from), vdupq_n_f32(ratio));
    const float32x4_t value = vmaxq_f32(vdupq_n_f32(out.lowest), vfmaq_f32(load(out.bias + from), exact, scales));
    const float32x4_t zero_point = vdupq_n_f32(out.zero_point);
    const float32x4_t activated =
        vmaxnmq_f32(vfmaq_f32(zero_point, value, vdupq_n_f32(out.negative_slope)), vaddq_f32(value, zero_point));
    store_outputs(out.values + pixel * out.stride + from, out.count - from, activated);
}

}  // namespace conv_u8_set

#include <ldi/kernels/conv_u8/generic/tiles.hpp>

#include <ldi/kernels/conv_u8/generic/conv_u8.hpp>

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
