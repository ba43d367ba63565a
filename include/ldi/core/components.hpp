// Connected components: which pixels can be reached from one another over links. Depth cleaning (paper, section "Geometry",
// isolated features at middle values) and everything that must treat a surface as one thing starts from them.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi {

/// A partition of the pixels of a graph.
struct components {
    buffer<std::int32_t> label;  ///< K: the component of each pixel; components are numbered by their first pixels
    buffer<std::int32_t> size;   ///< the number of pixels in each component

    std::size_t count() const { return size.size(); }
};

/// The connected components of a graph in any order, in almost linear time. Fastest in canonical order, where linked pixels of
/// a scanline stand side by side: the sets that are merged are then runs, not pixels.
inline components connected_components(const graph& g) {
    components result;
    const std::size_t count = g.size();

    // Runs: pixels with successive indices, each the left neighbor of the next. `label` holds the run of each pixel for now.
    buffer<std::int32_t>& run_of = result.label;
    run_of.resize(count);
    buffer<std::size_t> run_starts;
    detail::disjoint_sets runs;
    for (std::size_t i = 0; i < count; ++i) {
        if (i == 0 || g.left[i] != static_cast<std::int32_t>(i) - 1) {
            run_starts.push_back(i);
            runs.add();
        }
        run_of[i] = static_cast<std::int32_t>(runs.size()) - 1;
    }
    run_starts.push_back(count);

    for (std::size_t run = 0; run < runs.size(); ++run) {
        const std::int32_t this_run = static_cast<std::int32_t>(run);
        const std::int32_t left = g.left[run_starts[run]];
        if (left != no_pixel) runs.merge(this_run, run_of[left]);
        // Most pixels of a run look up at the same run as the pixel before them: [merged_first, merged_last) is merged already.
        std::int32_t merged_first = 0, merged_last = 0;
        for (std::size_t i = run_starts[run]; i < run_starts[run + 1]; ++i) {
            const std::int32_t above = g.up[i];
            if (above == no_pixel || (above >= merged_first && above < merged_last)) continue;
            const std::size_t run_above = static_cast<std::size_t>(run_of[above]);
            runs.merge(this_run, static_cast<std::int32_t>(run_above));
            merged_first = static_cast<std::int32_t>(run_starts[run_above]);
            merged_last = static_cast<std::int32_t>(run_starts[run_above + 1]);
        }
    }

    buffer<std::int32_t> label_of_run;
    result.size.assign(static_cast<std::size_t>(runs.number(label_of_run)), 0);
    for (std::size_t run = 0; run < runs.size(); ++run) {
        const std::int32_t label = label_of_run[run];
        std::fill(result.label.begin() + static_cast<std::ptrdiff_t>(run_starts[run]),
                  result.label.begin() + static_cast<std::ptrdiff_t>(run_starts[run + 1]), label);
        result.size[label] += static_cast<std::int32_t>(run_starts[run + 1] - run_starts[run]);
    }
    return result;
}

}  // namespace ldi
