// Hallucinates occluded surfaces: the back side of every discontinuity grows behind its front side, one pixel per iteration, each
// curve as one front (paper, section "Occluded Surface Hallucination"), as far as the camera can uncover it.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/occlusion/detail/hidden_pixels.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace ldi::inline LDI_CONFIGURATION {

struct expand_options {
    /// How far the camera may go (render/motion.hpp), as a share of the photo's longer side: by so much, at most, does what is
    /// nearest move against what is farthest. Behind a step in disparity that uncovers the step's share of it, and so far
    /// surfaces grow. 0 to 1. (The paper grows them by 50 pixels, whatever the step and the camera.)
    float motion = 0.08F;
    /// The most pixels that a surface grows by, whatever the step.
    int iterations = 4096;
};

namespace detail {

class expansion {
public:
    expansion(graph& base, const buffer<float>& disparity, surface_rule surface, std::span<const discontinuity_curve> curves,
              float motion)
        : pixels_(base, disparity), surface_(surface), curves_(curves), reach_(base.size(), 0.0F) {
        const float pixels_per_disparity = motion * nearest_float((std::max)(base.width, base.height));
        for (const discontinuity_curve& curve : curves)
            for (const discontinuity& d : curve.sides) {
                const float uncovered = (disparity[d.front] - disparity[d.back]) * pixels_per_disparity;
                if (uncovered > 0.0F) reach_[d.back] = (std::max)(reach_[d.back], uncovered + margin);
            }
        for (const discontinuity_curve& curve : curves) {  // curves share pixels
            float& farthest = farthest_.emplace_back(0.0F);
            for (const discontinuity& d : curve.sides) farthest = (std::max)(farthest, reach_[d.back]);
        }
    }

    hidden_pixels& pixels() { return pixels_; }

    /// Iterations after which nothing grows: in four directions, growth takes up to sqrt(2) of them per pixel.
    int most_iterations() const {
        float farthest = 0.0F;
        for (const float f : farthest_) farthest = (std::max)(farthest, f);
        return static_cast<int>(std::ceil(1.5F * farthest));
    }

    void run_iteration(int iteration) {
        created_.clear();
        if (iteration == 0) {
            for (std::size_t c = 0; c < curves_.size(); ++c)
                for (const discontinuity& d : curves_[c].sides) grow(c, d.back, d.towards_front);
        } else {
            for (const front_pixel& f : front_)
                for (side s : all_sides) grow(f.curve, f.pixel, s);
        }
        front_.swap(created_);
    }

private:
    // From the middle of a pixel at the silhouette to the edge of the last one that is uncovered, even if only in part.
    static constexpr float margin = 1.5F;

    struct front_pixel {
        std::size_t curve;
        std::int32_t pixel;
    };

    // Grows `pixel` one step to side `s`: links it to the surface that is there already, or makes a pixel.
    void grow(std::size_t curve, std::int32_t pixel, side s) {
        if (pixels_.neighbor(pixel, s) != no_pixel) return;
        const std::int32_t x = pixels_.x(pixel) + step_x(s), y = pixels_.y(pixel) + step_y(s);
        if (!pixels_.inside(x, y) || crosses_constraint(curve, x, y)) return;
        const float source = pixels_.disparity(pixel);
        const std::int32_t position = pixels_.position(x, y);

        // The paper's average of the neighbors: on each side the pixel of this surface, if there is one that is free to be
        // linked. The new pixel's origin is that of the neighbor whose reach goes farthest beyond it.
        std::int32_t neighbors[4], origin = no_pixel;
        float sum = 0.0F, count = 0.0F, room = 0.0F;
        for (int i = 0; i < 4; ++i) {
            const side t = all_sides[i];
            const std::int32_t neighbor = t == opposite(s) ? pixel : free_neighbor(x, y, t, source);
            neighbors[i] = neighbor;
            if (neighbor == no_pixel) continue;
            sum += pixels_.disparity(neighbor);
            count += 1.0F;
            const float room_there = room_beyond(pixels_.origin(neighbor), x, y);
            if (room_there >= room) room = room_there, origin = pixels_.origin(neighbor);
        }
        if (origin == no_pixel) return;
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
        const std::int32_t made = pixels_.add(position, created, origin);
        for (int i = 0; i < 4; ++i)
            if (neighbors[i] != no_pixel && surface_.same_surface(pixels_.disparity(neighbors[i]), created))
                pixels_.link(made, all_sides[i], neighbors[i]);
        created_.push_back({curve, made});
    }

