// kernels/add_u8.hpp with AVX2: float arithmetic on 8 values per vector, with two fused multiply-adds per vector.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

inline constexpr std::size_t lane_count = 8;

[[gnu::always_inline]] inline __m256 eight_bytes(const std::uint8_t* from) {
    return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from))));
}
[[gnu::always_inline]] inline __m256i add_scaled(const std::uint8_t* a, const std::uint8_t* b, __m256 a_scale, __m256 b_scale,
                                                 __m256 offset) {
    return _mm256_cvtps_epi32(_mm256_fmadd_ps(eight_bytes(a), a_scale, _mm256_fmadd_ps(eight_bytes(b), b_scale, offset)));
}
[[gnu::always_inline]] inline void store_in_order(std::uint8_t* to, __m256i bytes) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), gather_lanes(bytes));
}

#include <ldi/kernels/add_u8/generic/float_adder.hpp>
#include <ldi/kernels/add_u8/generic/walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
