// Instruction sets that the kernels of kernels/ are written for: one row of `instruction_sets` each. Which one runs is decided at
// run time, when weights are packed; all of them give the same bits. The environment variable LDI_ISA forces one by its name, for
// tests and benchmarks. A new set is a row here, a file in the folder of each family that it makes faster, and a row in that
// family's table (kernels/gemm_u8.hpp and its like); README.md beside this file shows which set has which.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/kernels/detail/cpu_features.hpp>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

namespace ldi::inline LDI_CONFIGURATION {

enum class isa {
    scalar,            ///< portable C++, and the reference in tests
    avx2,              ///< AVX2 and FMA
    avx_vnni,          ///< AVX2 with VNNI's products of bytes in 256 bits: Intel's client processors since Alder Lake
    avx512vnni,        ///< AVX-512 F, BW, VL and VNNI
    neon_dot_product,  ///< 64-bit Arm with the dot product extension
    wasm_simd128,      ///< WebAssembly's 128-bit vectors: all of a module uses them or nothing, so the compiler's flags decide
};

struct instruction_set {
    isa id;
    std::string_view name;             ///< as LDI_ISA spells it
    std::array<cpu_feature, 4> needs;  ///< all of them
    isa otherwise;                     ///< whose kernel runs where a family has none for this set
};

/// Slowest first.
inline constexpr std::array instruction_sets{
    instruction_set{isa::scalar, "scalar", {}, isa::scalar},
    instruction_set{isa::avx2, "avx2", {cpu_feature::avx2, cpu_feature::fma}, isa::scalar},
    instruction_set{isa::avx_vnni, "avxvnni", {cpu_feature::avx2, cpu_feature::fma, cpu_feature::avx_vnni}, isa::avx2},
    instruction_set{isa::avx512vnni,
                    "avx512vnni",
                    {cpu_feature::avx2, cpu_feature::fma, cpu_feature::avx512, cpu_feature::avx512_vnni},
                    isa::avx2},
    instruction_set{isa::neon_dot_product, "neon", {cpu_feature::arm_dot_product}, isa::scalar},
    instruction_set{isa::wasm_simd128, "wasm", {cpu_feature::wasm_simd128}, isa::scalar}};

constexpr const instruction_set& find_instruction_set(isa id) {
    for (const instruction_set& set : instruction_sets)
        if (set.id == id) return set;
    return instruction_sets.front();
}

/// The name as LDI_ISA spells it.
constexpr std::string_view to_string(isa set) { return find_instruction_set(set).name; }

/// Whether this processor and operating system run it, and this build of ldi has it.
inline bool is_available(isa set) {
    for (const cpu_feature feature : find_instruction_set(set).needs)
        if (!detail::has_feature(feature)) return false;
    return true;
}

/// The one that LDI_ISA names, else the fastest available. Raises an error if LDI_ISA names one that is not available here.
inline isa best_isa() {
    const char* const forced = std::getenv("LDI_ISA");
    const std::string_view name = forced == nullptr ? std::string_view() : std::string_view(forced);
    isa best = isa::scalar;
    std::string names;
    for (const instruction_set& set : instruction_sets) {
        if (!is_available(set.id)) continue;
        if (name == set.name) return set.id;
        names.append(names.empty() ? "" : ", ").append(set.name);
        best = set.id;
    }
    if (!name.empty()) raise(error_code::invalid_option, "LDI_ISA", "one of " + names, std::string(name));
    return best;
}

/// The row of a family's table for this set, or for the nearest one that the table has in its place. Every table has one for
/// scalar.
template <class Kernel, std::size_t rows>
constexpr const Kernel& find_kernel(const Kernel (&table)[rows], isa wanted) {
    for (isa set = wanted;; set = find_instruction_set(set).otherwise)
        for (const Kernel& kernel : table)
            if (kernel.set == set) return kernel;
}

}  // namespace ldi