    // How much farther than to (x, y) the surface at `origin` may grow, in pixels.
    float room_beyond(std::int32_t origin, std::int32_t x, std::int32_t y) const {
        if (!(reach_[origin] > 0.0F)) return -1.0F;
        const float dx = nearest_float(x - pixels_.x(origin)), dy = nearest_float(y - pixels_.y(origin));
        return reach_[origin] - std::sqrt(dx * dx + dy * dy);
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

    // Whether the center of (x, y) lies on the half line at one of the curve's ends. The line is so wide that no step of one
    // pixel leads across it, and so long that no front gets around it. That it starts 2 pixels before the curve's end was chosen
    // by trial.
    bool crosses_constraint(std::size_t curve, std::int32_t x, std::int32_t y) const {
        constexpr float thickness = 1.5F;
        for (const growth_constraint& c : curves_[curve].constraints) {
            const float dx = nearest_float(x) + 0.5F - c.x, dy = nearest_float(y) + 0.5F - c.y;
            const float outward = dx * c.outward_x + dy * c.outward_y;
            const float along = dx * c.perpendicular_x + dy * c.perpendicular_y;
            if (outward > 0.0F && outward <= thickness && along > -2.0F && along < 2.0F * farthest_[curve]) return true;
        }
        return false;
    }

    hidden_pixels pixels_;
    surface_rule surface_;
    std::span<const discontinuity_curve> curves_;
    buffer<front_pixel> front_, created_;  // the newest pixels, curve by curve
    buffer<float> reach_;                  // of each visible pixel: how far its surface grows from there, in pixels
    buffer<float> farthest_;               // the largest of each curve
};

}  // namespace detail

/// layer   as lift() makes it and close_spurious_discontinuities() leaves it
/// curves  of the same layer
///
/// The same image with hidden pixels added, in canonical order. The disparity of a new pixel is the average of those that it grew
/// from, and always farther than the photo's at that position by more than surface_rule::largest_step; every other
/// column follows its own rule (new_pixels). New links join pixels of one surface. `after_iteration(graph, disparity,
/// first_new)`, if given, sees the unordered state after every iteration (for tests and pictures; it costs a copy each).
///
/// At most 1 / surface_rule::largest_step surfaces lie at one position; noise at all scales adds five pixels per pixel of the
/// photo, most photos less than a half. Time is linear in the pixels of the result; up to 110 bytes for each of them.
template <payload_column... Columns, class AfterIteration = std::nullptr_t>
layered_image<Columns...> expand(single_layer<Columns...> layer, std::span<const discontinuity_curve> curves,
                                 const expand_options& options = {}, const progress_listener& progress = {},
                                 AfterIteration&& after_iteration = nullptr) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    if (options.iterations < 0)
        raise(error_code::invalid_option, "expand_options::iterations", "0 or more", std::to_string(options.iterations));
    if (!(options.motion >= 0 && options.motion <= 1))
        raise(error_code::invalid_option, "expand_options::motion", "0 to 1", detail::to_text(options.motion));
    detail::expansion expansion(layer.topology, layer.template column<disparity_column>(), layer.surface, curves, options.motion);
    const int last = (std::min)(options.iterations, expansion.most_iterations());
    for (int i = 0; i < last; ++i) {
        expansion.run_iteration(i);
        if constexpr (!std::is_same_v<std::remove_cvref_t<AfterIteration>, std::nullptr_t>)
            expansion.pixels().show(after_iteration);
        progress.report("occluded geometry", detail::nearest_float(i) / detail::nearest_float(last));
    }
    progress.report("occluded geometry", 1.0F);
    layered_image<Columns...> grown = expansion.pixels().merge_into(layer);
    const int all = expansion.most_iterations();
    grown.motion = last < all ? options.motion * detail::nearest_float(last) / detail::nearest_float(all) : options.motion;
    return grown;
}

}  // namespace ldi
