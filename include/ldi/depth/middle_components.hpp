// Removes artifacts of the weighted median: isolated features at middle values, between a foreground and a background (paper,
// section "Depth Pre-processing", connected components).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of merge_middle_components().
struct middle_component_options {
    /// Only components with fewer pixels than this are merged.
    std::int32_t min_size = 20;
};

namespace detail {

// Connected components of the photo's pixels, as runs with the component of each run. Pixel (x, y) has index y * columns + x.
struct image_components {
    std::int32_t columns = 0;
    buffer<pixel_run> runs;
    buffer<std::int32_t> row_start;  // first run of each row, then the number of runs
    buffer<std::int32_t> label;      // component of each run

    std::int32_t at(std::int32_t x, std::int32_t y) const {
        const auto first = runs.begin() + row_start[y], last = runs.begin() + row_start[y + 1];
        const auto after = std::upper_bound(first, last, y * columns + x,
                                            [](std::int32_t value, const pixel_run& r) { return value < r.first; });
        return label[after - runs.begin() - 1];
    }
};

// Returns the end of the run of linked pixels that starts at `first`. Neighbors on one surface count as linked.
inline std::int32_t end_of_run(const float* row, std::int32_t first, std::int32_t columns, surface_rule surface) {
    constexpr std::int32_t step = 16;  // pixels per block; most pixels are linked, and compilers vectorize the inner loop
    std::int32_t end = first + 1;
    for (; end + step <= columns; end += step) {
        std::int32_t linked = 0;
        for (std::int32_t i = end; i < end + step; ++i) linked += surface.same_surface(row[i - 1], row[i]) ? 1 : 0;
        if (linked < step) break;
    }
    while (end < columns && surface.same_surface(row[end - 1], row[end])) ++end;
    return end;
}

inline image_components find_components(image_view<const float> disparity, surface_rule surface) {
    const std::int32_t rows = static_cast<std::int32_t>(disparity.height()),
                       columns = static_cast<std::int32_t>(disparity.width());
    image_components found;
    found.columns = columns;
    disjoint_sets sets;
    std::int32_t above_first = 0, above_last = 0;
    for (std::int32_t y = 0; y < rows; ++y) {
        const float* here = disparity.row(y);
        const std::int32_t first = found.runs.count();
        found.row_start.push_back(first);
        for (std::int32_t start = 0, end; start < columns; start = end) {
            end = end_of_run(here, start, columns, surface);
            found.runs.push_back({y * columns + start, y * columns + end});
            sets.add();
        }
        // Overlapping runs of two rows are connected if any pair of pixels in the overlap is linked.
        for (std::int32_t above = above_first, run = first; above < above_last && run < found.runs.count();) {
            const pixel_run &a = found.runs[above], &b = found.runs[run];
            const float* over = disparity.row(y - 1);
            const std::int32_t row = y * columns, row_above = row - columns;
            for (std::int32_t x = (std::max)(a.first - row_above, b.first - row);
                 x < (std::min)(a.last - row_above, b.last - row); ++x)
                if (surface.same_surface(here[x], over[x])) {
                    sets.merge(above, run);
                    break;
                }
            const bool above_ends = a.last + columns <= b.last, here_ends = b.last <= a.last + columns;
            above += above_ends ? 1 : 0, run += here_ends ? 1 : 0;
        }
        above_first = first, above_last = found.runs.count();
    }
    found.row_start.push_back(found.runs.count());
    sets.number(found.label);
    return found;
}

// Small components and their runs.
struct small_components {
    buffer<std::int32_t> labels;
    buffer<pixel_run> runs;         // runs of these components, component by component
    buffer<std::size_t> first_run;  // component i has runs [first_run[i], first_run[i + 1])
};

// Finds the components with fewer pixels than `min_size`, in the order of their first pixels.
inline small_components find_small_components(const image_components& components, std::int32_t min_size) {
    buffer<std::int32_t> size, run_count;
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (label >= size.count()) size.push_back(0), run_count.push_back(0);  // components are numbered by their first runs
        size[label] += components.runs[r].size(), ++run_count[label];
    }
    small_components result;
    buffer<std::size_t> next(size.size());  // index in result.runs for each component's next run
    std::size_t total = 0;
    for (std::int32_t label = 0; label < size.count(); ++label) {
        if (size[label] >= min_size) continue;
        result.labels.push_back(label);
        result.first_run.push_back(total);
        next[label] = total;
        total += static_cast<std::size_t>(run_count[label]);
    }
    result.first_run.push_back(total);
    result.runs.resize(total);
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (size[label] < min_size) result.runs[next[label]++] = components.runs[r];
    }
    return result;
}

