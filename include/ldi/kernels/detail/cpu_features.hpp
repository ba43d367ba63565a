// Detects processor features.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/kernels/cpu_feature.hpp>
#include <ldi/kernels/detail/dot_product_extension.hpp>
#include <ldi/kernels/detail/target.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

#if LDI_HAS_X86_KERNELS
/// Returns register EAX after CPUID. Uses inline assembly, because the macros of <cpuid.h> would break __cpuid() of <intrin.h> in
/// programs for Windows.
inline std::uint32_t cpuid_eax(std::uint32_t leaf, std::uint32_t subleaf) {
    std::uint32_t b = 0, d = 0;
    asm volatile("cpuid" : "+a"(leaf), "=b"(b), "+c"(subleaf), "=d"(d));
    return leaf;
}

/// Detects AVX-VNNI, which __builtin_cpu_supports() of clang 14 does not know. AVX-VNNI has the same registers as AVX2, so every
/// operating system that supports AVX2 also supports AVX-VNNI.
inline bool has_avx_vnni() {
    static const bool found = cpuid_eax(0, 0) >= 7 && cpuid_eax(7, 0) >= 1 && (cpuid_eax(7, 1) >> 4U & 1U) != 0;
    return found;
}
#endif

/// Whether the processor has the feature; false if this build of ldi has no kernels for the processor.
inline bool has_feature(cpu_feature feature) {
    switch (feature) {
        case cpu_feature::none: return true;
#if LDI_HAS_X86_KERNELS
        case cpu_feature::avx2: return __builtin_cpu_supports("avx2");
        case cpu_feature::fma: return __builtin_cpu_supports("fma");
        case cpu_feature::avx_vnni: return has_avx_vnni();
        case cpu_feature::avx512:
            return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
        case cpu_feature::avx512_vnni: return __builtin_cpu_supports("avx512vnni");
#endif
#if LDI_HAS_ARM_KERNELS
        case cpu_feature::arm_dot_product: return has_dot_product_extension();
#endif
#if LDI_HAS_WASM_KERNELS
        case cpu_feature::wasm_simd128: return true;
#endif
        default: return false;
    }
}

}}}  // namespace ldi::detail
