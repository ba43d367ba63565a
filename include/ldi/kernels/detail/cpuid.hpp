// The CPUID instruction of x86.
#pragma once

#include <ldi/base/config.hpp>

#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct cpuid_leaf {
    std::uint32_t a = 0, b = 0, c = 0, d = 0;

    explicit cpuid_leaf(std::uint32_t leaf, std::uint32_t subleaf = 0) {
        asm volatile("cpuid" : "=a"(a), "=b"(b), "=c"(c), "=d"(d) : "a"(leaf), "c"(subleaf));
    }
};

}}}  // namespace ldi::detail

#endif
