// AVX-512 code that conv_f32 and conv_u8 share.
//
// A tile consists of some pixels and one panel of outputs (detail/panel_cut.hpp); its sums stay in registers. For each input (or
// group of inputs that one instruction multiplies), the kernel loads the panel's weights and broadcasts each pixel's inputs. If
// the panel has a single vector, the multiply instruction itself broadcasts. A full tile has 24 independent vectors of sums. At
// least 4 (Zen 4) or 8 (Intel) are necessary to hide the latency, but large tiles save loads of weights that do not fit in the
// first-level cache.
//
// The tiles of the other instruction sets (generic/conv_tiles.hpp), with vectors of 16 outputs, would return the same bits but
// be slower. On Zen 5, they would take this much more time (median of 9 runs):
//
//                               conv_f32   conv_u8
//     3 x 3, 16 to 16 channels      31 %      15 %
//     3 x 3, 24 to 3 channels       33 %      18 %
//     1 x 1, 5 to 8 channels        41 %       6 %
//
// For 32 to 32 channels, the times differ by at most 5 %.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

/// Panels have up to 5 half vectors. If their number is odd, the last instruction is 256 bits wide; this halves its cost on
/// processors that split 512-bit instructions in two (Zen 4).
inline constexpr std::size_t conv_half = 8, conv_whole = 16;

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

/// Outputs of a panel for one pixel: whole vectors, then half a vector if `half` is 1.
template <std::size_t vectors, std::size_t half>
struct conv_lanes {
    __m512 whole[vectors == 0 ? 1 : vectors];
    __m256 rest;
};

/// Loads one value per lane.
///
/// values  32 bits per lane
template <std::size_t half, std::size_t... v>
[[gnu::always_inline]] inline conv_lanes<sizeof...(v), half> load_conv_lanes(std::index_sequence<v...>, const void* values) {
    const float* const from = static_cast<const float*>(values);
    conv_lanes<sizeof...(v), half> lanes{};
    ((lanes.whole[v] = _mm512_loadu_ps(from + v * conv_whole)), ...);
    if constexpr (half == 1) lanes.rest = _mm256_loadu_ps(from + sizeof...(v) * conv_whole);
    return lanes;
}

/// Sums of a tile, padded to whole vectors per pixel. The function that computes the sums stores them here (in the first-level
/// cache). It is then independent of the type of the results, and compiled only once.
struct conv_tile_sums {
    alignas(64) float lanes[24 * conv_whole];
};

/// Stores the lanes of one pixel. Pads half a vector with zeros.
template <std::size_t half, std::size_t... v>
[[gnu::always_inline]] inline void store_conv_lanes(std::index_sequence<v...>, const conv_lanes<sizeof...(v), half>& sums,
                                                    float* to) {
    (_mm512_store_ps(to + v * conv_whole, sums.whole[v]), ...);
    if constexpr (half == 1) _mm512_store_ps(to + sizeof...(v) * conv_whole, _mm512_zextps256_ps512(sums.rest));
}

/// Ratio that applies to all pixels if a call has no ratios.
inline constexpr float conv_ratio_of_one = 1.0F;

/// Mask of the existing outputs among the panel's 16 lanes that start at `from`.
template <class Output>
[[gnu::always_inline]] inline __mmask16 existing_outputs(const Output& out, std::size_t from) {
    const std::size_t count = out.count > from ? out.count - from : 0;
    return static_cast<__mmask16>(count >= conv_whole ? 0xFFFFU : (1U << count) - 1U);
}

/// Returns the value, and hides from the compiler how it was computed (see conv_tile_pointers).
template <class T>
[[gnu::always_inline]] inline T opaque(T value) {
    asm("" : "+r"(value));
    return value;
}

/// Addresses of a tile's pixels. Only every fourth pixel has a pointer. The next three pixels are 1, 2 and 3 strides away from
/// this pixel. The pointers of a tile therefore fit in the general-purpose registers. Without this class, the compiler would
/// keep an offset for each pixel, most of them in memory.
template <class Value, std::size_t pixels>
struct conv_tile_pointers {
    const Value* every_fourth[(pixels + 3) / 4];
    std::size_t stride, three_strides;

    template <std::size_t p>
    [[gnu::always_inline]] const Value* at() const {
        const Value* const base = every_fourth[p / 4];
        return p % 4 == 3 ? base + three_strides : base + p % 4 * stride;
    }
};

