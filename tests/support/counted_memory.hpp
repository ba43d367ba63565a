// A memory source for ldi that counts allocations and can refuse them.
#pragma once

#include <ldi/base/memory.hpp>

#include <cstddef>
#include <mutex>

namespace ldi::testing {

/// Counts bytes in use, their peak, all bytes ever requested, and requests. Refuses all requests after the first `most`, and
/// requests that would exceed `limit` bytes in use. Thread-safe.
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
