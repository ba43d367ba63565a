// Peak multiplication rate of the processor: the instruction in the inner loop of the 8-bit kernels, with everything in
// registers.
#pragma once

#include <ldi/kernels/detail/lanes_neon.hpp>
#include <ldi/kernels/isa.hpp>

#include <algorithm>
#include <chrono>

namespace ldi_bench {

#if LDI_HAS_X86_KERNELS
LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)
inline void multiply_vnni(long count) {
    __m512i a = _mm512_set1_epi32(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const __m512i x = a, y = a;
    for (; count > 0; --count) {
        a = _mm512_dpbusd_epi32(a, x, y), b = _mm512_dpbusd_epi32(b, x, y), c = _mm512_dpbusd_epi32(c, x, y);
        d = _mm512_dpbusd_epi32(d, x, y), e = _mm512_dpbusd_epi32(e, x, y), f = _mm512_dpbusd_epi32(f, x, y);
        g = _mm512_dpbusd_epi32(g, x, y), h = _mm512_dpbusd_epi32(h, x, y), i = _mm512_dpbusd_epi32(i, x, y);
        j = _mm512_dpbusd_epi32(j, x, y), k = _mm512_dpbusd_epi32(k, x, y), l = _mm512_dpbusd_epi32(l, x, y);
        asm volatile("" : "+v"(a), "+v"(b), "+v"(c), "+v"(d), "+v"(e), "+v"(f));
        asm volatile("" : "+v"(g), "+v"(h), "+v"(i), "+v"(j), "+v"(k), "+v"(l));
    }
}
LDI_END_TARGET
LDI_BEGIN_TARGET(LDI_AVX_VNNI_FEATURES)
inline void multiply_vnni_256(long count) {
    __m256i a = _mm256_set1_epi32(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const __m256i x = a, y = a;
    for (; count > 0; --count) {
        a = _mm256_dpbusd_avx_epi32(a, x, y), b = _mm256_dpbusd_avx_epi32(b, x, y), c = _mm256_dpbusd_avx_epi32(c, x, y);
        d = _mm256_dpbusd_avx_epi32(d, x, y), e = _mm256_dpbusd_avx_epi32(e, x, y), f = _mm256_dpbusd_avx_epi32(f, x, y);
        g = _mm256_dpbusd_avx_epi32(g, x, y), h = _mm256_dpbusd_avx_epi32(h, x, y), i = _mm256_dpbusd_avx_epi32(i, x, y);
        j = _mm256_dpbusd_avx_epi32(j, x, y), k = _mm256_dpbusd_avx_epi32(k, x, y), l = _mm256_dpbusd_avx_epi32(l, x, y);
        asm volatile("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d), "+x"(e), "+x"(f));
        asm volatile("" : "+x"(g), "+x"(h), "+x"(i), "+x"(j), "+x"(k), "+x"(l));
    }
}
LDI_END_TARGET
LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)
/// Computes 64 products: the maximum in 16 bits.
inline __m256i multiply_add(__m256i sum, __m256i x, __m256i y) {
    __m256i a, b;
    // otherwise the compiler would multiply only once for all sums
    asm volatile("vpmaddubsw %2, %1, %0" : "=x"(a) : "x"(x), "x"(y));
    asm volatile("vpmaddubsw %2, %1, %0" : "=x"(b) : "x"(x), "x"(y));
    return _mm256_add_epi32(sum, _mm256_madd_epi16(_mm256_add_epi16(a, b), y));
}
inline void multiply_avx2(long count) {
    const __m256i x = _mm256_set1_epi32(1), y = x;
    __m256i a = x, b = x, c = x, d = x, e = x, f = x, g = x, h = x;
    for (; count > 0; --count) {
        a = multiply_add(a, x, y), b = multiply_add(b, x, y), c = multiply_add(c, x, y), d = multiply_add(d, x, y);
        e = multiply_add(e, x, y), f = multiply_add(f, x, y), g = multiply_add(g, x, y), h = multiply_add(h, x, y);
        asm volatile("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d), "+x"(e), "+x"(f), "+x"(g), "+x"(h));
    }
}
LDI_END_TARGET
#endif
#if LDI_HAS_ARM_KERNELS
LDI_BEGIN_TARGET(LDI_NEON_FEATURES)
inline void multiply_neon(long count) {
    using ldi::neon::add_products;
    int32x4_t a = vdupq_n_s32(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const int8x16_t x = vdupq_n_s8(1), y = x;
    for (; count > 0; --count) {
        a = add_products(a, x, y), b = add_products(b, x, y), c = add_products(c, x, y), d = add_products(d, x, y);
        e = add_products(e, x, y), f = add_products(f, x, y), g = add_products(g, x, y), h = add_products(h, x, y);
        i = add_products(i, x, y), j = add_products(j, x, y), k = add_products(k, x, y), l = add_products(l, x, y);
        asm volatile("" : "+w"(a), "+w"(b), "+w"(c), "+w"(d), "+w"(e), "+w"(f));
        asm volatile("" : "+w"(g), "+w"(h), "+w"(i), "+w"(j), "+w"(k), "+w"(l));
    }
}
LDI_END_TARGET
#endif

/// Returns the multiplications per second of the instruction in the kernels' inner loop, with everything in registers; 0 if
/// unknown.
inline double peak_products([[maybe_unused]] ldi::isa set) {
    [[maybe_unused]] constexpr long count = 50000;  // a fraction of a millisecond, so that some rounds are undisturbed
    void (*multiply)(long) = nullptr;
    double products = 0;
#if LDI_HAS_X86_KERNELS
    if (set == ldi::isa::avx512vnni) multiply = multiply_vnni, products = count * 12.0 * 64;
    if (set == ldi::isa::avx_vnni) multiply = multiply_vnni_256, products = count * 12.0 * 32;
    if (set == ldi::isa::avx2) multiply = multiply_avx2, products = count * 8.0 * 64;
#endif
#if LDI_HAS_ARM_KERNELS
    if (set == ldi::isa::neon_dot_product) multiply = multiply_neon, products = count * 12.0 * 16;
#endif
    double best = 0;
    for (int i = 0; multiply != nullptr && i < 200; ++i) {
        const auto start = std::chrono::steady_clock::now();
        multiply(count);
        best = std::max(best, products / std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
}

}  // namespace ldi_bench
