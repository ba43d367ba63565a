// Grows hidden surfaces, iteration by iteration (occlusion/expand.hpp).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/occlusion/detail/hidden_pixels.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Grows the surfaces behind all curves at the same time. A surface that meets another one at similar depth, but cannot be linked
/// to it, ends there; the mesh closes the gap (mesh/detail/hems.hpp).
class expansion {
public:
    expansion(graph_builder base, array_view<const float> disparity, surface_rule surface,
              std::span<const discontinuity_curve> curves, float motion, bool merges_curves)
        : pixels_(std::move(base), disparity),
          surface_(surface),
          curves_(curves),
          merges_curves_(merges_curves),
          reach_(disparity.size(), 0.0F) {
        parallax_ = max_parallax(pixels_.width(), pixels_.height(), motion);
        const float margin = half_pixels + mesh_pixels + mesh_disparity * parallax_;
        const auto raise_reach = [&](std::int32_t back, float step) {
            if (step > 0.0F) reach_[back] = (std::max)(reach_[back], step * parallax_ + margin);
        };
        for (const discontinuity_curve& curve : curves) {
            const std::int32_t last = curve.sides.count() - 1;
            for (std::int32_t i = 0; i <= last; ++i) {
                const std::int32_t back = curve.sides[i].back;
                for (std::int32_t k = (std::max)(i - smoothing, 0); k <= (std::min)(i + smoothing, last); ++k) {
                    const discontinuity& d = curve.sides[k];
                    raise_reach(back, disparity[d.front] - disparity[d.back]);
                }
            }
        }
        for (const discontinuity_curve& curve : curves)
            for (const growth_constraint& c : curve.constraints) {
                // Past this end of the curve, the camera sees the surface behind the midground. The nearest front pixel along
                // the curve determines the parallax there.
                const float front = nearest_front(curve, c, disparity);
                const std::int32_t x = static_cast<std::int32_t>(c.x), y = static_cast<std::int32_t>(c.y);
                for (const std::int32_t back : {pixels_.position(x - 1, y - 1), pixels_.position(x, y - 1),
                                                pixels_.position(x - 1, y), pixels_.position(x, y)})
                    if (reach_[back] > 0.0F) raise_reach(back, front - disparity[back]);
            }
        for (const discontinuity_curve& curve : curves) {  // after the loops above, because curves share pixels
            float& farthest = farthest_.emplace_back(0.0F);
            for (const discontinuity& d : curve.sides) farthest = (std::max)(farthest, reach_[d.back]);
        }
        for (const discontinuity_curve& curve : curves) {
            buffer<float>& lengths = constraint_lengths_.emplace_back();
            for (const growth_constraint& c : curve.constraints) lengths.push_back(reach_at(curve, c));
        }
    }

    hidden_pixels& pixels() { return pixels_; }

    /// Whether no surface can grow any further.
    bool is_finished(int iterations_done) const { return iterations_done > 0 && front_.empty(); }

    /// Approximate number of iterations until growth is finished. Growth in four directions needs up to sqrt(2) iterations per
    /// pixel of distance. Surfaces that recede from the camera as they grow need more iterations.
    int expected_iterations() const {
        float farthest = 0.0F;
        for (const float f : farthest_) farthest = (std::max)(farthest, f);
        return static_cast<int>(std::ceil(1.5F * farthest));
    }

    void run_iteration(int iteration) {
        created_.clear();
        if (iteration == 0) {
            for (std::size_t c = 0; c < curves_.size(); ++c)
                for (const discontinuity& d : curves_[c].sides) grow({c, d.back}, d.toward_front);
        } else {
            for (const front_pixel& f : front_)
                for (side s : all_sides) grow(f, s);
        }
        front_.swap(created_);
    }

    /// Merges all pixels; see hidden_pixels::merge().
    template <executor Executor>
    grown_pixels merge(Executor& threads) {
        reach_ = {}, curve_of_ = {};
        return pixels_.merge(threads);
    }

private:
    // The hidden surface must reach the far edge of the last pixel that is at least partly uncovered. Measured from the center of
    // the pixel at the silhouette, this edge is up to 1.5 pixels farther away than the parallax.
    static constexpr float half_pixels = 1.5F;

    // Distance along a curve, in pixel sides, over which the mesh blends disparities when it smooths outlines.
    static constexpr std::int32_t smoothing = 8;

    // Minimum gain in remaining growth, in pixels, for which a pixel adopts another origin.
    static constexpr float min_gain = 0.5F;

    struct front_pixel {
        std::size_t curve;
        std::int32_t pixel;
    };

