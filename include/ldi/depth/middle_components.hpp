// Removes what the weighted median leaves behind: isolated features at middle values, between a foreground and a background
// (paper, section "Depth Pre-processing", connected components).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

struct middle_component_options {
    /// Components with fewer pixels than this are merged.
    std::int32_t smallest_size = 20;
};

namespace detail {

// Pixels of the photo that are connected, as runs and the component of each run. Pixel (x, y) has index y * columns + x.
struct image_components {
    std::int32_t columns = 0;
    buffer<pixel_run> runs;
    buffer<std::int32_t> row_start;  // the first run of each row, and one past the last
    buffer<std::int32_t> label;      // the component of each run

    std::int32_t at(std::int32_t x, std::int32_t y) const {
        const auto first = runs.begin() + row_start[y], last = runs.begin() + row_start[y + 1];
        const auto after = std::upper_bound(first, last, y * columns + x,
                                            [](std::int32_t value, const pixel_run& r) { return value < r.first; });
        return label[after - runs.begin() - 1];
    }
};

// Where the pixels of a row that are linked from `first` on end.
inline std::int32_t end_of_run(const float* row, std::int32_t first, std::int32_t columns, surface_rule surface) {
    constexpr std::int32_t step = 16;  // together, as most of them are linked: compilers make vectors of that
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
        // Runs of two rows that overlap are connected if any pair of pixels in the overlap is.
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

// The pixels of one small component.
struct small_component {
    std::int32_t label = 0, columns = 0;
    buffer<pixel_run> runs;

    template <class Visit>
    void for_each_pixel(Visit&& visit) const {
        for (const pixel_run& r : runs)
            for (std::int32_t i = r.first; i < r.last; ++i) visit(i % columns, i / columns);
    }
};

// The components with fewer pixels than `smallest_size`, in the order of their first pixels.
inline buffer<small_component> find_small_components(const image_components& components, std::int32_t smallest_size) {
    buffer<std::int32_t> size, small_index;
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (label >= size.count()) size.push_back(0);  // labels are in the order of first runs
        size[label] += components.runs[r].size();
    }
    buffer<small_component> result;
    small_index.assign(size.size(), -1);
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (size[label] >= smallest_size) continue;
        if (small_index[label] < 0) {
            small_index[label] = result.count();
            result.push_back({label, components.columns, {}});
        }
        result[small_index[label]].runs.push_back(components.runs[r]);
    }
    return result;
}

// Merges one component after the other.
class component_merger {
public:
    component_merger(const image_components& components, image_view<float> disparity)
        : components_(components), disparity_(disparity) {}

    // False if the component is no middle value and stays.
    bool merge(const small_component& component) {
        std::int32_t nearer = 0, farther = 0;
        for_each_contact(component,
                         [&](std::int32_t x, std::int32_t y, float other) { ++(other > disparity_(y, x) ? nearer : farther); });
        if (nearer == 0 || farther == 0) return false;
        const bool to_nearer = nearer > farther;
        pending_.clear();
        for_each_contact(component, [&](std::int32_t x, std::int32_t y, float other) {
            if ((other > disparity_(y, x)) == to_nearer) pending_.push_back({x, y, other});
        });
        spread(component.label);
        return true;
    }

private:
    struct assignment {
        std::int32_t x, y;
        float disparity;
    };

    // The pixels beside (x, y).
    template <class Visit>
    void for_each_neighbor(std::int32_t x, std::int32_t y, Visit&& visit) const {
        for (side s : all_sides) {
            const std::int32_t u = x + step_x(s), v = y + step_y(s);
            if (u >= 0 && v >= 0 && u < components_.columns && v < components_.row_start.count() - 1) visit(u, v);
        }
    }

    // Every pixel side on the component's boundary, with the disparity across it.
    template <class Visit>
    void for_each_contact(const small_component& component, Visit&& visit) const {
        component.for_each_pixel([&](std::int32_t x, std::int32_t y) {
            for_each_neighbor(x, y, [&](std::int32_t u, std::int32_t v) {
                if (components_.at(u, v) != component.label) visit(x, y, disparity_(v, u));
            });
        });
    }

    // Breadth first from the pending pixels on: a pixel of the component takes the value that reaches it first.
    void spread(std::int32_t label) {
        done_.clear();
        while (!pending_.empty()) {
            next_.clear();
            for (const assignment& a : pending_) {
                if (is_done(a.x, a.y)) continue;
                done_.emplace_back(a.x, a.y);
                disparity_(a.y, a.x) = a.disparity;
                for_each_neighbor(a.x, a.y, [&](std::int32_t u, std::int32_t v) {
                    if (components_.at(u, v) == label && !is_done(u, v)) next_.push_back({u, v, a.disparity});
                });
            }
            pending_.swap(next_);
        }
    }
    bool is_done(std::int32_t x, std::int32_t y) const {
        return std::find(done_.begin(), done_.end(), std::pair{x, y}) != done_.end();
    }

    const image_components& components_;
    image_view<float> disparity_;
    buffer<assignment> pending_, next_;
    buffer<std::pair<std::int32_t, std::int32_t>> done_;
};

}  // namespace detail

/// disparity  H x W x 1, changed in place
///
/// A component of fewer than `smallest_size` pixels that touches both nearer and farther pixels takes the disparity of the side
/// that it touches along more pixel sides (the farther one where they are equal), spreading inwards from there. One that touches
/// only one side is no middle value (a small thing in front, or a small hole) and stays. Returns the number of components merged.
inline std::size_t merge_middle_components(image_view<float> disparity, surface_rule surface = {},
                                           const middle_component_options& options = {}) {
    const detail::image_components components = detail::find_components(disparity, surface);
    detail::component_merger merger(components, disparity);
    std::size_t merged = 0;
    for (const detail::small_component& c : detail::find_small_components(components, options.smallest_size))
        if (merger.merge(c)) ++merged;
    return merged;
}

}  // namespace ldi
