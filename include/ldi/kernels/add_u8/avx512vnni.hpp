// kernels/add_u8.hpp with AVX-512: in float, 16 values at a time, two fused multiply-adds each.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx512vnni {

LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)

struct adder {
    static constexpr std::size_t width = 64;
    __m512 a_scale, b_scale, offset;

    explicit adder(const add_u8_constants& sum)
        : a_scale(_mm512_set1_ps(sum.a_scale)), b_scale(_mm512_set1_ps(sum.b_scale)), offset(_mm512_set1_ps(sum.offset)) {}

    [[gnu::always_inline]] __m512i sixteen(const std::uint8_t* a, const std::uint8_t* b) const {
        const __m512 x = to_float(a), y = to_float(b);
        return _mm512_cvtps_epi32(_mm512_fmadd_ps(x, a_scale, _mm512_fmadd_ps(y, b_scale, offset)));
    }

    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const __m512i bytes =
            pack_bytes(sixteen(a, b), sixteen(a + 16, b + 16), sixteen(a + 32, b + 32), sixteen(a + 48, b + 48));
        _mm512_storeu_si512(result, swap_lanes(bytes));
    }

private:
    [[gnu::always_inline]] static __m512 to_float(const std::uint8_t* values) {
        return _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values))));
    }
};

#include <ldi/kernels/add_u8/generic/walk.hpp>

LDI_END_TARGET

}}}  // namespace ldi::avx512vnni

#endif
