// kernels/conv_f32.hpp with NEON.
//
// One load fetches four inputs of a pixel. fmla (by element) multiplies one of them by the weights of 4 outputs, without a
// separate broadcast instruction. The largest tile, 6 pixels by 4 vectors, keeps its sums in 24 of the 32 registers and its
// inputs in 6. It loads 22 vectors per 96 fmla (384 products): 3.3 products per instruction, compared to 4 for fmla alone.
#pragma once

#include <ldi/kernels/conv_f32/contract.hpp>
#include <ldi/kernels/detail/lanes_neon.hpp>

#if LDI_HAS_ARM_KERNELS

#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace neon {

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

struct conv_f32_set {
    static constexpr detail::panel_layout layout{1, 4, 4};
    static constexpr std::size_t pixels[] = {12, 8, 7, 6}, rest_pixels = 4;
    using sums_type = float32x4_t;

    /// The primitives that multiply_add_groups() requires.
    static constexpr std::size_t group = 1;
    using inputs_type = float32x4_t;

    template <int lane>
    [[gnu::always_inline]] static float32x4_t multiply_add(float32x4_t sums, float32x4_t weights, float32x4_t inputs) {
        return vfmaq_laneq_f32(sums, weights, inputs, lane);
    }
    template <std::size_t count>
    [[gnu::always_inline]] static float32x4_t load_inputs(const float* from) {
        if constexpr (count == 4) return vld1q_f32(from);
        if constexpr (count == 2) return vcombine_f32(vld1_f32(from), vdup_n_f32(0.0F));
        return vld1q_dup_f32(from);
    }

    template <class Pixels, class Vectors, class Input>
    [[gnu::always_inline]] static void add_piece(Pixels tile_pixels, Vectors vectors, float32x4_t* sums, const float* inputs,
                                                 const Input& from, std::size_t, const float*& weights) {
        multiply_add_groups<conv_f32_set>(tile_pixels, vectors, sums, weights, inputs, from.pixel_stride, from.inputs);
    }

    [[gnu::always_inline]] static void finish(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                              float32x4_t sums, float ratio) {
        const float32x4_t value = vfmaq_f32(load(out.bias + from), sums, vdupq_n_f32(ratio));
        const float32x4_t finite = vmaxq_f32(vdupq_n_f32(out.lowest), value);
        // vmaxnmq returns the other operand if the product is NaN (infinity * 0).
        const float32x4_t activated = vmaxnmq_f32(vmulq_n_f32(finite, out.negative_slope), finite);
        store_first(out.values + pixel * out.stride + from, activated, out.count - from);
    }
};
using conv_f32_tiles = conv_tiles<conv_f32_set>;

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
