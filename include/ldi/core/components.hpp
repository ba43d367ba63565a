// Connected components of a graph: sets of pixels that links connect, for code that treats a surface as a unit. Depth cleaning,
// which has no graph yet, finds the components of a disparity map instead (depth/middle_components.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A partition of the pixels of a graph.
struct components {
    buffer<std::int32_t> label;  ///< K: component of each pixel; components are numbered in the order of their first pixels
    buffer<std::int32_t> size;   ///< number of pixels in each component

    std::size_t count() const { return size.size(); }
};

namespace detail {

/// connected_components() for a graph whose invariants hold.
inline components components_of_sound(const graph_view& g) {
    components result;
    const std::size_t count = g.size();

    const buffer<pixel_run> runs = runs_of(g);
    buffer<std::int32_t>& run_of = result.label;  // run of each pixel; the same memory receives the labels at the end
    run_of.resize(count);
    disjoint_sets sets;
    for (std::int32_t run = 0; run < runs.count(); ++run) {
        sets.add();
        std::fill(run_of.begin() + runs[run].first, run_of.begin() + runs[run].last, run);
    }

    for (std::int32_t run = 0; run < runs.count(); ++run) {
        const std::int32_t left = g.left()[runs[run].first];
        if (left != no_pixel) sets.merge(run, run_of[left]);
        // The pixels above usually belong to one run, which needs to be merged only once. [merged_first, merged_last) is the run
        // above that was merged last.
        std::int32_t merged_first = 0, merged_last = 0;
        for (std::int32_t i = runs[run].first; i < runs[run].last; ++i) {
            const std::int32_t above = g.up()[i];
            if (above == no_pixel || (above >= merged_first && above < merged_last)) continue;
            const std::int32_t run_above = run_of[above];
            sets.merge(run, run_above);
            merged_first = runs[run_above].first, merged_last = runs[run_above].last;
        }
    }

    buffer<std::int32_t> label_of_run;
    result.size.assign(static_cast<std::size_t>(sets.number(label_of_run)), 0);
    for (std::size_t run = 0; run < runs.size(); ++run) {
        const std::int32_t label = label_of_run[run];
        std::fill(result.label.begin() + runs[run].first, result.label.begin() + runs[run].last, label);
        result.size[label] += runs[run].size();
    }
    return result;
}

}  // namespace detail

/// Finds the connected components of a graph of K pixels in O(K log K) time. Pixels may be in any order. Canonical order is
/// fastest: linked pixels of a scanline are contiguous, so that whole runs are merged instead of single pixels.
inline components connected_components(const graph& g) { return detail::components_of_sound(g); }
/// Same, for a view of a graph. Raises mismatch if the view violates an invariant of `graph`, even in release builds.
inline components connected_components(const graph_view& g) {
    check_topology(g, "connected_components");
    return detail::components_of_sound(g);
}

}}  // namespace ldi
