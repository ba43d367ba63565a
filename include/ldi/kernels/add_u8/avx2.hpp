// kernels/add_u8.hpp with AVX2: in float, 8 values at a time, two fused multiply-adds each.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

struct adder {
    __m256 a_scale, b_scale, offset;

    explicit adder(const add_u8_constants& sum)
        : a_scale(_mm256_set1_ps(sum.a_scale)), b_scale(_mm256_set1_ps(sum.b_scale)), offset(_mm256_set1_ps(sum.offset)) {}

    [[gnu::always_inline]] __m256i eight(const std::uint8_t* a, const std::uint8_t* b) const {
        const __m256 x = to_float(a), y = to_float(b);
        return _mm256_cvtps_epi32(_mm256_fmadd_ps(x, a_scale, _mm256_fmadd_ps(y, b_scale, offset)));
    }

    [[gnu::always_inline]] __m256i operator()(const std::uint8_t* a, const std::uint8_t* b) const {
        const __m256i low = _mm256_packs_epi32(eight(a, b), eight(a + 8, b + 8)),
                      high = _mm256_packs_epi32(eight(a + 16, b + 16), eight(a + 24, b + 24));
        return gather_lanes(_mm256_packus_epi16(low, high));
    }

private:
    [[gnu::always_inline]] static __m256 to_float(const std::uint8_t* values) {
        const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(values));
        return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes));
    }
};

inline void add_u8(const add_u8_constants& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    const adder add(sum);
    std::size_t i = 0;
    for (; i + 32 <= count; i += 32) _mm256_storeu_si256(reinterpret_cast<__m256i*>(result + i), add(a + i, b + i));
    if (i == count) return;
    std::uint8_t rest[3][32] = {};
    std::memcpy(rest[0], a + i, count - i);
    std::memcpy(rest[1], b + i, count - i);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(rest[2]), add(rest[0], rest[1]));
    std::memcpy(result + i, rest[2], count - i);
}

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
