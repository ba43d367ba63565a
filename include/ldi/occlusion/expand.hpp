// Hallucinates occluded surfaces: the back side of every discontinuity grows behind its front side, one pixel an iteration, each
// curve as one front (paper, section "Occluded Surface Hallucination").
#pragma once

#include <ldi/base/executor.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/occlusion/detail/hidden_pixels.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace ldi {

struct expand_options {
    /// How far surfaces grow, in pixels: the width of what can be uncovered.
    int iterations = 50;
};

namespace detail {

class expansion {
public:
    expansion(graph& base, std::span<const float> disparity, surface_rule surface, std::span<const discontinuity_curve> curves,
              const expand_options& options)
        : pixels_(base, disparity), surface_(surface), curves_(curves), options_(options), fronts_(curves.size()) {}

    hidden_pixels& pixels() { return pixels_; }

    void run_iteration(int iteration) {
        for (std::size_t c = 0; c < curves_.size(); ++c) {
            created_.clear();
            if (iteration == 0) {
                for (const discontinuity& d : curves_[c].sides) grow(curves_[c], d.back, d.towards_front);
            } else {
                for (std::int32_t pixel : fronts_[c])
                    for (side s : all_sides) grow(curves_[c], pixel, s);
            }
            fronts_[c].swap(created_);
        }
    }

private:
    // Grows `pixel` one step to side `s`: links it to the surface that is there already, or makes a pixel.
    void grow(const discontinuity_curve& curve, std::int32_t pixel, side s) {
        if (pixels_.neighbor(pixel, s) != no_pixel) return;
        const std::int32_t x = pixels_.x(pixel) + step_x(s), y = pixels_.y(pixel) + step_y(s);
        if (!pixels_.inside(x, y) || crosses_constraint(curve, x, y)) return;
        const float source = pixels_.disparity(pixel);
        const std::int32_t position = pixels_.position(x, y);

        // The paper's average of the neighbors: on each side the pixel of this surface, if there is one that is free to be
        // linked.
        std::int32_t neighbors[4];
        float sum = 0.0F, count = 0.0F;
        for (side t : all_sides) {
            const std::int32_t neighbor = t == opposite(s) ? pixel : free_neighbor(x, y, t, source);
            neighbors[static_cast<std::size_t>(t)] = neighbor;
            if (neighbor == no_pixel) continue;
            sum += pixels_.disparity(neighbor);
            count += 1.0F;
        }
        const float created = sum / count;

        for (std::int32_t there = position; there != no_pixel; there = pixels_.next_at_position(there)) {
            const float other = pixels_.disparity(there);
            if (surface_.same_surface(other, source)) {  // fronts that meet link up; else the place is taken
                if (pixels_.neighbor(there, opposite(s)) == no_pixel) pixels_.link(pixel, s, there);
                return;
            }
            const bool is_visible = there == position;
            if (surface_.same_surface(other, created) || (is_visible && created > other)) return;
        }
        const std::int32_t made = pixels_.add(position, created, pixel);
        for (side t : all_sides) {
            const std::int32_t neighbor = neighbors[static_cast<std::size_t>(t)];
            if (neighbor != no_pixel && surface_.same_surface(pixels_.disparity(neighbor), created))
                pixels_.link(made, t, neighbor);
        }
        created_.push_back(made);
    }

    // The pixel next to (x, y) on side `s`, with no neighbor there yet, that is nearest in disparity to `source` and within the
    // threshold of it.
    std::int32_t free_neighbor(std::int32_t x, std::int32_t y, side s, float source) const {
        const std::int32_t u = x + step_x(s), v = y + step_y(s);
        if (!pixels_.inside(u, v)) return no_pixel;
        std::int32_t best = no_pixel;
        float best_difference = surface_.largest_step;
        for (std::int32_t there = pixels_.position(u, v); there != no_pixel; there = pixels_.next_at_position(there)) {
            const float difference = std::abs(pixels_.disparity(there) - source);
            if (difference > best_difference || pixels_.neighbor(there, opposite(s)) != no_pixel) continue;
            best = there, best_difference = difference;
        }
        return best;
    }

    // Whether the center of (x, y) lies on the half line at one of the curve's ends. The line is taken wide enough that no step
    // leads across it, and long enough that no front gets round it.
    bool crosses_constraint(const discontinuity_curve& curve, std::int32_t x, std::int32_t y) const {
        constexpr float thickness = 1.5F;
        for (const growth_constraint& c : curve.constraints) {
            const float dx = static_cast<float>(x) + 0.5F - c.x, dy = static_cast<float>(y) + 0.5F - c.y;
            const float outward = dx * c.outward_x + dy * c.outward_y;
            const float along = dx * c.perpendicular_x + dy * c.perpendicular_y;
            if (outward > 0.0F && outward <= thickness && along > -2.0F && along < 2.0F * static_cast<float>(options_.iterations))
                return true;
        }
        return false;
    }

    hidden_pixels pixels_;
    surface_rule surface_;
    std::span<const discontinuity_curve> curves_;
    const expand_options& options_;
    buffer<buffer<std::int32_t>> fronts_;  // the newest pixels of each curve
    buffer<std::int32_t> created_;
};

}  // namespace detail

/// layer   as lift() makes it and close_spurious_discontinuities() leaves it
/// curves  of the same layer
///
/// The same image with hidden pixels added, in canonical order. The disparity of a new pixel is the average of those that it grew
/// from, and always farther than the photo's at that position by more than surface_rule::largest_step; each other column says
/// itself what new pixels have (new_pixels). New links join pixels of one surface. `after_iteration(graph, disparity,
/// first_new)`, if given, sees the unordered state after every iteration (for tests and pictures; it costs a copy each).
template <payload_column... Columns, class AfterIteration = std::nullptr_t>
layered_image<Columns...> expand(single_layer<Columns...> layer, std::span<const discontinuity_curve> curves,
                                 const expand_options& options = {}, const progress_listener& progress = {},
                                 AfterIteration&& after_iteration = nullptr) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    if (options.iterations < 0 || options.iterations > 4096)
        raise(error_code::invalid_option, "expand_options::iterations", "0 to 4096", std::to_string(options.iterations));
    detail::expansion expansion(layer.topology, layer.template column<disparity_column>(), layer.surface, curves, options);
    for (int i = 0; i < options.iterations; ++i) {
        expansion.run_iteration(i);
        if constexpr (!std::is_same_v<std::remove_cvref_t<AfterIteration>, std::nullptr_t>)
            expansion.pixels().show(after_iteration);
        progress.report("occluded geometry", static_cast<float>(i + 1) / static_cast<float>(options.iterations));
    }
    return expansion.pixels().merge_into(layer);
}

}  // namespace ldi
