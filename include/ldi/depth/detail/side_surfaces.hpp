// Assigns each pixel of a step band to the front or the back surface, given the front surface's share of the pixel. Islands
// (groups of connected pixels on one side) that are small, or far from every curve, change sides. Pixels whose depth was blurred
// get the depth of nearby pixels of the same surface.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/depth/step_band.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class side_surfaces {
public:
    /// shares      K, in the units of decided_depth; 0 for pixels around the band, which do not change
    /// min_island  minimum number of pixels of an island; smaller ones that lie entirely in the band change to the other side
    side_surfaces(const step_band& band, buffer<std::uint8_t>& shares, std::int32_t min_island)
        : band_(band), shares_(shares), min_island_(min_island), in_front_(band.region.size(), unset) {}

    /// Writes the final disparities and shares of the pixels in the band.
    void apply(image<float>& disparity, image<std::uint8_t>& shares) {
        find_sides(disparity);
        flip_islands();
        carry_into_band(disparity);
        for_each_run([&](std::int32_t y, const pixel_region::run& run) {
            for (std::int32_t x = run.first, i = run.pixel; x < run.last; ++x, ++i)
                if (shares_[i] != 0) disparity(y, x) = values_[i], shares(y, x) = shares_[i];
        });
    }

private:
    /// Maximum distance, in pixel steps, over which disparity is copied from outside into the band.
    static constexpr std::size_t max_steps = 2 * step_band_radius;
    /// Tolerance for pixels that no disparity from outside the band reaches, as a share of the step. Such a pixel keeps its own
    /// disparity unless this disparity lies farther than the tolerance from the disparity of the pixel's side, toward the other
    /// side.
    static constexpr float tolerance = 0.2F;
    /// Maximum squared distance of an island from the nearest curve, in squared pixels. An island farther away is not part of a
    /// silhouette, and changes sides regardless of its size.
    static constexpr std::int32_t near_curve = 16;
    static constexpr std::uint8_t half = 128;

    /// A maximal sequence of adjacent pixels of a row on one side of the step.
    struct stretch {
        std::int32_t first, last, pixel;
    };

    template <class Visit>
    void for_each_run(Visit&& visit) const {
        for (std::int32_t y = 0; y < band_.region.height(); ++y)
            for (const pixel_region::run& run : band_.region.row(y)) visit(y, run);
    }

    void find_sides(const image<float>& disparity) {
        for_each_run([&](std::int32_t y, const pixel_region::run& run) {
            const float* const row = disparity.row(y);
            for (std::int32_t x = run.first, i = run.pixel; x < run.last; ++x, ++i)
                in_front_[i] = (shares_[i] != 0 ? shares_[i] >= half : band_.share(i, row[x]) > 0.5F) ? 1 : 0;
        });
    }

    void flip_islands() {
        buffer<stretch> stretches;
        disjoint_sets sets;
        for (std::int32_t y = 0, above = 0; y < band_.region.height(); ++y) {
            const std::int32_t row_start = stretches.count();
            for (const pixel_region::run& run : band_.region.row(y)) append_stretches(run, stretches, sets);
            for (std::int32_t here = row_start; above < row_start && here < stretches.count();) {
                const stretch &a = stretches[above], &b = stretches[here];
                if (in_front_[a.pixel] == in_front_[b.pixel] && (std::max)(a.first, b.first) < (std::min)(a.last, b.last))
                    sets.merge(above, here);
                const bool above_ends = a.last <= b.last, here_ends = b.last <= a.last;
                above += above_ends ? 1 : 0, here += here_ends ? 1 : 0;
            }
            above = row_start;
        }
        buffer<std::int32_t> sizes(stretches.size(), 0);  // number of pixels of each set
        buffer<std::uint8_t> is_near(stretches.size(), std::uint8_t{0}), leaves(stretches.size(), std::uint8_t{0});
        for (std::int32_t s = 0; s < stretches.count(); ++s) {
            const std::int32_t set = sets.find(s), last = end_of(stretches[s]);
            sizes[set] += last - stretches[s].pixel;
            for (std::int32_t i = stretches[s].pixel; i < last; ++i) {
                if (shares_[i] == 0) leaves[set] = 1;
                if (band_.squared_distances[i] <= near_curve) is_near[set] = 1;
            }
        }
        for (std::int32_t s = 0; s < stretches.count(); ++s) {
            const std::int32_t set = sets.find(s);
            if (leaves[set] != 0 || (sizes[set] >= min_island_ && is_near[set] != 0)) continue;
            const std::uint8_t flipped = in_front_[stretches[s].pixel] == 0 ? 1 : 0;
            for (std::int32_t i = stretches[s].pixel; i < end_of(stretches[s]); ++i)
                in_front_[i] = flipped, shares_[i] = flipped != 0 ? 255 : 1;
        }
    }
    static std::int32_t end_of(const stretch& s) { return s.pixel + (s.last - s.first); }

    void append_stretches(const pixel_region::run& run, buffer<stretch>& stretches, disjoint_sets& sets) const {
        for (std::int32_t x = run.first, end; x < run.last; x = end) {
            const std::int32_t pixel = run.pixel_at(x);
            for (end = x + 1; end < run.last && in_front_[run.pixel_at(end)] == in_front_[pixel];) ++end;
            stretches.push_back({x, end, pixel});
            sets.add();
        }
    }

    float side_value(std::int32_t i) const { return in_front_[i] != 0 ? band_.sides_of(i).front : band_.sides_of(i).back; }

    /// Copies disparities into the band, first from pixels outside the band. A pixel that no such disparity reaches keeps its
    /// own disparity if `tolerance` allows it. A second pass copies all disparities set so far to the remaining pixels on the
    /// same side, over any distance. Pixels that even this pass does not reach get the front or back disparity of the nearest
    /// curve pixel.
    void carry_into_band(const image<float>& disparity) {
        values_.resize(band_.region.size(), unset), is_open_.resize(band_.region.size(), unset);
        for_each_run([&](std::int32_t y, const pixel_region::run& run) {
            std::copy_n(disparity.row(y) + run.first, run.last - run.first, values_.begin() + run.pixel);
        });
        for (std::int32_t i = 0; i < values_.count(); ++i) is_open_[i] = shares_[i] != 0 ? 1 : 0;
        const neighbors beside(band_.region);
        carry(beside, max_steps);
        for (std::int32_t i = 0; i < values_.count(); ++i) {
            if (is_open_[i] == 0) continue;
            const float share = band_.share(i, values_[i]);
            const bool is_own = in_front_[i] != 0 ? share >= 1.0F - tolerance : share <= tolerance;
            if (is_own)
                is_open_[i] = 0;
            else
                values_[i] = side_value(i);
        }
        carry(beside, values_.size());
    }

    /// Neighbors of the region's pixels.
    class neighbors {
    public:
        explicit neighbors(const pixel_region& region)
            : below_(pixels_below(region)), above_(region.size(), no_pixel), is_first_(region.size() + 1, std::uint8_t{0}) {
            for (std::int32_t i = 0; i < below_.count(); ++i)
                if (below_[i] != no_pixel) above_[below_[i]] = i;
            is_first_.back() = 1;
            for (std::int32_t y = 0; y < region.height(); ++y)
                for (const pixel_region::run& run : region.row(y)) is_first_[run.pixel] = 1;
        }

        template <class Visit>
        void for_each(std::int32_t i, Visit&& visit) const {
            if (is_first_[i] == 0) visit(i - 1);
            if (is_first_[i + 1] == 0) visit(i + 1);
            if (above_[i] != no_pixel) visit(above_[i]);
            if (below_[i] != no_pixel) visit(below_[i]);
        }

    private:
        buffer<std::int32_t> below_, above_;
        buffer<std::uint8_t> is_first_;  // 1 for the first pixel of a run
    };

    /// Copies final values to adjacent open pixels (pixels without a final value) on the same side. Proceeds breadth-first for
    /// up to `reach` steps, so that each open pixel gets the value of the nearest pixel that is not open.
    void carry(const neighbors& beside, std::size_t reach) {
        buffer<std::int32_t> ring, next;
        const auto visit_open = [&](std::int32_t from) {
            beside.for_each(from, [&](std::int32_t n) {
                if (is_open_[n] == 0 || in_front_[n] != in_front_[from] || !fits(values_[from], n)) return;
                values_[n] = values_[from], is_open_[n] = 0;
                next.push_back(n);
            });
        };
        for (std::int32_t i = 0; i < values_.count(); ++i)
            if (is_open_[i] == 0) ring.push_back(i);
        for (std::size_t steps = 0; steps < reach && !ring.empty(); ++steps, ring.swap(next)) {
            next.clear();
            for (const std::int32_t i : ring) visit_open(i);
        }
    }

    /// Whether `value`, a neighbor's disparity, is plausible for pixel i, on i's side of the step. A neighbor that is nearer to
    /// another curve may belong to another surface. The accepted range extends beyond the step, because a blurred step may be
    /// wider than the disk in which its front and back are measured.
    bool fits(float value, std::int32_t i) const {
        constexpr float inward = 0.5F, outward = 3.0F;  // as multiples of the step in disparity
        const step_band::sides& s = band_.sides_of(i);
        const float step = s.front - s.back, beyond = in_front_[i] != 0 ? value - s.front : s.back - value;
        return beyond >= -inward * step && beyond <= outward * step;
    }

    const step_band& band_;
    buffer<std::uint8_t>& shares_;
    std::int32_t min_island_;
    buffer<std::uint8_t> in_front_, is_open_;
    buffer<float> values_;
};

}}}  // namespace ldi::detail
