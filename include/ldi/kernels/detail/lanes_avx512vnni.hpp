// Shared parts of the AVX-512 VNNI kernels: requantization of 32-bit sums.
#pragma once

#include <ldi/kernels/detail/target.hpp>
#include <ldi/kernels/requantize_float.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

using float_lanes = __m512;
using int_lanes = __m512i;

inline __mmask64 first_bytes(std::size_t count) { return count >= 64 ? ~__mmask64{0} : (__mmask64{1} << count) - 1; }

[[gnu::always_inline]] inline __m512i load(const void* from) { return _mm512_load_si512(from); }
[[gnu::always_inline]] inline void store(std::uint8_t* to, __m512i bytes) { _mm512_storeu_si512(to, bytes); }
[[gnu::always_inline]] inline __m512i load_bytes(const std::uint8_t* from) {
    return _mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
[[gnu::always_inline]] inline __m512 add_sign(__m512 offset, __m512i sign, __m512 value) {
    constexpr int and_xor = 0x6A;  // (a & b) ^ c
    const __m512i a = _mm512_castps_si512(value), c = _mm512_castps_si512(offset);
    return _mm512_castsi512_ps(_mm512_ternarylogic_epi32(a, sign, c, and_xor));
}

#define LDI_LANES(operation) _mm512_##operation
#include <ldi/kernels/detail/generic/lanes_x86.hpp>
#undef LDI_LANES

/// Reorders the result of pack_lanes(): all values of a, then all of b, of c, and of d.
[[gnu::always_inline]] inline __m512i gather_lanes(__m512i values) {
    return _mm512_permutexvar_epi32(_mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15), values);
}

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
