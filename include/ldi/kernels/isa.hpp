// Instruction sets for which kernels/ has code. Each set is a row of `instruction_sets`. A program selects a set at run time
// when it packs weights. All sets return the same bits, except in float32 convolutions. The environment variable LDI_ISA forces
// a set by its name, for tests and benchmarks. kernels/README.md has a table of all families and sets, and the steps to add a
// set.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/kernels/cpu_feature.hpp>
#include <ldi/kernels/detail/cpu_features.hpp>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

enum class isa {
    scalar,            ///< portable C++, and the reference in tests
    avx2,              ///< AVX2 and FMA
    avx_vnni,          ///< AVX2 and 256-bit VNNI (products of bytes): Intel's client processors since Alder Lake
    avx512vnni,        ///< AVX-512 F, BW, VL and VNNI
    neon_dot_product,  ///< 64-bit Arm with the dot product extension
    wasm_simd128,      ///< WebAssembly's 128-bit vectors; a compiler flag enables them for the whole module
};

struct instruction_set {
    isa id;
    std::string_view name;             ///< value of LDI_ISA
    std::array<cpu_feature, 4> needs;  ///< required features
    isa otherwise;                     ///< replaces this set in families that have no kernel for it
};

/// All sets, slowest first.
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

/// Returns the row of instruction_sets for `id`.
constexpr const instruction_set& find_instruction_set(isa id) {
    for (const instruction_set& set : instruction_sets)
        if (set.id == id) return set;
    return instruction_sets.front();
}

/// Returns the name that LDI_ISA accepts for the set.
constexpr std::string_view to_string(isa set) { return find_instruction_set(set).name; }

/// Whether the processor, the operating system and this build of ldi support the set.
inline bool is_available(isa set) {
    for (const cpu_feature feature : find_instruction_set(set).needs)
        if (!detail::has_feature(feature)) return false;
    return true;
}

/// Raises invalid_option if the set is not available.
///
/// where  place of the error, for the message
inline void check_available(const char* where, isa set) {
    if (!is_available(set))
        raise(error_code::invalid_option, where, "an instruction set that this processor and build support",
              std::string(to_string(set)));
}

/// Returns the instruction set that the environment variable LDI_ISA names, or the fastest available one if LDI_ISA is unset or
/// empty. Raises invalid_option if the named instruction set is not available.
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

/// Returns a family's kernel for the set `wanted`, or for the set that replaces it. Every table has a row for scalar.
template <class Kernel, std::size_t rows>
constexpr const Kernel& find_kernel(const Kernel (&table)[rows], isa wanted) {
    for (isa set = wanted;; set = find_instruction_set(set).otherwise)
        for (const Kernel& kernel : table)
            if (kernel.set == set) return kernel;
}

}}  // namespace ldi
