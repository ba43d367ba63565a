// Which instruction set the kernels of kernels/ use. Chosen at run time, when weights are packed; all of them give the same bits.
// The environment variable LDI_ISA (scalar, avx2, avx512vnni, amx, neon, wasm) forces one, for tests and benchmarks.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/kernels/detail/amx_permission.hpp>
#include <ldi/kernels/detail/dot_product_extension.hpp>
#include <ldi/kernels/detail/target.hpp>

#include <array>
#include <cstdlib>
#include <string>
#include <string_view>

namespace ldi {

enum class isa {
    scalar,            ///< portable C++, and the reference in tests
    avx2,              ///< AVX2 and FMA
    avx512vnni,        ///< AVX-512 F, BW, VL and VNNI
    amx_int8,          ///< AMX's tiles for matrix products, AVX-512 VNNI for all else; where Linux grants it
    neon_dot_product,  ///< 64-bit Arm with the dot product extension
    wasm_simd128,      ///< WebAssembly's 128-bit vectors: all of a module uses them or nothing, so the compiler's flags decide
};

/// Slowest first.
inline constexpr std::array all_isas{isa::scalar,           isa::avx2,        isa::avx512vnni, isa::amx_int8,
                                     isa::neon_dot_product, isa::wasm_simd128};

/// The name as LDI_ISA spells it.
constexpr std::string_view to_string(isa set) {
    switch (set) {
        case isa::scalar: return "scalar";
        case isa::avx2: return "avx2";
        case isa::avx512vnni: return "avx512vnni";
        case isa::amx_int8: return "amx";
        case isa::neon_dot_product: return "neon";
        case isa::wasm_simd128: return "wasm";
    }
    return "unknown";
}

/// The set whose kernels run all but matrix products where this one is chosen.
constexpr isa without_tiles(isa set) { return set == isa::amx_int8 ? isa::avx512vnni : set; }

/// Whether this processor and operating system run it, and this build of ldi has it.
inline bool is_available(isa set) {
    switch (set) {
        case isa::scalar: return true;
#if LDI_HAS_X86_KERNELS
        case isa::avx2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
        case isa::avx512vnni:
            return is_available(isa::avx2) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                   __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vnni");
#endif
#if LDI_HAS_AMX_KERNELS
        case isa::amx_int8: return is_available(isa::avx512vnni) && detail::may_use_amx();
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: return detail::has_dot_product_extension();
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: return true;
#endif
        default: return false;
    }
}

/// Whether bfloat16 numbers are multiplied where this set, which is_available(), is chosen: x86 processors may have that beside
/// AVX-512 (AVX512_BF16: Zen 4, Cooper Lake, Sapphire Rapids and later). Portable code does it too, slowly, for tests.
inline bool multiplies_bfloat16(isa set) {
#if LDI_HAS_X86_KERNELS
    if (without_tiles(set) == isa::avx512vnni) return __builtin_cpu_supports("avx512bf16");
#endif
    return set == isa::scalar;
}

/// The one that LDI_ISA names, else the fastest available. Raises an error if LDI_ISA names one that is not available here.
inline isa best_isa() {
    const char* const forced = std::getenv("LDI_ISA");
    const std::string_view name = forced == nullptr ? std::string_view() : std::string_view(forced);
    isa best = isa::scalar;
    std::string names;
    for (isa set : all_isas) {
        if (!is_available(set)) continue;
        if (name == to_string(set)) return set;
        names.append(names.empty() ? "" : ", ").append(to_string(set));
        best = set;
    }
    if (!name.empty()) raise(error_code::invalid_option, "LDI_ISA", "one of " + names, std::string(name));
    return best;
}

}  // namespace ldi
