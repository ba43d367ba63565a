// Measures the peak multiplication rates of the processor: runs the instructions of the inner loops of the 8-bit and the float
// kernels, with all operands in registers.
#pragma once

#include <ldi/kernels/detail/lanes_neon.hpp>
#include <ldi/kernels/isa.hpp>

#include <algorithm>
#include <chrono>

namespace ldi_bench {

// Defines a function that multiplies in twelve vector registers, so that no multiplication waits for the one before it. A macro,
// because each instruction set's functions are compiled in its own target region.
//
// in  constraint for a vector register in inline assembly, which keeps the compiler from merging the twelve equal sums into one
#define LDI_BENCH_MULTIPLY(name, in, one, factor, multiply)                                             \
    inline void name(long count) {                                                                      \
        auto a = one, b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;      \
        const auto x = factor, y = x;                                                                   \
        for (; count > 0; --count) {                                                                    \
            a = multiply(a, x, y), b = multiply(b, x, y), c = multiply(c, x, y), d = multiply(d, x, y); \
            e = multiply(e, x, y), f = multiply(f, x, y), g = multiply(g, x, y), h = multiply(h, x, y); \
            i = multiply(i, x, y), j = multiply(j, x, y), k = multiply(k, x, y), l = multiply(l, x, y); \
            asm volatile("" : "+" in(a), "+" in(b), "+" in(c), "+" in(d), "+" in(e), "+" in(f));        \
            asm volatile("" : "+" in(g), "+" in(h), "+" in(i), "+" in(j), "+" in(k), "+" in(l));        \
        }                                                                                               \
    }

#if LDI_HAS_X86_KERNELS
LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)
LDI_BENCH_MULTIPLY(multiply_vnni, "v", _mm512_set1_epi32(1), _mm512_set1_epi32(1), _mm512_dpbusd_epi32)
LDI_BENCH_MULTIPLY(multiply_floats_avx512, "v", _mm512_set1_ps(1), _mm512_set1_ps(0.5F), _mm512_fmadd_ps)
LDI_END_TARGET
LDI_BEGIN_TARGET(LDI_AVX_VNNI_FEATURES)
LDI_BENCH_MULTIPLY(multiply_vnni_256, "x", _mm256_set1_epi32(1), _mm256_set1_epi32(1), _mm256_dpbusd_avx_epi32)
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
LDI_BENCH_MULTIPLY(multiply_floats_avx2, "x", _mm256_set1_ps(1), _mm256_set1_ps(0.5F), _mm256_fmadd_ps)
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
LDI_BENCH_MULTIPLY(multiply_neon, "w", vdupq_n_s32(1), vdupq_n_s8(1), ldi::neon::add_products)
LDI_END_TARGET
#endif

/// Iterations per call. A call takes only a fraction of a millisecond, so that other programs do not disturb every call.
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
