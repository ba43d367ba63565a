// Detects the dot product extension of 64-bit Arm processors. Armv8.2 introduced it as an option; most phones since 2018 and all
// Apple M chips have it.
#pragma once

#include <ldi/base/config.hpp>

#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_ARM_KERNELS

#if defined(__linux__)
#include <asm/hwcap.h>
#include <sys/auxv.h>
#elif defined(__APPLE__)
#include <sys/sysctl.h>

#include <cstddef>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Whether the processor has the extension. On operating systems other than Linux and Apple's, returns whether the compiler's
/// flags enable the extension.
inline bool has_dot_product_extension() {
#if defined(__linux__)
    return (getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0;
#elif defined(__APPLE__)
    int found = 0;
    std::size_t size = sizeof found;
    return sysctlbyname("hw.optional.arm.FEAT_DotProd", &found, &size, nullptr, 0) == 0 && found != 0;
#elif defined(__ARM_FEATURE_DOTPROD)
    return true;
#else
    return false;
#endif
}

}}}  // namespace ldi::detail

#endif
