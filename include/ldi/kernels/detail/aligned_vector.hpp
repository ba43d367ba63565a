// A vector whose first value lies on a cache line, so that no load of packed weights straddles two.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace ldi::detail {

inline constexpr std::size_t cache_line = 64;

template <class T>
struct aligned_allocator {
    using value_type = T;

    aligned_allocator() = default;
    template <class Other>
    aligned_allocator(const aligned_allocator<Other>&) {}

    T* allocate(std::size_t count) { return static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{cache_line})); }
    void deallocate(T* values, std::size_t) { ::operator delete (values, std::align_val_t{cache_line}); }

    friend bool operator==(const aligned_allocator&, const aligned_allocator&) { return true; }
};

template <class T>
using aligned_vector = std::vector<T, aligned_allocator<T>>;

}  // namespace ldi::detail
