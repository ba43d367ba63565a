// Memory put by for the moment in which there is no more: what follows, such as messages and the removal of unfinished files,
// takes a little, and the standard library and others end the program where a destructor gets none.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace ldi::examples {

/// The first `operator new` that fails gives the block back and tries again; small requests then succeed, large ones fail with
/// std::bad_alloc.
class spare_memory {
public:
    /// Puts memory by, unless some lies there. To be called at the program's beginning, and by a program that goes on after a
    /// failure.
    static void put_by() {
        std::set_new_handler(give_back);
        if (block_ != nullptr) return;
        void *const block = std::malloc(bytes), *none = nullptr;
        if (!block_.compare_exchange_strong(none, block)) std::free(block);  // another thread's lies there
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
