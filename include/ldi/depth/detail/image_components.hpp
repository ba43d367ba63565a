// Connected components of a disparity map as runs of pixels, and the merging of small ones with a neighboring surface
// (depth/middle_components.hpp, depth/flakes.hpp).
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

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

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

// Calls visit(above, run, first, last) for every run of row `y`, 1 or more, and every run of the row above that share columns:
// those from `first` to before `last`. The runs of row `y` may be the last ones.
template <class Visit>
void for_each_overlap(const buffer<pixel_run>& runs, const buffer<std::int32_t>& row_start, std::int32_t last_run, std::int32_t y,
                      std::int32_t columns, Visit&& visit) {
    const std::int32_t row = y * columns, here = row_start[y];
    for (std::int32_t above = row_start[y - 1], run = here; above < here && run < last_run;) {
        const std::int32_t first = runs[above].first + columns, last = runs[above].last + columns;
        visit(above, run, (std::max)(first, runs[run].first) - row, (std::min)(last, runs[run].last) - row);
        const bool above_ends = last <= runs[run].last, here_ends = runs[run].last <= last;
        above += above_ends ? 1 : 0, run += here_ends ? 1 : 0;
    }
}

inline image_components find_components(image_view<const float> disparity, surface_rule surface) {
    const std::int32_t rows = static_cast<std::int32_t>(disparity.height()),
                       columns = static_cast<std::int32_t>(disparity.width());
    image_components found;
    found.columns = columns;
    disjoint_sets sets;
    for (std::int32_t y = 0; y < rows; ++y) {
        const float* here = disparity.row(y);
        found.row_start.push_back(found.runs.count());
        for (std::int32_t start = 0, end; start < columns; start = end) {
            end = end_of_run(here, start, columns, surface);
            found.runs.push_back({y * columns + start, y * columns + end});
            sets.add();
        }
        // Overlapping runs of two rows are connected if any pair of pixels in the overlap is linked.
        if (y == 0) continue;
        const float* over = disparity.row(y - 1);
        for_each_overlap(found.runs, found.row_start, found.runs.count(), y, columns,
                         [&](std::int32_t above, std::int32_t run, std::int32_t first, std::int32_t last) {
                             std::int32_t x = first;
                             while (x < last && !surface.same_surface(here[x], over[x])) ++x;
                             if (x < last) sets.merge(above, run);
                         });
    }
    found.row_start.push_back(found.runs.count());
    sets.number(found.label);
    return found;
}

// Number of pixels of each component.
inline buffer<std::int32_t> component_sizes(const image_components& components) {
    buffer<std::int32_t> size;
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (label >= size.count()) size.push_back(0);  // components are numbered by their first runs
        size[label] += components.runs[r].size();
    }
    return size;
}

// Some components and their runs.
struct chosen_components {
    buffer<std::int32_t> labels;
    buffer<pixel_run> runs;         // runs of these components, component by component
    buffer<std::size_t> first_run;  // component i has runs [first_run[i], first_run[i + 1])

    template <class Visit>
    void for_each_pixel(std::size_t component, Visit&& visit) const {
        for (std::size_t r = first_run[component]; r < first_run[component + 1]; ++r)
            for (std::int32_t i = runs[r].first; i < runs[r].last; ++i) visit(i);
    }
};

// Collects the components for which `is_chosen(label)` is true, in the order of their first pixels.
template <class IsChosen>
chosen_components choose_components(const image_components& components, std::int32_t count, IsChosen&& is_chosen) {
    constexpr std::size_t not_chosen = static_cast<std::size_t>(-1);
    buffer<std::int32_t> run_count(static_cast<std::size_t>(count), 0);
    for (const std::int32_t label : components.label) ++run_count[label];
    chosen_components result;
    buffer<std::size_t> next(run_count.size(), not_chosen);  // index in result.runs for each component's next run
    std::size_t total = 0;
    for (std::int32_t label = 0; label < count; ++label) {
        if (!is_chosen(label)) continue;
        result.labels.push_back(label);
        result.first_run.push_back(total);
        next[label] = total;
        total += static_cast<std::size_t>(run_count[label]);
    }
    result.first_run.push_back(total);
    result.runs.resize(total);
    for (std::size_t r = 0; r < components.runs.size(); ++r) {
        const std::int32_t label = components.label[r];
        if (next[label] != not_chosen) result.runs[next[label]++] = components.runs[r];
    }
    return result;
}

// Number of pixel sides at which a component touches nearer pixels, and farther ones, of other components.
struct contacts {
    std::int32_t nearer = 0, farther = 0;

    void add(bool is_nearer) { ++(is_nearer ? nearer : farther); }
};

// Merges components one by one.
class component_merger {
public:
    component_merger(const image_components& components, const chosen_components& chosen, image_view<float> disparity)
        : components_(components), chosen_(chosen), disparity_(disparity) {
        if (!chosen.labels.empty()) reached_.resize(disparity.height() * disparity.width());
    }

    // Replaces a component's disparities by those of its nearer or its farther neighbors for which accepts(label) is true; there
    // must be at least one. The disparities spread inward from the contacts.
    template <class Accepts>
    void merge(std::size_t component, bool to_nearer, Accepts&& accepts) {
        queue_.clear();
        for_each_contact(component, [&](std::int32_t x, std::int32_t y, float other, std::int32_t label) {
            if (accepts(label) && (other > disparity_(y, x)) == to_nearer) reach(x, y, other);
        });
        spread(chosen_.labels[component]);
    }

    // Calls visit(x, y, disparity, label) for every pixel side on the component's boundary, with the component's pixel at the
    // side, and with the current disparity and the component across it.
    template <class Visit>
    void for_each_contact(std::size_t component, Visit&& visit) const {
        const std::int32_t columns = components_.columns, own = chosen_.labels[component];
        chosen_.for_each_pixel(component, [&](std::int32_t i) {
            for_each_neighbor(i % columns, i / columns, [&](std::int32_t u, std::int32_t v) {
                if (const std::int32_t label = components_.at(u, v); label != own)
                    visit(i % columns, i / columns, disparity_(v, u), label);
            });
        });
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
    const chosen_components& chosen_;
    image_view<float> disparity_;
    buffer<assignment> queue_;
    buffer<std::uint8_t> reached_;  // per pixel of the photo: 1 if it has a new value
};

}}}  // namespace ldi::detail
