// Shared parts of the AVX2 kernels: requantization of 32-bit sums, and the loops of convolutions.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/target.hpp>
#include <ldi/kernels/requantize_float.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

using float_lanes = __m256;
using int_lanes = __m256i;

[[gnu::always_inline]] inline __m256 spread(float value) { return _mm256_set1_ps(value); }
[[gnu::always_inline]] inline __m256i scale_and_truncate(__m256i sums, __m256 scale, __m256 offset) {
    return _mm256_cvttps_epi32(_mm256_fmadd_ps(_mm256_cvtepi32_ps(sums), scale, offset));
}
/// Saturates 32-bit values to bytes. Each 128-bit lane of the result contains 4 values of a, then 4 of b, of c, and of d.
[[gnu::always_inline]] inline __m256i pack_bytes(__m256i a, __m256i b, __m256i c, __m256i d) {
    return _mm256_packus_epi16(_mm256_packs_epi32(a, b), _mm256_packs_epi32(c, d));
}

/// Applies a float_requantization to vectors.
struct requantizer {
    __m256 scale, offset, sign;
    __m256i zero_point;

    explicit requantizer(const float_requantization& r)
        : scale(_mm256_set1_ps(r.scale)),
          // With a zero point of 0, negative values become 0 whether the offset is positive or negative, so its sign need not
          // depend on the value.
          offset(_mm256_set1_ps(r.zero_point == 0 && r.offset < 0 ? -r.offset : r.offset)),
          sign(_mm256_castsi256_ps(_mm256_set1_epi32(r.zero_point == 0 ? 0 : -0x7FFFFFFF - 1))),
          zero_point(_mm256_set1_epi16(static_cast<short>(r.zero_point))) {}

    [[gnu::always_inline]] __m256i operator()(__m256i sums) const {
        const __m256 value = _mm256_cvtepi32_ps(sums);
        const __m256 signed_offset = _mm256_xor_ps(_mm256_and_ps(value, sign), offset);
        return _mm256_cvttps_epi32(_mm256_fmadd_ps(value, scale, signed_offset));
    }

    /// Packs to 32 bytes in the order of pack_bytes() and adds the zero point.
    [[gnu::always_inline]] __m256i pack_lanes(__m256i a, __m256i b, __m256i c, __m256i d) const {
        const __m256i low = _mm256_adds_epi16(_mm256_packs_epi32(a, b), zero_point);
        const __m256i high = _mm256_adds_epi16(_mm256_packs_epi32(c, d), zero_point);
        return _mm256_packus_epi16(low, high);
    }
};

#include <ldi/kernels/detail/generic/rectifier.hpp>

/// Reorders the result of pack_lanes(): all values of a, then all of b, of c, and of d.
[[gnu::always_inline]] inline __m256i gather_lanes(__m256i values) {
    return _mm256_permutevar8x32_epi32(values, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));
}

/// Writes the first `count` bytes, at most 32.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, __m256i values, std::size_t count) {
    if (count == 32) {
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), values);
        return;
    }
    const __m128i low = _mm256_castsi256_si128(values), high = _mm256_extracti128_si256(values, 1);
    if (count == 24) {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to), low);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(to + 16), high);
    } else if (count == 16) {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to), low);
    } else if (count == 8) {
        _mm_storel_epi64(reinterpret_cast<__m128i*>(to), low);
    } else {
        alignas(32) std::uint8_t bytes[32];
        _mm256_store_si256(reinterpret_cast<__m256i*>(bytes), values);
        std::memcpy(to, bytes, count);
    }
}

#include <ldi/kernels/detail/generic/conv_walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
