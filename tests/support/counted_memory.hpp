// Memory that a test hands to ldi, and that it can take away.
#pragma once

#include <ldi/base/memory.hpp>

#include <cstddef>
#include <mutex>

namespace ldi::testing {

/// Counts what is out, the most of it at any time, all that was ever asked for, and how often. Says no from the `most`-th call
/// on, and to what would take more than `limit` bytes at a time. May be asked by any thread.
struct counted_memory {
    std::mutex mutex;
    std::size_t blocks = 0, bytes = 0, peak = 0, allocated = 0, calls = 0;
    std::size_t most = static_cast<std::size_t>(-1), limit = static_cast<std::size_t>(-1);
    memory source{this, &allocate, &release};

    static void* allocate(void* context, std::size_t bytes, std::size_t alignment) {
        counted_memory& self = *static_cast<counted_memory*>(context);
        {
            const std::lock_guard lock(self.mutex);
            if (self.calls++ >= self.most || self.bytes + bytes > self.limit) return nullptr;
            ++self.blocks, self.bytes += bytes, self.allocated += bytes;
            self.peak = self.bytes > self.peak ? self.bytes : self.peak;
        }
        return detail::system_memory.allocate(nullptr, bytes, alignment);
    }
    static void release(void* context, void* block, std::size_t bytes) {
        counted_memory& self = *static_cast<counted_memory*>(context);
        detail::system_memory.release(nullptr, block, bytes);
        const std::lock_guard lock(self.mutex);
        --self.blocks, self.bytes -= bytes;
    }
};

}  // namespace ldi::testing
