// kernels/conv_f32.hpp with AVX-512.
//
// A tile is some pixels and one panel of outputs; its sums stay in registers. For each input the panel's weights are loaded and
// each pixel's value is spread over a vector, by the multiplication itself where there is one vector only. 24 sums are under way
// where 4 (Zen 4) or 8 (Intel) would hide the latency: large tiles save loads, and weights that do not fit the first-level cache.
#pragma once

#include <ldi/kernels/detail/conv_f32_weights.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <span>
#include <utility>

namespace ldi::avx512vnni {

/// Panels have up to 5 half vectors: where their number is odd the last one is 256 bits wide, which takes half the time on
/// processors that make two of each 512-bit instruction (Zen 4).
inline constexpr std::size_t conv_half = 8, conv_whole = 16, conv_most_halves = 5;

inline void pack_conv_f32(conv_f32_weights& packed, std::span<const float> weights, std::span<const float> bias) {
    detail::append_conv_f32_panels(packed, weights, bias, conv_half, conv_most_halves);
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

/// The outputs of a panel for one pixel: whole vectors, and behind them half a vector where `half` is 1.
template <std::size_t vectors, std::size_t half>
struct conv_lanes {
    __m512 whole[vectors == 0 ? 1 : vectors];
    __m256 rest;
};

template <std::size_t half, std::size_t... v>
[[gnu::always_inline]] inline conv_lanes<sizeof...(v), half> load_conv_lanes(std::index_sequence<v...>, const float* values) {
    conv_lanes<sizeof...(v), half> lanes{};
    ((lanes.whole[v] = _mm512_loadu_ps(values + v * conv_whole)), ...);
    if constexpr (half == 1) lanes.rest = _mm256_loadu_ps(values + sizeof...(v) * conv_whole);
    return lanes;
}

template <std::size_t half, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums,
                                                const float* input, const conv_lanes<sizeof...(v), half>& weights) {
    if constexpr (sizeof...(v) == 0) {
        sums.rest = _mm256_fmadd_ps(_mm256_set1_ps(*input), weights.rest, sums.rest);
    } else {
        __m512 x = _mm512_set1_ps(*input);
        if constexpr (half == 1) asm("" : "+v"(x));  // clang would load it once more for the half vector
        ((sums.whole[v] = _mm512_fmadd_ps(x, weights.whole[v], sums.whole[v])), ...);
        if constexpr (half == 1) sums.rest = _mm256_fmadd_ps(_mm512_castps512_ps256(x), weights.rest, sums.rest);
    }
}

/// Of 16 values of the panel's outputs from `from` on, stores those that there are.
[[gnu::always_inline]] inline void store_outputs(const conv_panel_output& out, std::size_t pixel, std::size_t from,
                                                 __m512 values) {
    const __m512 activated = _mm512_max_ps(_mm512_mul_ps(values, _mm512_set1_ps(out.negative_slope)), values);
    const std::size_t count = out.count > from ? out.count - from : 0;
    const unsigned mask = count >= conv_whole ? 0xFFFFU : (1U << count) - 1U;
    _mm512_mask_storeu_ps(out.values + pixel * out.stride + from, static_cast<__mmask16>(mask), activated);
}

template <std::size_t half, std::size_t... v>
[[gnu::always_inline]] inline void finish(std::index_sequence<v...>, const conv_lanes<sizeof...(v), half>& sums,
                                          const conv_panel_output& out, std::size_t pixel) {
    const __m512 ratio = _mm512_set1_ps(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
    (store_outputs(out, pixel, v * conv_whole, _mm512_fmadd_ps(sums.whole[v], ratio, _mm512_loadu_ps(out.bias + v * conv_whole))),
     ...);
    if constexpr (half == 1) {
        constexpr std::size_t from = sizeof...(v) * conv_whole;
        const __m256 values = _mm256_fmadd_ps(sums.rest, _mm512_castps512_ps256(ratio), _mm256_loadu_ps(out.bias + from));
        store_outputs(out, pixel, from, _mm512_castps256_ps512(values));
    }
}

/// The value itself, of which the compiler no longer knows where it comes from.
template <class T>
[[gnu::always_inline]] inline T opaque(T value) {
    asm("" : "+r"(value));
    return value;
}

/// Every fourth pixel of a tile has a pointer, and those between are 1, 2 or 3 strides away: few enough for the general
/// registers. Left to itself, the compiler keeps an offset for each pixel, most of them in memory.
template <std::size_t pixels>
struct conv_tile_pointers {
    const float* every_fourth[(pixels + 3) / 4];
    std::size_t stride, three_strides;

    template <std::size_t p>
    [[gnu::always_inline]] const float* at() const {
        const float* const base = every_fourth[p / 4];
        return p % 4 == 3 ? base + three_strides : base + p % 4 * stride;
    }
};

template <std::size_t half, std::size_t... p, std::size_t... v>
inline void conv_f32_tile(std::index_sequence<p...>, std::index_sequence<v...> vectors, const conv_panel_input& input,
                          std::size_t first_pixel, const conv_panel_output& out) {
    conv_lanes<sizeof...(v), half> sums[sizeof...(p)] = {};
    const std::size_t stride = input.pixel_stride;
    const float* weights = input.weights;
    // What the next tile reads is fetched meanwhile, evenly spread: the processor's own prefetching comes late.
    const std::size_t fetch = sizeof...(p) * stride / input.inputs;
    for (std::size_t r = 0; r < input.row_count; ++r) {
        const float* const x = input.rows[r] + first_pixel * stride;
        const float* next_tile = x + sizeof...(p) * stride;
        conv_tile_pointers<sizeof...(p)> pointers{{}, opaque(stride), opaque(3 * stride)};
        ((p % 4 == 0 ? void(pointers.every_fourth[p / 4] = opaque(x + p * stride)) : void()), ...);
        for (std::size_t i = 0; i < input.inputs; ++i) {
            const auto w = load_conv_lanes<half>(vectors, weights);
            _mm_prefetch(reinterpret_cast<const char*>(next_tile), _MM_HINT_T0);
            (multiply_add<half>(vectors, sums[p], pointers.template at<p>(), w), ...);
            ((p % 4 == 0 ? void(++pointers.every_fourth[p / 4]) : void()), ...);
            next_tile += fetch;
            weights += sizeof...(v) * conv_whole + half * conv_half;
        }
    }
    (finish<half>(vectors, sums[p], out, first_pixel + p), ...);
}

template <std::size_t pixels, std::size_t vectors, std::size_t half>
inline void conv_f32_panel(const conv_panel_input& input, std::size_t first, std::size_t last, const conv_panel_output& out) {
    for (; first + pixels <= last; first += pixels)
        conv_f32_tile<half>(std::make_index_sequence<pixels>{}, std::make_index_sequence<vectors>{}, input, first, out);
    if constexpr (pixels > 1)
        if (first < last) conv_f32_panel<(pixels > 8 ? 8 : pixels / 2), vectors, half>(input, first, last, out);
}

inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    const detail::panel_cut cut(weights.outputs, conv_half, conv_most_halves);
    conv_panel_input input{rows, weights.rows, weights.inputs, pixel_stride, weights.values.data()};
    conv_panel_output out{weights.bias.data(), ratios, weights.negative_slope, weights.outputs, weights.outputs, result};
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t halves = cut.vectors_in(panel), lanes = halves * conv_half;
        switch (halves) {
            case 1: conv_f32_panel<24, 0, 1>(input, 0, pixels, out); break;
            case 2: conv_f32_panel<24, 1, 0>(input, 0, pixels, out); break;
            case 3: conv_f32_panel<12, 1, 1>(input, 0, pixels, out); break;
            case 4: conv_f32_panel<12, 2, 0>(input, 0, pixels, out); break;
            default: conv_f32_panel<8, 2, 1>(input, 0, pixels, out); break;
        }
        input.weights += weights.rows * weights.inputs * lanes;
        out.skip(lanes);
    }
}

LDI_END_TARGET

}  // namespace ldi::avx512vnni

#endif
