// Removes what the weighted median leaves behind: isolated features at middle values, between a foreground and a background
// (paper, section "Depth Pre-processing", connected components).
#pragma once

#include <ldi/base/disjoint_sets.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi {

struct middle_component_options {
    /// Components with fewer pixels than this are merged.
    std::int32_t smallest_size = 20;
};

namespace detail {

// Pixels of the photo that are connected, as runs and the component of each run. Pixel (x, y) has index y * columns + x.
struct image_components {
    std::int32_t columns = 0;
    buffer<pixel_run> runs;
    buffer<std::size_t> row_start;  // the first run of each row, and one past the last
    buffer<std::int32_t> label;     // the component of each run

    std::int32_t at(std::int32_t x, std::int32_t y) const {
        const auto first = runs.begin() + static_cast<std::ptrdiff_t>(row_start[y]);
        const auto last = runs.begin() + static_cast<std::ptrdiff_t>(row_start[static_cast<std::size_t>(y) + 1]);
        const auto after = std::upper_bound(first, last, y * columns + x,
                                            [](std::int32_t value, const pixel_run& r) { return value < r.first; });
        return label[after - runs.begin() - 1];
    }
};

inline image_components find_components(image_view<const float> disparity, surface_rule surface) {
    const std::int32_t rows = static_cast<std::int32_t>(disparity.height()),
                       columns = static_cast<std::int32_t>(disparity.width());
    image_components found;
    found.columns = columns;
    disjoint_sets sets;
    std::size_t above_first = 0, above_last = 0;
    for (std::int32_t y = 0; y < rows; ++y) {
        const float* here = disparity.row(y);
        const std::size_t first = found.runs.size();
        found.row_start.push_back(first);
        for (std::int32_t x = 0, start = 0; x < columns; ++x)
            if (x + 1 == columns || !surface.same_surface(here[x], here[x + 1])) {
                found.runs.push_back({y * columns + start, y * columns + x + 1});
                sets.add();
                start = x + 1;
            }
        // Runs of two rows that overlap are connected if any pair of pixels in the overlap is.
        for (std::size_t above = above_first, run = first; above < above_last && run < found.runs.size();) {
            const pixel_run &a = found.runs[above], &b = found.runs[run];
            const float* over = disparity.row(y - 1);
            const std::int32_t row = y * columns, row_above = row - columns;
            for (std::int32_t x = (std::max)(a.first - row_above, b.first - row);
                 x < (std::min)(a.last - row_above, b.last - row); ++x)
                if (surface.same_surface(here[x], over[x])) {
                    sets.merge(static_cast<std::int32_t>(above), static_cast<std::int32_t>(run));
                    break;
                }
            const bool above_ends = a.last + columns <= b.last, here_ends = b.last <= a.last + columns;
            above += above_ends ? 1 : 0, run += here_ends ? 1 : 0;
        }
        above_first = first, above_last = found.runs.size();
    }
    found.row_start.push_back(found.runs.size());
    sets.number(found.label);
    return found;
}

// The pixels of one small component.
struct small_component {
    buffer<pixel_run> runs;
    std::int32_t columns = 0;

    template <class Visit>
    void for_each_pixel(Visit&& visit) const {
        for (const pixel_run& r : runs)
            for (std::int32_t i = r.first; i < r.last; ++i) visit(i % columns, i / columns);
    }
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
    const std::int32_t rows = static_cast<std::int32_t>(disparity.height()),
                       columns = static_cast<std::int32_t>(disparity.width());

    buffer<std::int32_t> size, small_index;
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::size_t label = static_cast<std::size_t>(components.label[r]);
        if (label >= size.size()) size.resize(label + 1, 0);
        size[label] += components.runs[r].size();
    }
    buffer<detail::small_component> small_ones;
    small_index.assign(size.size(), -1);
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::size_t label = static_cast<std::size_t>(components.label[r]);
        if (size[label] >= options.smallest_size) continue;
        if (small_index[label] < 0) {
            small_index[label] = static_cast<std::int32_t>(small_ones.size());
            small_ones.emplace_back().columns = columns;
        }
        small_ones[small_index[label]].runs.push_back(components.runs[r]);
    }

    const auto value = [&](std::int32_t x, std::int32_t y) -> float& { return disparity.row(y)[x]; };
    struct assignment {
        std::int32_t x, y;
        float disparity;
    };
    std::size_t merged = 0;
    buffer<assignment> pending, next;
    for (const detail::small_component& component : small_ones) {
        const std::int32_t label = components.at(component.runs.front().first % columns, component.runs.front().first / columns);
        // Every pixel side on the component's boundary, with the pixel across it.
        const auto for_each_contact = [&](auto&& visit) {
            component.for_each_pixel([&](std::int32_t x, std::int32_t y) {
                for (side s : all_sides) {
                    const std::int32_t u = x + step_x(s), v = y + step_y(s);
                    if (u < 0 || v < 0 || u >= columns || v >= rows || components.at(u, v) == label) continue;
                    visit(x, y, value(u, v));
                }
            });
        };
        std::int32_t nearer = 0, farther = 0;
        for_each_contact([&](std::int32_t x, std::int32_t y, float other) { ++(other > value(x, y) ? nearer : farther); });
        if (nearer == 0 || farther == 0) continue;

        const bool to_nearer = nearer > farther;
        pending.clear();
        for_each_contact([&](std::int32_t x, std::int32_t y, float other) {
            if ((other > value(x, y)) == to_nearer) pending.push_back({x, y, other});
        });
        // Breadth first: a pixel takes the value that reaches it first.
        buffer<std::pair<std::int32_t, std::int32_t>> done;
        const auto is_done = [&](std::int32_t x, std::int32_t y) {
            return std::find(done.begin(), done.end(), std::pair{x, y}) != done.end();
        };
        while (!pending.empty()) {
            next.clear();
            for (const assignment& a : pending) {
                if (is_done(a.x, a.y)) continue;
                done.emplace_back(a.x, a.y);
                value(a.x, a.y) = a.disparity;
                for (side s : all_sides) {
                    const std::int32_t u = a.x + step_x(s), v = a.y + step_y(s);
                    if (u < 0 || v < 0 || u >= columns || v >= rows || components.at(u, v) != label || is_done(u, v)) continue;
                    next.push_back({u, v, a.disparity});
                }
            }
            pending.swap(next);
        }
        ++merged;
    }
    return merged;
}

}  // namespace ldi
