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

/// Calls `visit(pixel_run)` for the maximal runs, which together contain every pixel once, in order.
template <class Visit>
void for_each_run(const graph_view& g, Visit&& visit) {
    const std::int32_t count = g.count();
    for (std::int32_t first = 0, last; first < count; first = last) {
        last = first + 1;
        while (last < count && g.right()[last - 1] == last) ++last;
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
