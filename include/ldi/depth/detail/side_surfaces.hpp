// From the share of the front at each pixel of a band to two surfaces: islands change sides, and depth that a blurred step
// spoiled is carried over from pixels of the same surface.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/depth/step_band.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class side_surfaces {
public:
    /// shares  K, as in decided_depth; 0 for pixels around the band, which stay as they are
    side_surfaces(const step_band& band, buffer<std::uint8_t>& shares)
        : band_(band), shares_(shares), in_front_(band.region.size(), unset) {}

    /// Changes the disparity in the band, and writes the shares there.
    void apply(image<float>& disparity, image<std::uint8_t>& shares) {
        find_sides(disparity);
        flip_islands();
        load(disparity);
        carry();
        for_each_run([&](std::int32_t y, const pixel_region::run& run) {
            for (std::int32_t x = run.first, i = run.pixel; x < run.last; ++x, ++i)
                if (shares_[i] != 0) disparity(y, x) = values_[i], shares(y, x) = shares_[i];
        });
    }

private:
    /// Connected pixels of one side, fewer than this and all of them in the band, belong to the other side.
    static constexpr std::int32_t min_island = 24;
    /// A pixel whose own disparity is this near to its side, as a share of the step, keeps it.
    static constexpr float tolerance = 0.2F;
    static constexpr std::uint8_t half = 128;

    /// Pixels of a row and of one side, side by side.
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
        buffer<std::int32_t> sizes(stretches.size(), 0);  // of each set; those that leave the band count as large
        for (std::int32_t s = 0; s < stretches.count(); ++s) {
            std::int32_t& size = sizes[sets.find(s)];
            const stretch& of = stretches[s];
            const std::uint8_t* const first = shares_.data() + of.pixel;
            const bool leaves = std::find(first, first + (of.last - of.first), std::uint8_t{0}) != first + (of.last - of.first);
            size = (std::min)(size + (leaves ? min_island : of.last - of.first), min_island);
        }
        for (std::int32_t s = 0; s < stretches.count(); ++s) {
            if (sizes[sets.find(s)] >= min_island) continue;
            const stretch& of = stretches[s];
            const std::uint8_t flipped = in_front_[of.pixel] == 0 ? 1 : 0;
            for (std::int32_t i = of.pixel; i < of.pixel + (of.last - of.first); ++i)
                in_front_[i] = flipped, shares_[i] = flipped != 0 ? 255 : 1;
        }
    }

    void append_stretches(const pixel_region::run& run, buffer<stretch>& stretches, disjoint_sets& sets) const {
        for (std::int32_t x = run.first, end; x < run.last; x = end) {
            const std::int32_t pixel = run.pixel_at(x);
            for (end = x + 1; end < run.last && in_front_[run.pixel_at(end)] == in_front_[pixel];) ++end;
            stretches.push_back({x, end, pixel});
            sets.add();
        }
    }

    float side_value(std::int32_t i) const { return in_front_[i] != 0 ? band_.sides_of(i).front : band_.sides_of(i).back; }

    /// Finds the pixels that keep their own disparity. Others have that of their curve's side until one is carried to them.
    void load(const image<float>& disparity) {
        values_.resize(band_.region.size(), unset), is_open_.resize(band_.region.size(), unset);
        for_each_run([&](std::int32_t y, const pixel_region::run& run) {
            const float* const row = disparity.row(y);
            for (std::int32_t x = run.first, i = run.pixel; x < run.last; ++x, ++i) {
                const float share = band_.share(i, row[x]);
                const bool is_own = in_front_[i] != 0 ? share >= 1.0F - tolerance : share <= tolerance;
                is_open_[i] = is_own ? 0 : 1;
                values_[i] = is_own ? row[x] : side_value(i);
            }
        });
    }

    /// Breadth first over pixels of one side, so that each takes a value from the nearest.
    void carry() {
        const buffer<std::int32_t> below = pixels_below(band_.region);
        buffer<std::int32_t> above(below.size(), no_pixel), queue;
        for (std::int32_t i = 0; i < below.count(); ++i)
            if (below[i] != no_pixel) above[below[i]] = i;
        buffer<std::uint8_t> is_first(below.size() + 1, std::uint8_t{0});  // of its run
        is_first.back() = 1;
        for_each_run([&](std::int32_t, const pixel_region::run& run) { is_first[run.pixel] = 1; });
        const auto for_each_neighbor = [&](std::int32_t i, auto&& visit) {
            if (is_first[i] == 0) visit(i - 1);
            if (is_first[i + 1] == 0) visit(i + 1);
            if (above[i] != no_pixel) visit(above[i]);
            if (below[i] != no_pixel) visit(below[i]);
        };
        for (std::int32_t i = 0; i < below.count(); ++i) {
            if (is_open_[i] != 0) continue;
            bool borders = false;
            for_each_neighbor(i, [&](std::int32_t n) { borders = borders || is_open_[n] != 0; });
            if (borders) queue.push_back(i);
        }
        for (std::size_t q = 0; q < queue.size(); ++q) {
            const std::int32_t from = queue[q];
            for_each_neighbor(from, [&](std::int32_t n) {
                if (is_open_[n] == 0 || in_front_[n] != in_front_[from] || !fits(values_[from], n)) return;
                values_[n] = values_[from], is_open_[n] = 0;
                queue.push_back(n);
            });
        }
    }

    /// Whether a disparity is on a pixel's side of its step: next to another curve, that side may be another surface.
    bool fits(float value, std::int32_t i) const {
        const step_band::sides& s = band_.sides_of(i);
        return std::abs(value - side_value(i)) <= 0.5F * (s.front - s.back);
    }

    const step_band& band_;
    buffer<std::uint8_t>& shares_;
    buffer<std::uint8_t> in_front_, is_open_;
    buffer<float> values_;
};

}}}  // namespace ldi::detail
