// Keeps memory in reserve in case memory runs out: messages and the removal of unfinished files need a little, and an allocation
// that fails in a destructor terminates the program.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace ldi::examples {

/// The first `operator new` that fails releases the reserve and tries again; small requests then succeed, large ones throw
/// std::bad_alloc.
class spare_memory {
public:
    /// Reserves memory, unless a reserve exists. Call this function at the program's start, and again after a failure that the
    /// program survives.
    static void reserve() {
        std::set_new_handler(give_back);
        if (block_ != nullptr) return;
        void *const block = std::malloc(bytes), *none = nullptr;
        if (!block_.compare_exchange_strong(none, block)) std::free(block);  // another thread has made a reserve
    }

private:
    static constexpr std::size_t bytes = std::size_t{1} << 20;

    static void give_back() {
        void* const block = block_.exchange(nullptr);
        if (block == nullptr) throw std::bad_alloc();
        std::free(block);
    }

    static inline std::atomic<void*> block_{nullptr};
};

}  // namespace ldi::examples