// Merges components one by one.
class component_merger {
public:
    component_merger(const image_components& components, const small_components& small_ones, image_view<float> disparity)
        : components_(components), small_(small_ones), disparity_(disparity) {
        if (!small_ones.labels.empty()) reached_.resize(disparity.height() * disparity.width());
    }

    // Merges a component with its nearer or its farther surroundings, whichever it touches along more pixel sides. Returns false
    // and changes nothing if it has no nearer or no farther neighbor.
    bool merge(std::size_t component) {
        std::int32_t nearer = 0, farther = 0;
        for_each_contact(component,
                         [&](std::int32_t x, std::int32_t y, float other) { ++(other > disparity_(y, x) ? nearer : farther); });
        if (nearer == 0 || farther == 0) return false;
        const bool to_nearer = nearer > farther;
        queue_.clear();
        for_each_contact(component, [&](std::int32_t x, std::int32_t y, float other) {
            if ((other > disparity_(y, x)) == to_nearer) reach(x, y, other);
        });
        spread(small_.labels[component]);
        return true;
    }

private:
    struct assignment {
        std::int32_t x, y;
        float disparity;
    };

    // Visits the neighbors of (x, y).
    template <class Visit>
    void for_each_neighbor(std::int32_t x, std::int32_t y, Visit&& visit) const {
        for (side s : all_sides) {
            const std::int32_t u = x + step_x(s), v = y + step_y(s);
            if (u >= 0 && v >= 0 && u < components_.columns && v < components_.row_start.count() - 1) visit(u, v);
        }
    }

    // Calls visit(x, y, disparity) for every pixel side on the component's boundary, with the component's pixel at the side and
    // the disparity across it.
    template <class Visit>
    void for_each_contact(std::size_t component, Visit&& visit) const {
        const std::int32_t columns = components_.columns, label = small_.labels[component];
        for (std::size_t r = small_.first_run[component]; r < small_.first_run[component + 1]; ++r)
            for (std::int32_t i = small_.runs[r].first; i < small_.runs[r].last; ++i)
                for_each_neighbor(i % columns, i / columns, [&](std::int32_t u, std::int32_t v) {
                    if (components_.at(u, v) != label) visit(i % columns, i / columns, disparity_(v, u));
                });
    }

    // Assigns a value to a pixel unless it already has one.
    void reach(std::int32_t x, std::int32_t y, float disparity) {
        std::uint8_t& reached = reached_[std::int64_t{y} * components_.columns + x];
        if (reached == 0) reached = 1, queue_.push_back({x, y, disparity});
    }

    // Spreads values breadth-first from the reached pixels.
    void spread(std::int32_t label) {
        for (std::size_t i = 0; i < queue_.size(); ++i) {
            const assignment a = queue_[i];
            disparity_(a.y, a.x) = a.disparity;
            for_each_neighbor(a.x, a.y, [&](std::int32_t u, std::int32_t v) {
                if (components_.at(u, v) == label) reach(u, v, a.disparity);
            });
        }
    }

    const image_components& components_;
    const small_components& small_;
    image_view<float> disparity_;
    buffer<assignment> queue_;
    buffer<std::uint8_t> reached_;  // per pixel of the photo: 1 if it has a new value
};

}  // namespace detail

/// Merges small components at middle values with a neighboring surface. Returns the number of merged components.
///
/// disparity  H x W x 1, changed in place
/// surface    rule that decides whether neighboring pixels belong to one surface
///
/// A component of fewer than `min_size` pixels that touches both nearer and farther pixels gets the disparities of the group
/// with which it shares more pixel sides, or of the farther pixels in case of a tie. These disparities spread inward from the
/// shared pixel sides. A component that touches only nearer or only farther pixels is a small hole or a small foreground
/// object, not a middle value, and does not change. Time is linear, except that each pixel of a small component requires binary
/// searches among the runs of a row. Memory is up to 60 bytes per pixel. Raises mismatch for another number of channels,
/// too_large for 2^31 pixels or more.
inline std::size_t merge_middle_components(image_view<float> disparity, surface_rule surface = {},
                                           const middle_component_options& options = {}) {
    detail::check_map(disparity, "merge_middle_components");
    detail::check_pixel_count(disparity, "merge_middle_components");
    const detail::image_components components = detail::find_components(disparity, surface);
    const detail::small_components small_ones = detail::find_small_components(components, options.min_size);
    detail::component_merger merger(components, small_ones, disparity);
    std::size_t merged = 0;
    for (std::size_t c = 0; c < small_ones.labels.size(); ++c)
        if (merger.merge(c)) ++merged;
    return merged;
}

}}  // namespace ldi
