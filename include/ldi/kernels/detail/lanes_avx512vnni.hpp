// Shared parts of the AVX-512 VNNI kernels: requantization of 32-bit sums.
#pragma once

#include <ldi/kernels/detail/target.hpp>
#include <ldi/kernels/requantize_float.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

inline __mmask64 first_bytes(std::size_t count) { return count >= 64 ? ~__mmask64{0} : (__mmask64{1} << count) - 1; }

using float_lanes = __m512;
using int_lanes = __m512i;

[[gnu::always_inline]] inline __m512 spread(float value) { return _mm512_set1_ps(value); }
[[gnu::always_inline]] inline __m512i scale_and_truncate(__m512i sums, __m512 scale, __m512 offset) {
    return _mm512_cvttps_epi32(_mm512_fmadd_ps(_mm512_cvtepi32_ps(sums), scale, offset));
}
/// Saturates 32-bit values to bytes. Each 128-bit lane of the result contains 4 values of a, then 4 of b, of c, and of d.
[[gnu::always_inline]] inline __m512i pack_bytes(__m512i a, __m512i b, __m512i c, __m512i d) {
    return _mm512_packus_epi16(_mm512_packs_epi32(a, b), _mm512_packs_epi32(c, d));
}

/// Applies a float_requantization to vectors.
struct requantizer {
    __m512 scale;
    __m512i offset, sign, zero_point;

    explicit requantizer(const float_requantization& r)
        : scale(_mm512_set1_ps(r.scale)),
          // With a zero point of 0, negative values become 0 whether the offset is positive or negative, so its sign need not
          // depend on the value.
          offset(_mm512_castps_si512(_mm512_set1_ps(r.zero_point == 0 && r.offset < 0 ? -r.offset : r.offset))),
          sign(_mm512_set1_epi32(r.zero_point == 0 ? 0 : -0x7FFFFFFF - 1)),
          zero_point(_mm512_set1_epi16(static_cast<short>(r.zero_point))) {}

    [[gnu::always_inline]] __m512i operator()(__m512i sums) const {
        constexpr int select_sign_of_offset = 0x6A;  // (a & b) ^ c
        const __m512 value = _mm512_cvtepi32_ps(sums);
        const __m512i signed_offset = _mm512_ternarylogic_epi32(_mm512_castps_si512(value), sign, offset, select_sign_of_offset);
        return _mm512_cvttps_epi32(_mm512_fmadd_ps(value, scale, _mm512_castsi512_ps(signed_offset)));
    }

    /// Packs to 64 bytes in the order of pack_bytes() and adds the zero point.
    [[gnu::always_inline]] __m512i pack_lanes(__m512i a, __m512i b, __m512i c, __m512i d) const {
        const __m512i low = _mm512_adds_epi16(_mm512_packs_epi32(a, b), zero_point);
        const __m512i high = _mm512_adds_epi16(_mm512_packs_epi32(c, d), zero_point);
        return _mm512_packus_epi16(low, high);
    }
};

#include <ldi/kernels/detail/generic/rectifier.hpp>

/// Reorders the result of pack_lanes(): all values of a, then all of b, of c, and of d. A second call restores the order.
[[gnu::always_inline]] inline __m512i swap_lanes(__m512i values) {
    return _mm512_permutexvar_epi32(_mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15), values);
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
