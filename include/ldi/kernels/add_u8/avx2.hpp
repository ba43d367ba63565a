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
    static constexpr std::size_t width = 32;
    __m256 a_scale, b_scale, offset;

    explicit adder(const add_u8_constants& sum)
        : a_scale(_mm256_set1_ps(sum.a_scale)), b_scale(_mm256_set1_ps(sum.b_scale)), offset(_mm256_set1_ps(sum.offset)) {}

    [[gnu::always_inline]] __m256i eight(const std::uint8_t* a, const std::uint8_t* b) const {
        const __m256 x = to_float(a), y = to_float(b);
        return _mm256_cvtps_epi32(_mm256_fmadd_ps(x, a_scale, _mm256_fmadd_ps(y, b_scale, offset)));
    }

    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const __m256i bytes = pack_bytes(eight(a, b), eight(a + 8, b + 8), eight(a + 16, b + 16), eight(a + 24, b + 24));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(result), gather_lanes(bytes));
    }

private:
    [[gnu::always_inline]] static __m256 to_float(const std::uint8_t* values) {
        const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(values));
        return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes));
    }
};

#include <ldi/kernels/add_u8/generic/walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx2

#endif
