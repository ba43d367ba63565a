// A stable sort that allocates its scratch memory from the caller's allocator (base/memory.hpp). std::stable_sort would use the
// global heap.
#pragma once

#include <ldi/base/buffer.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Sorts K values by `before(a, b)`; equal values keep their order. Merges bottom-up, with up to about K log K comparisons.
template <class T, class Before>
void stable_sort(buffer<T>& values, Before before) {
    constexpr std::size_t shortest = 16;  // for shorter ranges, insertion is faster than merging; tuned by experiment
    const std::size_t count = values.size();
    for (std::size_t first = 0; first < count; first += shortest)  // sorts each short range by insertion
        for (std::size_t i = first + 1; i < (std::min)(first + shortest, count); ++i)
            for (std::size_t j = i; j > first && before(values[j], values[j - 1]); --j) std::swap(values[j], values[j - 1]);
    buffer<T> merged;
    for (std::size_t length = shortest; length < count; length *= 2) {
        merged.clear();
        merged.reserve(count);
        for (std::size_t first = 0; first < count; first += 2 * length) {
            const std::size_t middle = (std::min)(first + length, count), last = (std::min)(middle + length, count);
            for (std::size_t a = first, b = middle; a < middle || b < last;)
                merged.push_back(b == last || (a < middle && !before(values[b], values[a])) ? values[a++] : values[b++]);
        }
        values.swap(merged);
    }
}

}}  // namespace ldi
