// Shared parts of the AVX2 kernels: requantization of 32-bit sums, and the loops of convolutions.
#pragma once

#include <ldi/kernels/detail/conv_weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
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

[[gnu::always_inline]] inline __m256i load(const void* from) { return _mm256_load_si256(static_cast<const __m256i*>(from)); }
[[gnu::always_inline]] inline void store(std::uint8_t* to, __m256i bytes) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), bytes);
}
[[gnu::always_inline]] inline __m256i load_bytes(const std::uint8_t* from) {
    return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from)));
}
[[gnu::always_inline]] inline __m256 add_sign(__m256 offset, __m256i sign, __m256 value) {
    return _mm256_xor_ps(_mm256_and_ps(value, _mm256_castsi256_ps(sign)), offset);
}

#define LDI_LANES(operation) _mm256_##operation
#include <ldi/kernels/detail/generic/lanes_x86.hpp>
#undef LDI_LANES

/// Reorders the result of pack_lanes(): all values of a, then all of b, of c, and of d.
[[gnu::always_inline]] inline __m256i gather_lanes(__m256i values) {
    return _mm256_permutevar8x32_epi32(values, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));
}

/// Writes the first `count` bytes, at most 32.
[[gnu::always_inline]] inline void store_first(std::uint8_t* to, __m256i values, std::size_t count) {
    if (count == 32) return store(to, values);
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

/// Writes the first `count` values, at least one.
[[gnu::always_inline]] inline void store_first(float* to, __m256 values, std::size_t count) {
    if (count >= 8) return _mm256_storeu_ps(to, values);
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    _mm256_maskstore_ps(to, _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane), values);
}

#include <ldi/kernels/detail/generic/conv_tiles.hpp>
#include <ldi/kernels/detail/generic/conv_walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
