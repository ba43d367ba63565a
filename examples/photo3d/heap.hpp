// The heap of programs that convert photos. Every stage allocates and frees tens of megabytes.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/memory.hpp>

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>

#if defined(__GLIBC__)
#include <malloc.h>
#include <sys/resource.h>
#endif

namespace ldi::examples {

/// Asks for pages of 2 MB for the next 256 MB of the heap, unless a limit counts memory that is not used. The first write to each
/// page of 4 kB is expensive in virtual machines. On ours, the sample takes 0.74 times the processor time with large pages, and
/// 0.81 times if 30 seconds pass between runs.
inline void ask_for_large_pages() {
#if defined(__GLIBC__)
    for (const auto kind : {RLIMIT_AS, RLIMIT_DATA}) {
        rlimit limit{};
        if (::getrlimit(kind, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) return;
    }
    int policy = 0;
    if (std::FILE* const file = std::fopen("/proc/sys/vm/overcommit_memory", "r")) {
        if (std::fscanf(file, "%d", &policy) != 1) policy = 0;
        std::fclose(file);
    }
    constexpr int never = 2;
    if (policy == never) return;
    // ldi's allocator asks for large pages in large blocks. This block is freed at once; the heap keeps its addresses until it is
    // trimmed.
    constexpr std::size_t bytes = std::size_t{256} << 20;
    const memory& system = current_memory();
    if (void* const block = system.allocate(system.context, bytes, 64)) system.release(system.context, block, bytes);
#endif
}

/// Keeps freed memory for the next stage, because returning it to the system after each stage would take more time than the
/// stages themselves. All threads share one heap; otherwise each would keep as much as its largest photo needed. Call this
/// function at the start of main().
inline void prepare_heap() {
#if defined(__GLIBC__)
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    ask_for_large_pages();
}

/// Aligns blocks inside larger blocks of the current memory. A heap can use a freed block again for another block of the same
/// size. glibc's aligned_alloc() does not: it searches for more bytes than requested, to have room for the alignment.
class reusing_memory {
public:
    reusing_memory() = default;
    reusing_memory(const reusing_memory&) = delete;
    reusing_memory& operator=(const reusing_memory&) = delete;

    const memory& source() const { return source_; }

private:
    static constexpr std::size_t max_alignment = 64;
    static constexpr std::size_t room = sizeof(void*) + max_alignment;  // for the address of the larger block, and to align

    void* allocate(std::size_t bytes, std::size_t alignment) const {
        LDI_ASSERT(alignment <= max_alignment);
        if (bytes > std::numeric_limits<std::size_t>::max() - room) return nullptr;
        void* const whole = below_.allocate(below_.context, bytes + room, alignof(std::max_align_t));
        if (whole == nullptr) return nullptr;
        std::size_t space = bytes + max_alignment;
        void* block = static_cast<std::byte*>(whole) + sizeof whole;
        block = std::align(alignment, bytes, block, space);
        std::memcpy(static_cast<std::byte*>(block) - sizeof whole, &whole, sizeof whole);
        return block;
    }
    void release(void* block, std::size_t bytes) const {
        void* whole = nullptr;
        std::memcpy(&whole, static_cast<std::byte*>(block) - sizeof whole, sizeof whole);
        below_.release(below_.context, whole, bytes + room);
    }

    const memory& below_ = current_memory();
    memory source_{
        this,
        [](void* self, std::size_t bytes, std::size_t alignment) {
            return static_cast<const reusing_memory*>(self)->allocate(bytes, alignment);
        },
        [](void* self, void* block, std::size_t bytes) { static_cast<const reusing_memory*>(self)->release(block, bytes); }};
};

/// Returns the memory for the stages of the program. The first call must precede all memory scopes.
inline const memory& program_memory() {
#if defined(__SANITIZE_ADDRESS__)
    return current_memory();  // whose blocks have exactly the requested size, so that the sanitizer sees every overflow
#else
    static const reusing_memory only;
    return only.source();
#endif
}

/// Returns free memory to the system.
inline void trim_heap() {
#if defined(__GLIBC__)
    malloc_trim(0);
#endif
    ask_for_large_pages();
}

}  // namespace ldi::examples
