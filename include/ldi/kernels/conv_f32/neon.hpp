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

inline constexpr std::size_t conv_width = 4, conv_max_vectors = 4;

LDI_BEGIN_TARGET(LDI_NEON_FEATURES)

/// The primitives that multiply_add_groups() requires.
struct conv_products {
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
};

[[gnu::always_inline]] inline void store_outputs(const detail::conv_panel_output<float>& out, std::size_t pixel, std::size_t from,
                                                 float32x4_t values) {
    const float32x4_t finite = vmaxq_f32(vdupq_n_f32(out.lowest), values);
    const float32x4_t activated = vmaxnmq_f32(vmulq_n_f32(finite, out.negative_slope), finite);  // ignores NaN (infinity * 0)
    float* const to = out.values + pixel * out.stride + from;
    if (out.count >= from + conv_width) return vst1q_f32(to, activated);
    if (out.count > from) vst1q_lane_f32(to, activated, 0);
    if (out.count > from + 1) vst1q_lane_f32(to + 1, activated, 1);
    if (out.count > from + 2) vst1q_lane_f32(to + 2, activated, 2);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void finish(std::index_sequence<v...>, const float32x4_t* sums,
                                          const detail::conv_panel_output<float>& out, std::size_t pixel) {
    const float32x4_t ratio = vdupq_n_f32(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
    (store_outputs(out, pixel, v * conv_width, vfmaq_f32(load(out.bias + v * conv_width), sums[v], ratio)), ...);
}

struct conv_f32_tiles {
    static constexpr std::size_t group = 1, width = conv_width, max_vectors = conv_max_vectors, rest_pixels = 4;
    static constexpr std::size_t pixels[] = {12, 8, 7, 6};

    template <std::size_t... p, std::size_t... v>
    static void tile(std::index_sequence<p...> pixels_of_tile, std::index_sequence<v...> vectors,
                     const detail::conv_panel_input<float>& input, std::size_t first_pixel,
                     const detail::conv_panel_output<float>& out) {
        float32x4_t sums[sizeof...(p) * sizeof...(v)] = {};
        const std::size_t stride = input.pixel_stride;
        const float* weights = input.weights;
        for (std::size_t r = 0; r < input.row_count; ++r)
            multiply_add_groups<conv_products>(pixels_of_tile, vectors, sums, weights, input.rows[r] + first_pixel * stride,
                                               stride, input.inputs);
        (finish(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
    }
};

#include <ldi/kernels/conv_f32/generic/conv_f32.hpp>

LDI_END_TARGET

}}}  // namespace ldi::neon

#endif
