// Fills memory with zeros when a decoder allocates it. libde265, which decodes HEIC for libheif, does not set the pixels that a
// coded picture leaves out. Without the zeros, a damaged file would show old memory contents of the process, such as another
// user's photo.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdlib>
#include <mutex>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// While at least one object exists, glibc fills all memory that malloc() returns with zeros. Has no effect in other C libraries,
/// or if the program replaces malloc(). Small blocks that a thread has just freed are the exception: up to 1032 bytes.
class zeroed_allocations {
public:
    zeroed_allocations() { count(1); }
    ~zeroed_allocations() { count(-1); }
    zeroed_allocations(const zeroed_allocations&) = delete;
    zeroed_allocations& operator=(const zeroed_allocations&) = delete;

private:
    static void count([[maybe_unused]] int change) {
#if defined(__GLIBC__)
        static std::mutex mutex;
        static int objects = 0;
        const std::lock_guard lock(mutex);
        objects += change;
        // malloc() fills new memory with the complement of this value, and free() fills freed memory with the value itself.
        // Afterward, applies the value of MALLOC_PERTURB_ again.
        const char* const chosen = std::getenv("MALLOC_PERTURB_");
        mallopt(M_PERTURB, objects > 0 ? 255 : chosen == nullptr ? 0 : std::atoi(chosen));
#endif
    }
};

}}}  // namespace ldi::detail
