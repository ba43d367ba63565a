// The part of a buffer (base/buffer.hpp) that does not depend on the type of its values: allocation, growth and release.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/memory.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Reports that memory is exhausted. Compiled once for all types of values.
[[noreturn]] inline void out_of_memory() {
#if LDI_HAS_EXCEPTIONS
    throw std::bad_alloc();
#else
    raise(error_code::out_of_memory, "memory", "enough memory", "too little");  // strings short enough to need no allocation
#endif
}

/// Raises too_large, because `count` values of `value_size` bytes exceed the address space.
[[noreturn]] inline void refuse_count(std::size_t count, std::size_t value_size) {
    raise(error_code::too_large, "buffer",
          "at most " + std::to_string(static_cast<std::size_t>(PTRDIFF_MAX) / value_size) + " values of " +
              std::to_string(value_size) + " bytes",
          std::to_string(count));
}

/// Type-independent part of a buffer, compiled once for all types.
struct memory_block {
    void* values = nullptr;
    std::size_t size = 0, capacity = 0;  ///< in values
    const memory* from = nullptr;

    /// Allocates a larger, empty block. The first successful call fixes the allocator for all later calls.
    void* allocate(std::size_t new_capacity, std::size_t value_size, std::size_t alignment) {
        const memory& source = from != nullptr ? *from : current_memory();
        if (new_capacity > static_cast<std::size_t>(PTRDIFF_MAX) / value_size) refuse_count(new_capacity, value_size);
        void* place = source.allocate(source.context, new_capacity * value_size, alignment);
        if (place == nullptr) out_of_memory();
        LDI_ASSERT(reinterpret_cast<std::uintptr_t>(place) % alignment == 0);
        from = &source;
        return place;
    }
    /// Releases the old block and switches to `place`, to which the caller has moved the values.
    void replace(void* place, std::size_t new_capacity, std::size_t value_size) {
        release(value_size);
        values = place, capacity = new_capacity;
    }
    /// Moves values of a trivially copyable type to a larger block.
    [[gnu::noinline]] void reallocate(std::size_t new_capacity, std::size_t value_size, std::size_t alignment) {
        void* place = allocate(new_capacity, value_size, alignment);
        if (size > 0) std::memcpy(place, values, size * value_size);
        replace(place, new_capacity, value_size);
    }
    void release(std::size_t value_size) const {
        if (values != nullptr) from->release(from->context, values, capacity * value_size);
    }
    std::size_t grown(std::size_t needed) const {
        const std::size_t more = capacity + capacity / 2 + 4;
        return more > needed ? more : needed;
    }
};

}}}  // namespace ldi::detail
