// Settings of glibc's heap for programs that convert photos. Every stage allocates and frees tens of megabytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#if defined(__GLIBC__)
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#endif

namespace ldi::examples {

/// Keeps freed memory for the next stage, and asks for pages of 2 MB. Call this function at the start of main().
///
/// Returning memory to the system after each stage would take more time than the stages themselves. So would the first writes to
/// pages of 4 kB in virtual machines: with large pages, the sample takes two thirds of the processor time, and 8 MB more.
inline void prepare_heap() {
#if defined(__GLIBC__)
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    // Sets the advice on a block that is freed at once; the heap keeps its addresses. A limit of the address space would count
    // them.
    rlimit addresses{};
    if (::getrlimit(RLIMIT_AS, &addresses) != 0 || addresses.rlim_cur != RLIM_INFINITY) return;
    constexpr std::size_t bytes = std::size_t{512} << 20;
    constexpr std::uintptr_t page = 4096;
    void* const block = std::malloc(bytes);
    const std::uintptr_t begin = (reinterpret_cast<std::uintptr_t>(block) + page - 1) / page * page;
    if (block != nullptr) ::madvise(reinterpret_cast<void*>(begin), bytes - page, MADV_HUGEPAGE);
    std::free(block);
#endif
}

}  // namespace ldi::examples
