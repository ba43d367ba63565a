// kernels/conv_u8.hpp with AVX-512 VNNI: vpdpbusd makes four products for each lane.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/conv_avx512.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION::avx512vnni {

inline void pack_conv_u8(conv_u8_weights& packed, std::span<const std::int8_t> weights, std::span<const std::uint8_t> zero_points,
                         std::span<const float> scales, std::span<const float> bias) {
    detail::append_conv_u8_panels<4>(packed, weights, zero_points, scales, bias, conv_half, conv_most_halves);
}

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct conv_u8_tiles {
    static constexpr std::size_t group = 4;  // inputs that are multiplied together

    [[gnu::always_inline]] static std::int32_t load(const std::uint8_t* input) { return load_rest(input, group); }

    [[gnu::always_inline]] static std::int32_t load_rest(const std::uint8_t* input, std::size_t count) {
        std::int32_t four = 0;
        std::memcpy(&four, input, count);
        return four;
    }

    /// Lanes hold integers, whatever their type says.
    template <std::size_t half, std::size_t... v>
    [[gnu::always_inline]] static void multiply_add(std::index_sequence<v...>, conv_lanes<sizeof...(v), half>& sums,
                                                    std::int32_t inputs, const conv_lanes<sizeof...(v), half>& weights) {
        __m512i x = _mm512_set1_epi32(inputs);
        if constexpr (half == 1 && sizeof...(v) > 0) asm("" : "+v"(x));  // clang would load it once more for the half vector
        ((sums.whole[v] = _mm512_castsi512_ps(
              _mm512_dpbusd_epi32(_mm512_castps_si512(sums.whole[v]), x, _mm512_castps_si512(weights.whole[v])))),
         ...);
        if constexpr (half == 1)
            sums.rest = _mm256_castsi256_ps(_mm256_dpbusd_epi32(_mm256_castps_si256(sums.rest), _mm512_castsi512_si256(x),
                                                                _mm256_castps_si256(weights.rest)));
    }

    [[gnu::always_inline]] static void store(float* to, __mmask16 existing, __m512 values) {
        _mm512_mask_storeu_ps(to, existing, values);
    }
    [[gnu::always_inline]] static void store(std::uint8_t* to, __mmask16 existing, __m512 values) {
        const __m512 clamped = _mm512_min_ps(_mm512_max_ps(values, _mm512_setzero_ps()), _mm512_set1_ps(255.0F));
        _mm_mask_storeu_epi8(to, existing, _mm512_cvtepi32_epi8(_mm512_cvtps_epi32(clamped)));
    }

    template <class Result>
    [[gnu::always_inline]] static void finish_vector(const conv_u8_panel_output<Result>& out, std::size_t pixel, std::size_t from,
                                                     __m512i sums, __m512 ratio) {
        const __mmask16 existing = existing_outputs(out, from);
        const __m512 exact = _mm512_cvtepi32_ps(_mm512_add_epi32(sums, _mm512_maskz_loadu_epi32(existing, out.offsets + from)));
        const __m512 scale = _mm512_mul_ps(_mm512_maskz_loadu_ps(existing, out.scales + from), ratio);
        const __m512 value = _mm512_fmadd_ps(exact, scale, _mm512_maskz_loadu_ps(existing, out.bias + from));
        const __m512 zero_point = _mm512_set1_ps(out.zero_point);
        const __m512 activated = _mm512_max_ps(_mm512_fmadd_ps(value, _mm512_set1_ps(out.negative_slope), zero_point),
                                               _mm512_add_ps(value, zero_point));
        store(out.values + pixel * out.stride + from, existing, activated);
    }

    template <std::size_t half, class Result, std::size_t... v>
    [[gnu::always_inline]] static void finish(std::index_sequence<v...>, const conv_lanes<sizeof...(v), half>& sums,
                                              const conv_u8_panel_output<Result>& out, std::size_t pixel) {
        const __m512 ratio = _mm512_set1_ps(out.ratios == nullptr ? 1.0F : out.ratios[pixel]);
        (finish_vector(out, pixel, v * conv_whole, _mm512_castps_si512(sums.whole[v]), ratio), ...);
        if constexpr (half == 1)
            finish_vector(out, pixel, sizeof...(v) * conv_whole, _mm512_castsi256_si512(_mm256_castps_si256(sums.rest)), ratio);
    }

    template <std::size_t half, class Pixels, class Vectors, class Input, class Output>
    static void tile(Pixels pixels, Vectors vectors, const Input& input, std::size_t first_pixel, const Output& out) {
        conv_tile<conv_u8_tiles, half>(pixels, vectors, input, first_pixel, out);
    }
};

LDI_END_TARGET

/// Result: float or std::uint8_t.
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const auto* const values =
        reinterpret_cast<const std::uint8_t*>(weights.values.data());  // bytes: their signs are the kernel's affair
    conv_panels<conv_u8_tiles>(weights, conv_panel_input<std::uint8_t>{rows, weights.rows, weights.inputs, pixel_stride, values},
                               pixels, conv_u8_panel_output<Result>(weights, ratios, result));
}

}  // namespace ldi::avx512vnni

#endif
