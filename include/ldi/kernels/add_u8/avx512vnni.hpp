// kernels/add_u8.hpp with AVX-512: float arithmetic on 16 values per vector, with two fused multiply-adds per vector.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

inline constexpr std::size_t lane_count = 16;

[[gnu::always_inline]] inline __m512 sixteen_bytes(const std::uint8_t* from) {
    return _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from))));
}
[[gnu::always_inline]] inline __m512i add_scaled(const std::uint8_t* a, const std::uint8_t* b, __m512 a_scale, __m512 b_scale,
                                                 __m512 offset) {
    return _mm512_cvtps_epi32(_mm512_fmadd_ps(sixteen_bytes(a), a_scale, _mm512_fmadd_ps(sixteen_bytes(b), b_scale, offset)));
}
[[gnu::always_inline]] inline void store_in_order(std::uint8_t* to, __m512i bytes) { _mm512_storeu_si512(to, swap_lanes(bytes)); }

#include <ldi/kernels/add_u8/generic/float_adder.hpp>
#include <ldi/kernels/add_u8/generic/walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