/// Computes one tile: passes each group of inputs to Kernel::multiply_add().
template <class Kernel, std::size_t half, class Value, class Weight, std::size_t... p, std::size_t... v>
[[gnu::noinline]] inline void conv_tile(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                                        const detail::conv_panel_input<Value, Weight>& input, std::size_t first_pixel,
                                        conv_tile_sums& tile_sums) {
    constexpr std::size_t group = Kernel::group, lanes = sizeof...(v) * conv_whole + half * conv_half;
    conv_lanes<sizeof...(v), half> sums[sizeof...(p)] = {};
    const std::size_t stride = input.pixel_stride, groups = input.inputs / group;
    const auto* weights = input.weights;
    const std::size_t fetch = input.fetch_step(sizeof...(p), group);
    for (std::size_t r = 0; r < input.row_count; ++r) {
        const Value* const x = input.rows[r] + first_pixel * stride;
        const Value* next_tile = x + sizeof...(p) * stride;
        conv_tile_pointers<Value, sizeof...(p)> pointers{{}, opaque(stride), opaque(3 * stride)};
        ((p % 4 == 0 ? void(pointers.every_fourth[p / 4] = opaque(x + p * stride)) : void()), ...);
        for (std::size_t i = 0; i < groups; ++i) {
            const auto w = load_conv_lanes<half>(vectors, weights);
            _mm_prefetch(reinterpret_cast<const char*>(next_tile), _MM_HINT_T0);
            (Kernel::template multiply_add<half>(vectors, sums[p], Kernel::load(pointers.template at<p>()), w), ...);
            ((p % 4 == 0 ? void(pointers.every_fourth[p / 4] += group) : void()), ...);
            next_tile += fetch;
            weights += group * lanes;
        }
        if constexpr (group > 1)
            if (const std::size_t rest = input.inputs % group; rest != 0) {
                const auto w = load_conv_lanes<half>(vectors, weights);
                (Kernel::template multiply_add<half>(vectors, sums[p], Kernel::load_rest(pointers.template at<p>(), rest), w),
                 ...);
                weights += group * lanes;
            }
    }
    (store_conv_lanes<half>(vectors, sums[p], tile_sums.lanes + p * (sizeof...(v) + half) * conv_whole), ...);
}

[[gnu::always_inline]] inline void store_existing(float* to, __mmask16 existing, __m512 values) {
    _mm512_mask_storeu_ps(to, existing, values);
}
/// Rounds, clamps and writes the existing values.
[[gnu::always_inline]] inline void store_existing(std::uint8_t* to, __mmask16 existing, __m512 values) {
    const __m512 clamped = _mm512_min_ps(_mm512_max_ps(values, _mm512_setzero_ps()), _mm512_set1_ps(255.0F));
    _mm_mask_storeu_epi8(to, existing, _mm512_cvtepi32_epi8(_mm512_cvtps_epi32(clamped)));
}

/// Converts the sums of a tile to results, and stores them.
template <class Kernel, class Output>
[[gnu::noinline]] inline void finish_conv_tile(const conv_tile_sums& sums, std::size_t vectors, std::size_t first_pixel,
                                               std::size_t pixels, const Output& out) {
    const float* const ratios = out.ratios == nullptr ? &conv_ratio_of_one : out.ratios + first_pixel;
    const std::size_t stride = out.stride, ratio_stride = out.ratios == nullptr ? 0 : 1;
    for (std::size_t v = 0; v < vectors; ++v) {
        const std::size_t from = v * conv_whole;
        const __mmask16 existing = existing_outputs(out, from);
        const typename Kernel::finisher finish(out, from, existing);
        const float *sum = sums.lanes + from, *ratio = ratios;
        auto* to = out.values + first_pixel * stride + from;
        for (std::size_t p = 0; p < pixels; ++p, sum += vectors * conv_whole, ratio += ratio_stride, to += stride)
            store_existing(to, existing, finish(_mm512_load_ps(sum), _mm512_set1_ps(*ratio)));
    }
}

#include <ldi/kernels/detail/generic/conv_walk.hpp>

/// The primitives that generic/conv_walk.hpp requires. The class Kernel has these members:
///
///     group                                      inputs per multiplication
///     load(input), load_rest(input, count)       load a group of inputs, or fewer
///     multiply_add(vectors, sums, inputs, weights)  adds the products of one group
///     finisher(output, from, existing)           class that converts sums and a ratio to results, starting with output `from`
template <class Kernel>
struct conv_tiles {
    static constexpr detail::panel_layout layout{Kernel::group, conv_half, 5};
    static constexpr std::size_t pixels[layout.max_vectors] = {24, 24, 12, 12, 8}, rest_pixels = 8;

    template <class Pixels, std::size_t... h, class Input, class Output>
    static void tile(Pixels pixels_of_tile, std::index_sequence<h...>, const Input& input, std::size_t first_pixel,
                     const Output& out) {
        constexpr std::size_t whole = sizeof...(h) / 2, half = sizeof...(h) % 2;
        static_assert(Pixels::size() * (whole + half) <= 24);
        conv_tile_sums sums;
        conv_tile<Kernel, half>(pixels_of_tile, std::make_index_sequence<whole>{}, input, first_pixel, sums);
        finish_conv_tile<Kernel>(sums, whole + half, first_pixel, Pixels::size(), out);
    }
};

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
