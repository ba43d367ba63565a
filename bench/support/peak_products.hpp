// Peak multiplication rates of the processor: the instructions in the inner loops of the 8-bit and the float kernels, with
// everything in registers.
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
inline void multiply_floats_avx512(long count) {
    __m512 a = _mm512_set1_ps(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const __m512 x = _mm512_set1_ps(0.5F), y = x;
    for (; count > 0; --count) {
        a = _mm512_fmadd_ps(a, x, y), b = _mm512_fmadd_ps(b, x, y), c = _mm512_fmadd_ps(c, x, y);
        d = _mm512_fmadd_ps(d, x, y), e = _mm512_fmadd_ps(e, x, y), f = _mm512_fmadd_ps(f, x, y);
        g = _mm512_fmadd_ps(g, x, y), h = _mm512_fmadd_ps(h, x, y), i = _mm512_fmadd_ps(i, x, y);
        j = _mm512_fmadd_ps(j, x, y), k = _mm512_fmadd_ps(k, x, y), l = _mm512_fmadd_ps(l, x, y);
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
/// Computes 64 products as gemm_u8 does: two vpmaddubsw, added in 16 bits and then widened.
inline __m256i multiply_add(__m256i sum, __m256i x, __m256i y) {
    __m256i a, b;
    // Assembly, because the compiler would otherwise multiply only once for all sums.
    asm volatile("vpmaddubsw %2, %1, %0" : "=x"(a) : "x"(x), "x"(y));
    asm volatile("vpmaddubsw %2, %1, %0" : "=x"(b) : "x"(x), "x"(y));
    return _mm256_add_epi32(sum, _mm256_madd_epi16(_mm256_add_epi16(a, b), y));
}
inline void multiply_floats_avx2(long count) {
    __m256 a = _mm256_set1_ps(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const __m256 x = _mm256_set1_ps(0.5F), y = x;
    for (; count > 0; --count) {
        a = _mm256_fmadd_ps(a, x, y), b = _mm256_fmadd_ps(b, x, y), c = _mm256_fmadd_ps(c, x, y);
        d = _mm256_fmadd_ps(d, x, y), e = _mm256_fmadd_ps(e, x, y), f = _mm256_fmadd_ps(f, x, y);
        g = _mm256_fmadd_ps(g, x, y), h = _mm256_fmadd_ps(h, x, y), i = _mm256_fmadd_ps(i, x, y);
        j = _mm256_fmadd_ps(j, x, y), k = _mm256_fmadd_ps(k, x, y), l = _mm256_fmadd_ps(l, x, y);
        asm volatile("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d), "+x"(e), "+x"(f));
        asm volatile("" : "+x"(g), "+x"(h), "+x"(i), "+x"(j), "+x"(k), "+x"(l));
    }
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

/// Iterations per call: a fraction of a millisecond, so that some rounds are undisturbed.
inline constexpr long peak_iterations = 50000;

/// Returns the maximum rate of `multiply`, which computes `products` per iteration; 0 if it is null.
inline double fastest_rate(void (*multiply)(long), double products) {
    double best = 0;
    for (int i = 0; multiply != nullptr && i < 200; ++i) {
        const auto start = std::chrono::steady_clock::now();
        multiply(peak_iterations);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        best = std::max(best, static_cast<double>(peak_iterations) * products / seconds);
    }
    return best;
}

/// Returns the multiplications of bytes per second of the instruction in the kernels' inner loop; 0 if unknown.
inline double peak_products([[maybe_unused]] ldi::isa set) {
#if LDI_HAS_X86_KERNELS
    if (set == ldi::isa::avx512vnni) return fastest_rate(multiply_vnni, 12 * 64);
    if (set == ldi::isa::avx_vnni) return fastest_rate(multiply_vnni_256, 12 * 32);
    if (set == ldi::isa::avx2) return fastest_rate(multiply_avx2, 8 * 64);
#endif
#if LDI_HAS_ARM_KERNELS
    if (set == ldi::isa::neon_dot_product) return fastest_rate(multiply_neon, 12 * 16);
#endif
    return 0;
}

/// Returns the multiplications of floats per second, each with an addition; 0 if unknown.
inline double peak_float_products([[maybe_unused]] ldi::isa set) {
#if LDI_HAS_X86_KERNELS
    if (set == ldi::isa::avx512vnni) return fastest_rate(multiply_floats_avx512, 12 * 16);
    if (set == ldi::isa::avx2 || set == ldi::isa::avx_vnni) return fastest_rate(multiply_floats_avx2, 12 * 8);
#endif
    return 0;
}

}  // namespace ldi_bench
