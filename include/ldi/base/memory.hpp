// Custom allocators. A `memory_scope` selects the allocator for all buffers (base/buffer.hpp) that ldi creates, so that an
// engine can account for the memory of every stage.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <utility>

#if defined(_WIN32)
#include <malloc.h>
#elif defined(__linux__) && !defined(LDI_STANDARD_ONLY)
#include <sys/mman.h>
#define LDI_HAS_HUGE_PAGES 1
#endif

namespace ldi { inline namespace LDI_CONFIGURATION {

/// An allocator. It must outlive everything allocated from it. The threads of a stage may call its functions at the same time.
struct memory {
    void* context = nullptr;
    /// Returns at least `bytes` bytes, aligned to `alignment`, a power of two; null if memory is exhausted.
    void* (*allocate)(void* context, std::size_t bytes, std::size_t alignment) = nullptr;
    /// Releases a block that `allocate` returned for the same number of bytes.
    void (*release)(void* context, void* block, std::size_t bytes) = nullptr;
};

namespace detail {

#if defined(_WIN32)  // C libraries of Windows have no aligned_alloc
inline void* allocate_from_system(void*, std::size_t bytes, std::size_t alignment) { return _aligned_malloc(bytes, alignment); }
inline void release_to_system(void*, void* block, std::size_t) { _aligned_free(block); }
#else
inline void* allocate_from_system(void*, std::size_t bytes, std::size_t alignment) {
    void* const block = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
#if defined(LDI_HAS_HUGE_PAGES)
    // Asks for pages of 2 MB in large blocks. The first write to each small page is expensive, above all in virtual
    // machines. Small pages have 4 kB to 64 kB.
    constexpr std::uintptr_t small_page = 65536, huge_page = std::uintptr_t{2} << 20;
    const std::uintptr_t begin = (reinterpret_cast<std::uintptr_t>(block) + small_page - 1) / small_page * small_page;
    if (block != nullptr && bytes >= huge_page) ::madvise(reinterpret_cast<void*>(begin), bytes - small_page, MADV_HUGEPAGE);
#endif
    return block;
}
inline void release_to_system(void*, void* block, std::size_t) { std::free(block); }
#endif

inline constexpr memory system_memory{nullptr, &allocate_from_system, &release_to_system};

/// The memory from which this thread allocates.
inline const memory*& memory_of_thread() {
    static thread_local const memory* current = &system_memory;
    return current;
}

}  // namespace detail

/// Returns the allocator that new buffers on this thread use: the allocator of the innermost `memory_scope`, or the C library's
/// allocator if there is no scope.
inline const memory& current_memory() { return *detail::memory_of_thread(); }

/// Makes new buffers on the calling thread allocate from `from` until the scope ends. Stages called in the scope also use `from`
/// on the threads of their executor.
///
///     ldi::memory_scope scope(my_engine_memory);
///     ldi::photo3d result = ldi::make_photo3d(photo, estimator, inpainter);
class memory_scope {
public:
    /// from  must outlive the scope
    [[nodiscard]] explicit memory_scope(const memory& from)
        : from_(&from), before_(std::exchange(detail::memory_of_thread(), &from)) {
        LDI_ASSERT(from.allocate != nullptr && from.release != nullptr);
    }
    explicit memory_scope(const memory&&) = delete;
    /// Asserts that the scopes of a thread end in reverse order, on that thread.
    ~memory_scope() {
        LDI_ASSERT(detail::memory_of_thread() == from_);
        detail::memory_of_thread() = before_;
    }
    memory_scope(const memory_scope&) = delete;
    memory_scope& operator=(const memory_scope&) = delete;
    static void* operator new(std::size_t) = delete;

private:
    [[maybe_unused]] const memory* from_;  // read by an assertion
    const memory* before_;
};

}}  // namespace ldi
