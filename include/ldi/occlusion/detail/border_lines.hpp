// Measures the slopes of lines at a photo's border, and selects the pixels whose colors are repeated where surfaces continue past
// the border (occlusion/past_frame.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/occlusion/detail/photo_rim.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Measures the slope of the photo's lines at one side of its border. The slope is the number of steps along the border (down or
/// to the right) per step inward.
class border_lines {
public:
    /// color   K x 3
    /// inward  direction from this side into the photo
    /// rim     width of the rim at this side (detail/photo_rim.hpp)
    border_lines(const graph_view& g, array_view<const std::uint8_t> color, side inward, std::int32_t rim)
        : graph_(g),
          color_(color),
          rim_(rim),
          inward_(inward),
          along_(inward == side::left || inward == side::right ? side::down : side::right) {}

    /// Returns the slope at each border pixel of this side.
    ///
    /// pixels  border pixels of this side, ascending
    buffer<float> slopes(const buffer<std::int32_t>& pixels) const {
        buffer<float> result(pixels.size());
        buffer<sums> chain;
        buffer<std::size_t> members;  // indices in `pixels` of the chain: successive pixels of one surface
        for (std::size_t first = 0; first < pixels.size(); ++first) {
            if (graph_.neighbor(pixels[first], opposite(along_)) != no_pixel) continue;
            chain.clear(), members.clear();
            for (std::int32_t pixel = pixels[first]; pixel != no_pixel; pixel = graph_.neighbor(pixel, along_)) {
                members.push_back(
                    static_cast<std::size_t>(std::lower_bound(pixels.begin(), pixels.end(), pixel) - pixels.begin()));
                chain.push_back(gradients_inward_of(pixel));
            }
            smooth(chain), smooth(chain);
            for (std::size_t i = 0; i < members.size(); ++i) result[members[i]] = chain[i].slope();
        }
        return result;
    }

    /// Appends the source of each rim pixel, from the innermost pixel out to the border pixel `start`, then the source of each of
    /// the `count` pixels past the border. A pixel gets the color of its source. The sources mirror the photo: their path leads
    /// inward from the rim, along lines of the given slope, and turns back where the surface ends. Returns the number of rim
    /// pixels, or 0 if the surface ends within the rim.
    std::int32_t add_path(std::int32_t start, std::int32_t count, float slope, buffer<std::int32_t>& path) const {
        const std::int32_t inner = pixel_inside(start), rim = inner == no_pixel ? 0 : rim_;
        std::int32_t at = inner == no_pixel ? start : inner, shifted = 0;
        side direction = inward_;
        for (std::int32_t k = 0; k < rim + count; ++k) {
            if (k > 0) {
                const std::int32_t next = graph_.neighbor(at, direction);
                if (next == no_pixel) direction = opposite(direction);
                if (next != no_pixel) at = next;
            }
            const std::int32_t wanted = static_cast<std::int32_t>(std::lround(slope * nearest_float(2 * k + 1)));
            for (; shifted != wanted; shifted += shifted < wanted ? 1 : -1) {
                const std::int32_t next = graph_.neighbor(at, shifted < wanted ? along_ : opposite(along_));
                if (next != no_pixel) at = next;
            }
            path.push_back(at);
        }
        return rim;
    }

private:
    // These sizes, and the weights and the limit in slope(), were tuned by experiment.
    static constexpr int depth = 24;              // number of pixels measured inward from the border or the rim
    static constexpr std::ptrdiff_t radius = 16;  // of the window in smooth(), in pixels

    /// Sums of products of two gradients: inward, and along the border.
    struct sums {
        float inward_along = 0, along_along = 0, inward_inward = 0;

        /// Returns the slope m that minimizes the sum of (inward + m along)^2. Two terms in `squares` regularize m toward 0,
        /// because m is unreliable for noise and for lines nearly parallel to the border.
        float slope() const {
            const float squares = along_along + 0.1F * inward_inward + nearest_float(20 * depth);
            return std::clamp(-inward_along / squares, -1.5F, 1.5F);
        }
    };