    // Grows the surface of a pixel by one step toward side `s`: links the pixel to an existing one of its surface, or adds one.
    void grow(const front_pixel& from, side s) {
        const auto [curve, pixel] = from;
        if (const std::int32_t neighbor = pixels_.neighbor(pixel, s); neighbor != no_pixel) {
            improve_origin(curve, pixel, neighbor);
            return;
        }
        const std::int32_t x = pixels_.x(pixel) + step_x(s), y = pixels_.y(pixel) + step_y(s);
        if (!pixels_.inside(x, y) || crosses_constraint(curve, pixel, x, y)) return;
        const float source = pixels_.disparity(pixel);
        const std::int32_t position = pixels_.position(x, y);

        // As in the paper, the disparity of the new pixel is the average over its neighbors. Its neighbor on each side is the
        // pixel of this surface that is free to be linked, if one exists. The new pixel inherits the origin of the neighbor
        // whose surface may still grow farthest.
        std::int32_t neighbors[4], origin = no_pixel;
        float sum = 0.0F, count = 0.0F, room = 0.0F;
        for (int i = 0; i < 4; ++i) {
            const side t = all_sides[i];
            const std::int32_t neighbor = t == opposite(s) ? pixel : free_neighbor(curve, x, y, t, source);
            neighbors[i] = neighbor;
            if (neighbor == no_pixel) continue;
            sum += pixels_.disparity(neighbor);
            count += 1.0F;
            const float room_there = room_beyond(pixels_.origin(neighbor), x, y, pixels_.disparity(neighbor));
            if (room_there >= room) room = room_there, origin = pixels_.origin(neighbor);
        }
        if (origin == no_pixel) return;

        if (ends_at_others(curve, pixel, s, position)) return;
        const float average = sum / count;
        if (average > pixels_.disparity(position) - min_hidden_step * surface_.max_step) return;
        if (lies_on_another(curve, position, average) || !may_link(average, source)) return;
        const std::int32_t made = pixels_.add(position, average, origin);
        if (!merges_curves_) curve_of_.push_back(curve);
        for (int i = 0; i < 4; ++i)
            if (neighbors[i] != no_pixel && may_link(pixels_.disparity(neighbors[i]), average))
                pixels_.link(made, all_sides[i], neighbors[i]);
        created_.push_back({curve, made});
    }

    // The first origin from which growth reaches a pixel is not always the one from which growth may continue farthest. If the
    // origin of `pixel` leaves more room beyond a hidden neighbor than the neighbor's own origin, the neighbor adopts this origin
    // and grows again.
    void improve_origin(std::size_t curve, std::int32_t pixel, std::int32_t neighbor) {
        const std::int32_t origin = pixels_.origin(pixel), before = pixels_.origin(neighbor);
        const std::int32_t x = pixels_.x(neighbor), y = pixels_.y(neighbor);
        const float disparity = pixels_.disparity(neighbor);
        if (before == origin || before == neighbor || crosses_constraint(curve, pixel, x, y)) return;
        if (room_beyond(origin, x, y, disparity) < room_beyond(before, x, y, disparity) + min_gain) return;
        pixels_.set_origin(neighbor, origin);
        created_.push_back({curve, neighbor});
    }

    // Joins surfaces at similar depth: links `pixel` to a pixel at `position` that has no neighbor on the side toward `pixel`.
    // Returns whether growth ends. It ends after a link, and at a hidden surface at similar depth to which no link is possible.
    bool ends_at_others(std::size_t curve, std::int32_t pixel, side s, std::int32_t position) {
        std::int32_t other = no_pixel;
        float nearest = max_joined_step * surface_.max_step;
        bool ends = false;
        for (std::int32_t there = position; there != no_pixel; there = pixels_.next_at_position(there)) {
            const float step = pixels_.disparity(there) - pixels_.disparity(pixel);
            if (std::abs(step) > (there == position ? surface_.max_step : nearest) || !may_meet(curve, there)) continue;
            if (pixels_.neighbor(there, opposite(s)) == no_pixel)
                other = there, nearest = std::abs(step);
            else if (there != position)
                ends = true;
        }
        if (other != no_pixel) pixels_.link(pixel, s, other);
        return ends || other != no_pixel;
    }

    // Whether a hidden surface at this position has this disparity, within the threshold, and the surface behind `curve` may
    // join it.
    bool lies_on_another(std::size_t curve, std::int32_t position, float disparity) const {
        for (std::int32_t there = pixels_.next_at_position(position); there != no_pixel; there = pixels_.next_at_position(there))
            if (surface_.same_surface(pixels_.disparity(there), disparity) && may_meet(curve, there)) return true;
        return false;
    }
    // Whether the surface behind a curve may join a pixel. It may join any pixel if curves merge, and otherwise only pixels of
    // the photo and hidden pixels behind the same curve.
    bool may_meet(std::size_t curve, std::int32_t pixel) const {
        const std::int32_t hidden = pixel - reach_.count();
        return merges_curves_ || hidden < 0 || curve_of_[hidden] == curve;
    }
    bool may_link(float a, float b) const { return std::abs(a - b) <= max_joined_step * surface_.max_step; }

    // Returns the remaining growth of the surface at `origin` beyond (x, y), in pixels; negative if it may not reach (x, y). The
    // camera uncovers more of a surface that recedes from `origin` to `disparity`, and less of one that approaches.
    float room_beyond(std::int32_t origin, std::int32_t x, std::int32_t y, float disparity) const {
        if (!(reach_[origin] > 0.0F)) return -1.0F;
        const float dx = nearest_float(x - pixels_.x(origin)), dy = nearest_float(y - pixels_.y(origin));
        const float receded = pixels_.disparity(origin) - disparity;
        return reach_[origin] + receded * parallax_ - std::sqrt(dx * dx + dy * dy);
    }

