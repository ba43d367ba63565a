// Runs: pixels that are contiguous in memory and linked from left to right. An LDI in canonical order consists mostly of long
// runs, so that code can process them like the rows of an image.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Pixels first, first + 1, ... last - 1, each the right neighbor of the previous one.
struct pixel_run {
    std::int32_t first, last;

    std::int32_t size() const { return last - first; }
};

/// Returns the last pixel of the run that `first` belongs to, but at most `limit`.
///
/// right  right neighbor of each pixel, up to that of `limit`
/// first  0 to `limit`
inline std::int32_t last_of_run(const std::int32_t* right, std::int32_t first, std::int32_t limit) {
    constexpr std::int32_t block = 16;
    std::int32_t last = first;
    for (; limit - last >= block; last += block) {
        std::int32_t difference = 0;  // vectorized, because runs are long
        for (std::int32_t k = 0; k < block; ++k) difference |= right[last + k] ^ (last + k + 1);
        if (difference != 0) break;
    }
    while (last < limit && right[last] == last + 1) ++last;
    return last;
}

/// Calls `visit(pixel_run)` for the maximal runs, which together contain every pixel once, in order.
template <class Visit>
void for_each_run(const graph_view& g, Visit&& visit) {
    const std::int32_t count = g.count();
    for (std::int32_t first = 0, last; first < count; first = last) {
        last = last_of_run(g.right().data(), first, count - 1) + 1;
        visit(pixel_run{first, last});
    }
}

/// Returns the runs of for_each_run().
inline buffer<pixel_run> runs_of(const graph_view& g) {
    buffer<pixel_run> runs;
    for_each_run(g, [&](pixel_run r) { runs.push_back(r); });
    return runs;
}

}}  // namespace ldi