    /// Returns the first pixel beyond the rim, going inward, or no_pixel if the surface ends within the rim.
    std::int32_t pixel_inside(std::int32_t pixel) const {
        for (std::int32_t k = 0; k < rim_ && pixel != no_pixel; ++k) pixel = graph_.neighbor(pixel, inward_);
        return pixel;
    }

    float brightness(std::int32_t pixel) const {
        const std::uint8_t* color = color_.data() + 3 * std::ptrdiff_t{pixel};
        return nearest_float(color[0] + 2 * color[1] + color[2]) * 0.25F;
    }

    sums gradients_inward_of(std::int32_t pixel) const {
        sums result;
        pixel = pixel_inside(pixel);
        for (int k = 0; k < depth && pixel != no_pixel; ++k) {
            const std::int32_t next = graph_.neighbor(pixel, inward_);
            if (next == no_pixel) break;
            const std::int32_t before = graph_.neighbor(next, opposite(along_)), after = graph_.neighbor(next, along_);
            const std::int32_t beyond = graph_.neighbor(next, inward_);
            if (before != no_pixel && after != no_pixel && beyond != no_pixel) {
                const float inward = brightness(beyond) - brightness(pixel), along = brightness(after) - brightness(before);
                result.inward_along += inward * along, result.along_along += along * along;
                result.inward_inward += inward * inward;
            }
            pixel = next;
        }
        return result;
    }

    /// Averages over a window along the border.
    static void smooth(buffer<sums>& chain) {
        const buffer<sums> from = chain;
        const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(chain.size());
        for (float sums::*value : {&sums::inward_along, &sums::along_along, &sums::inward_inward}) {
            double sum = 0;
            for (std::ptrdiff_t i = 0; i < (std::min)(radius, count); ++i) sum += double{from[i].*value};
            for (std::ptrdiff_t i = 0; i < count; ++i) {
                if (i + radius < count) sum += double{from[i + radius].*value};
                if (i > radius) sum -= double{from[i - radius - 1].*value};
                chain[i].*value = static_cast<float>(
                    sum / nearest_double((std::min)(i + radius + 1, count) - std::max<std::ptrdiff_t>(i - radius, 0)));
            }
        }
    }

    graph_view graph_;
    array_view<const std::uint8_t> color_;
    std::int32_t rim_;
    side inward_, along_;
};

/// One side of a photo's border, and the length and slope of each surface's continuation past it.
struct border_side {
    side inward;
    border_lines lines;
    buffer<std::int32_t> pixels = {};  ///< border pixels of this side, ascending
    buffer<std::int32_t> reach = {};   ///< for each pixel: number of steps by which its surface continues
    buffer<float> slopes = {};         ///< for each pixel: slope of the lines

    border_side(const graph_view& g, array_view<const std::uint8_t> color, array_view<const std::uint8_t> known,
                const buffer<pixel_run>& runs, side from)
        : inward(from), lines(g, color, from, rim_finder(g, color, known, runs).width(from)) {}

    std::size_t find(std::int32_t pixel) const {
        return static_cast<std::size_t>(std::lower_bound(pixels.begin(), pixels.end(), pixel) - pixels.begin());
    }
    /// Calls lines.add_path() with the slope at a border pixel.
    std::int32_t add_path(std::int32_t pixel, std::int32_t count, buffer<std::int32_t>& path) const {
        return lines.add_path(pixel, count, slopes[find(pixel)], path);
    }
    /// Sets `shown` to the pixels whose colors the continuation past a border pixel repeats, from the border outward.
    void find_shown(std::int32_t pixel, std::int32_t count, buffer<std::int32_t>& shown) const {
        shown.clear();
        if (count == 0) return;
        const std::int32_t rim = add_path(pixel, count, shown);
        shown.erase(shown.begin(), shown.begin() + rim);
    }
};

}}}  // namespace ldi::detail
