// kernels/conv_u8.hpp with AVX2: vpmaddubsw adds two products in 16 bits, vpmaddwd adds two of these sums in 32 bits.
#pragma once

#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

/// Rounds, clamps and writes the first `count` values, at least one.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, __m256 values, std::size_t count) {
    const __m256 clamped = _mm256_min_ps(_mm256_max_ps(values, _mm256_setzero_ps()), _mm256_set1_ps(255.0F));
    const __m256i integers = _mm256_cvtps_epi32(clamped);
    const __m128i words = _mm_packus_epi32(_mm256_castsi256_si128(integers), _mm256_extracti128_si256(integers, 1));
    const __m128i bytes = _mm_packus_epi16(words, words);
    if (count >= 8) return _mm_storeu_si64(to, bytes);
    std::uint8_t all[8];
    _mm_storeu_si64(all, bytes);
    std::memcpy(to, all, count);
}

struct conv_u8_set {
    static constexpr detail::panel_layout layout{4, 8, 3};
    static constexpr std::size_t pixels[] = {10, 5, 3}, rest_pixels = 4;
    using sums_type = __m256i;
    using weights_type = __m256i;

    [[gnu::always_inline]] static __m256i load_inputs(const std::uint8_t* from, std::size_t count) {
        std::int32_t four = 0;
        std::memcpy(&four, from, count);
        return _mm256_set1_epi32(four);
    }
    [[gnu::always_inline]] static __m256i load_weights(const std::int8_t* from) {
        return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    }
    [[gnu::always_inline]] static __m256i add_products(__m256i sums, __m256i inputs, __m256i weights) {
        return _mm256_add_epi32(sums, _mm256_madd_epi16(_mm256_maddubs_epi16(inputs, weights), _mm256_set1_epi16(1)));
    }

    template <class Result>
    [[gnu::always_inline]] static void finish(const detail::conv_u8_panel_output<Result>& out, std::size_t pixel,
                                              std::size_t from, __m256i sums, float ratio) {
        const __m256i offsets = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(out.offsets + from));
        const __m256 exact = _mm256_cvtepi32_ps(_mm256_add_epi32(sums, offsets));
        const __m256 scales = _mm256_mul_ps(_mm256_loadu_ps(out.scales + from), _mm256_set1_ps(ratio));
        const __m256 value =
            _mm256_max_ps(_mm256_set1_ps(out.lowest), _mm256_fmadd_ps(exact, scales, _mm256_loadu_ps(out.bias + from)));
        const __m256 zero_point = _mm256_set1_ps(out.zero_point);
        const __m256 activated = _mm256_max_ps(_mm256_fmadd_ps(value, _mm256_set1_ps(out.negative_slope), zero_point),
                                               _mm256_add_ps(value, zero_point));
        store_first(out.values + pixel * out.stride + from, activated, out.count - from);
    }
};
using conv_u8_tiles = conv_tiles<conv_pieces<conv_u8_set>>;

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
