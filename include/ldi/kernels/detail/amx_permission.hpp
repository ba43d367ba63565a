// Whether this program may use AMX: the processor has it, the operating system saves its registers, and Linux grants them to this
// process, which has to ask for them because they add 8 KiB to what is saved of each thread that uses them.
#pragma once

#include <ldi/base/config.hpp>

#include <ldi/kernels/detail/cpuid.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_AMX_KERNELS

#include <sys/syscall.h>
#include <unistd.h>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION::detail {

/// 8 tiles of 16 rows of 64 bytes, products of bytes, and an operating system that knows of them.
inline bool processor_has_amx() {
    constexpr std::uint32_t osxsave = 1U << 27, amx_tile = 1U << 24, amx_int8 = 1U << 25, tile_state = 3U << 17;
    constexpr std::uint32_t feature_leaf = 7, tile_leaf = 0x1D, multiplier_leaf = 0x1E;
    if (cpuid_leaf(0).a < multiplier_leaf || (cpuid_leaf(1).c & osxsave) == 0) return false;
    if ((cpuid_leaf(feature_leaf).d & (amx_tile | amx_int8)) != (amx_tile | amx_int8)) return false;
    std::uint32_t enabled = 0, upper = 0;
    asm volatile("xgetbv" : "=a"(enabled), "=d"(upper) : "c"(0));
    if ((enabled & tile_state) != tile_state || cpuid_leaf(tile_leaf).a < 1) return false;
    const cpuid_leaf palette(tile_leaf, 1), multiplier(multiplier_leaf);
    const std::uint32_t row_bytes = palette.b & 0xFFFF, tiles = palette.b >> 16, rows = palette.c & 0xFFFF;
    const std::uint32_t most_inputs = multiplier.b & 0xFF, most_sum_bytes = multiplier.b >> 8 & 0xFFFF;
    return row_bytes >= 64 && tiles >= 8 && rows >= 16 && most_inputs >= 16 && most_sum_bytes >= 64;
}

/// Asks Linux once; what it grants holds for all threads of the process. From then on it refuses alternate signal stacks too
/// small for the registers (about 11 KiB).
inline bool may_use_amx() {
#ifdef SYS_arch_prctl
    constexpr long request_permission = 0x1023, tile_data = 18;  // ARCH_REQ_XCOMP_PERM, XFEATURE_XTILE_DATA
    static const bool granted = processor_has_amx() && syscall(SYS_arch_prctl, request_permission, tile_data) == 0;
    return granted;
#else
    return false;
#endif
}

}  // namespace ldi::detail

#endif