    // Returns the pixel next to (x, y) on side `s` that is free to be linked to (x, y) and is nearest in disparity to `source`;
    // no_pixel if none may be linked to `source`.
    std::int32_t free_neighbor(std::size_t curve, std::int32_t x, std::int32_t y, side s, float source) const {
        const std::int32_t u = x + step_x(s), v = y + step_y(s);
        if (!pixels_.inside(u, v)) return no_pixel;
        std::int32_t best = no_pixel;
        float best_difference = max_joined_step * surface_.max_step;
        for (std::int32_t there = pixels_.position(u, v); there != no_pixel; there = pixels_.next_at_position(there)) {
            const float difference = std::abs(pixels_.disparity(there) - source);
            if (difference > best_difference || pixels_.neighbor(there, opposite(s)) != no_pixel || !may_meet(curve, there))
                continue;
            best = there, best_difference = difference;
        }
        return best;
    }

    // Returns the disparity of the nearest front pixel along a curve. Considers only the part of the curve from which the hidden
    // surface reaches the given end.
    float nearest_front(const discontinuity_curve& curve, const growth_constraint& end, array_view<const float> disparity) const {
        float nearest = 0.0F;
        for (const discontinuity& d : curve.sides)
            if (distance_to(end, d.back) < reach_[d.back]) nearest = (std::max)(nearest, disparity[d.front]);
        return nearest;
    }
    float distance_to(const growth_constraint& end, std::int32_t pixel) const {
        return vector_length(nearest_float(pixels_.x(pixel)) + 0.5F - end.x, nearest_float(pixels_.y(pixel)) + 0.5F - end.y);
    }

    // Returns the maximum growth of the surface behind a curve at one of the curve's ends, in pixels.
    float reach_at(const discontinuity_curve& curve, const growth_constraint& end) const {
        float nearest = std::numeric_limits<float>::infinity(), reach = 0.0F;
        for (const discontinuity& d : curve.sides)
            if (const float distance = distance_to(end, d.back); distance < nearest) nearest = distance, reach = reach_[d.back];
        return reach;
    }

    // Whether the step from a pixel to (x, y) crosses the constraint at one of the curve's ends from inside. The constraint is a
    // line that starts at the curve's end and leads behind the front surface. Its length is the distance by which the surface
    // may grow at that end. A surface that grows farther from elsewhere may pass around the line. The line also extends 2
    // pixels in the opposite direction, a value tuned by experiment. The curve is on the inside of the line. Steps that start
    // on the outside are allowed: the surface came there from the other side of a narrow front, or around the line. Also
    // allowed are steps next to a hidden pixel of the same surface that is already outside, for example between the lines of
    // two curves.
    bool crosses_constraint(std::size_t curve, std::int32_t pixel, std::int32_t x, std::int32_t y) const {
        const buffer<growth_constraint>& constraints = curves_[curve].constraints;
        for (std::size_t i = 0; i < constraints.size(); ++i) {
            const growth_constraint& c = constraints[i];
            const float dx = nearest_float(x) + 0.5F - c.x, dy = nearest_float(y) + 0.5F - c.y;
            const float along = dx * c.perpendicular_x + dy * c.perpendicular_y;
            if (dx * c.outward_x + dy * c.outward_y <= 0.0F || along <= -2.0F || along >= constraint_lengths_[curve][i]) continue;
            const float from_x = nearest_float(pixels_.x(pixel)) + 0.5F - c.x;
            const float from_y = nearest_float(pixels_.y(pixel)) + 0.5F - c.y;
            if (from_x * c.outward_x + from_y * c.outward_y > 0.0F) continue;
            const auto meets = [&](side s) {
                return c.outward_x * nearest_float(step_x(s)) + c.outward_y * nearest_float(step_y(s)) > 0.0F &&
                       free_neighbor(curve, x, y, s, pixels_.disparity(pixel)) >= reach_.count();
            };
            if (std::none_of(std::begin(all_sides), std::end(all_sides), meets)) return true;
        }
        return false;
    }

    hidden_pixels pixels_;
    surface_rule surface_;
    std::span<const discontinuity_curve> curves_;
    bool merges_curves_;
    float parallax_ = 0.0F;                // maximum parallax, in pixels, for a disparity difference of 1
    buffer<front_pixel> front_, created_;  // pixels that the previous and the current iteration added, or gave another origin
    buffer<float> reach_;                  // per visible pixel: maximum growth of its surface from this pixel, in pixels
    buffer<float> farthest_;               // per curve: maximum of reach_ along it
    buffer<buffer<float>> constraint_lengths_;
    buffer<std::size_t> curve_of_;  // per hidden pixel: the curve that it grew behind; empty if curves merge
};

}}}  // namespace ldi::detail
