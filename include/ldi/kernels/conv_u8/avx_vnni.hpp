// kernels/conv_u8.hpp with AVX-VNNI: vpdpbusd makes four products for each of 8 lanes. Weights lie as for AVX2.
#pragma once

#include <ldi/kernels/conv_u8/avx2.hpp>
#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION::avx_vnni {

using avx2::pack_conv_u8;

LDI_BEGIN_TARGET(LDI_AVX_VNNI_FEATURES)

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m256i* sums, std::int32_t inputs,
                                                const __m256i* weights) {
    const __m256i x = _mm256_set1_epi32(inputs);
    ((sums[v] = _mm256_dpbusd_avx_epi32(sums[v], x, weights[v])), ...);
}

/// `count` inputs, 1 to 4, of every pixel, with all vectors of weights.
template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                                const std::uint8_t* inputs, std::size_t stride, std::size_t count,
                                                const std::uint8_t* weights) {
    const __m256i w[] = {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(weights) + v)...};
    (multiply_add(vectors, sums + p * sizeof...(v), avx2::load_inputs(inputs + p * stride, count), w), ...);
}

template <class Result, std::size_t... p, std::size_t... v>
inline void conv_u8_tile(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                         const conv_panel_input<std::uint8_t>& input, std::size_t first_pixel,
                         const conv_u8_panel_output<Result>& out) {
    constexpr std::size_t group = avx2::conv_u8_group;
    __m256i sums[sizeof...(p) * sizeof...(v)] = {};
    const std::size_t stride = input.pixel_stride;
    const std::uint8_t* weights = input.weights;
    for (std::size_t r = 0; r < input.row_count; ++r) {
        const std::uint8_t* x = input.rows[r] + first_pixel * stride;
        std::size_t rest = input.inputs;
        for (; rest >= group; rest -= group, x += group, weights += sizeof...(v) * sizeof(__m256i))
            multiply_add(pixels, vectors, sums, x, stride, group, weights);
        if (rest == 0) continue;
        multiply_add(pixels, vectors, sums, x, stride, rest, weights);
        weights += sizeof...(v) * sizeof(__m256i);
    }
    (avx2::finish_pixel(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
}

template <std::size_t pixels, std::size_t vectors, class Result>
inline void conv_u8_panel(const conv_panel_input<std::uint8_t>& input, std::size_t first, std::size_t last,
                          const conv_u8_panel_output<Result>& out) {
    for (; first + pixels <= last; first += pixels)
        conv_u8_tile(std::make_index_sequence<pixels>{}, std::make_index_sequence<vectors>{}, input, first, out);
    if constexpr (pixels > 1)
        if (first < last) conv_u8_panel<(pixels > 4 ? 4 : pixels / 2), vectors>(input, first, last, out);
}

/// Result: float or std::uint8_t.
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const detail::panel_cut cut(weights.outputs, avx2::conv_u8_width, avx2::conv_u8_most_vectors);
    const auto* const values = reinterpret_cast<const std::uint8_t*>(weights.values.data());
    conv_panel_input<std::uint8_t> input{rows, weights.rows, weights.inputs, pixel_stride, values};
    conv_u8_panel_output<Result> out(weights, ratios, result);
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t vectors = cut.vectors_in(panel);
        switch (vectors) {
            case 1: conv_u8_panel<12, 1>(input, 0, pixels, out); break;
            case 2: conv_u8_panel<6, 2>(input, 0, pixels, out); break;
            default: conv_u8_panel<4, 3>(input, 0, pixels, out); break;
        }
        input.weights += weights.rows * detail::groups_of(weights.inputs, avx2::conv_u8_group) * vectors * sizeof(__m256i);
        out.skip(vectors * avx2::conv_u8_width);
    }
}

LDI_END_TARGET

}  // namespace ldi::avx_vnni

#endif
