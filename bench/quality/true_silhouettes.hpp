// True silhouettes: the sides of pixels with a step in true depth. They are computed without the library's stages, because the
// results of these stages are compared with them.
#pragma once

#include "metrics.hpp"

#include <ldi/base/disjoint_sets.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ldi_quality {

/// Middle of a pixel's side, in half pixels: pixel (x, y) has its center at (2 x + 1, 2 y + 1).
struct side_middle {
    std::int32_t x = 0, y = 0;
};

/// A side between a pixel of a near surface and one of a far surface.
struct true_side {
    std::int32_t near_x, near_y, far_x, far_y;  ///< pixels
    bool colors_differ = false;                 ///< whether a viewer can see to which surface a pixel belongs

    side_middle middle() const { return {near_x + far_x + 1, near_y + far_y + 1}; }
};

struct true_silhouette_options {
    /// Minimum step in disparity, from 0 for the farthest to 1 for the nearest: the library's threshold for discontinuities.
    float min_step = 0.05F;
    /// Minimum number of connected sides.
    std::size_t min_sides = 20;
    /// Number of pixels on either side whose mean colors are compared. The two pixels at the side itself are left out, because
    /// their colors may be mixtures of both surfaces.
    std::int32_t color_reach = 3;
    /// Minimum difference of colors: root mean square over the channels, of 255.
    double min_color_difference = 25;
};

namespace detail {

/// Mean color of the pixels after (x, y) in direction (step_x, step_y), as long as they belong to its surface; the color of (x,
/// y) itself if none does.
inline std::array<double, 3> color_beyond(const picture& photo, const ldi::image<float>& disparity, std::int32_t x,
                                          std::int32_t y, std::int32_t step_x, std::int32_t step_y,
                                          const true_silhouette_options& options) {
    const auto inside = [&](std::int32_t u, std::int32_t v) {
        return u >= 0 && v >= 0 && static_cast<std::size_t>(u) < photo.width() && static_cast<std::size_t>(v) < photo.height();
    };
    std::array<double, 3> sum{};
    double count = 0;
    const auto add = [&](std::int32_t u, std::int32_t v) {
        for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(photo(v, u, c));
        count += 1;
    };
    for (std::int32_t k = 1; k <= options.color_reach; ++k) {
        const std::int32_t u = x + k * step_x, v = y + k * step_y;
        if (!inside(u, v) || std::abs(disparity(v, u) - disparity(y, x)) > options.min_step) break;
        add(u, v);
    }
    if (count == 0) add(x, y);
    for (double& value : sum) value /= count;
    return sum;
}

inline bool colors_differ(const picture& photo, const ldi::image<float>& disparity, const true_side& s,
                          const true_silhouette_options& options) {
    const std::int32_t step_x = s.near_x - s.far_x, step_y = s.near_y - s.far_y;
    const auto on_near = color_beyond(photo, disparity, s.near_x, s.near_y, step_x, step_y, options);
    const auto on_far = color_beyond(photo, disparity, s.far_x, s.far_y, -step_x, -step_y, options);
    double squared = 0;
    for (std::size_t c = 0; c < 3; ++c) squared += (on_near[c] - on_far[c]) * (on_near[c] - on_far[c]) / 3;
    return std::sqrt(squared) >= options.min_color_difference;
}

/// Keeps groups of at least `least` sides, connected corner to corner.
inline void drop_specks(std::vector<true_side>& sides, std::size_t height, std::size_t width, std::size_t least) {
    const auto corners = [&](const true_side& s) {
        const std::int32_t x = std::max(s.near_x, s.far_x), y = std::max(s.near_y, s.far_y);
        const std::int32_t stride = static_cast<std::int32_t>(width) + 1, first = y * stride + x;
        return std::pair{first, first + (s.near_y == s.far_y ? stride : 1)};
    };
    ldi::disjoint_sets sets((height + 1) * (width + 1));
    for (const true_side& s : sides) sets.merge(corners(s).first, corners(s).second);
    std::vector<std::size_t> count(sets.size(), 0);
    const auto set_of = [&](const true_side& s) { return static_cast<std::size_t>(sets.find(corners(s).first)); };
    for (const true_side& s : sides) ++count[set_of(s)];
    std::erase_if(sides, [&](const true_side& s) { return count[set_of(s)] < least; });
}

}  // namespace detail

/// Scales inverse depth to 0 for the farthest and 1 for the nearest pixel.
inline ldi::image<float> from_0_to_1(ldi::image<float> inverse_depth) {
    const auto [least, most] = std::minmax_element(inverse_depth.begin(), inverse_depth.end());
    const float low = *least, span = *most - *least;
    for (float& d : inverse_depth) d = span > 0 ? (d - low) / span : 0;
    return inverse_depth;
}

/// Finds the true silhouettes.
///
/// photo          H x W x 3
/// inverse_depth  H x W x 1, true
/// known          H x W x 1; silhouettes are not reported where it is 0, because depth was not measured
inline std::vector<true_side> true_silhouettes(const picture& photo, const ldi::image<float>& inverse_depth, const mask& known,
                                               const true_silhouette_options& options = {}) {
    const ldi::image<float> disparity = from_0_to_1(inverse_depth);
    const std::int32_t height = static_cast<std::int32_t>(photo.height()), width = static_cast<std::int32_t>(photo.width());
    std::vector<true_side> sides;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x)
            for (const auto& [u, v] : {std::pair{x + 1, y}, {x, y + 1}}) {
                if (u >= width || v >= height || known(y, x) == 0 || known(v, u) == 0) continue;
                const float step = disparity(y, x) - disparity(v, u);
                if (std::abs(step) <= options.min_step) continue;
                sides.push_back(step > 0 ? true_side{x, y, u, v} : true_side{u, v, x, y});
            }
    detail::drop_specks(sides, photo.height(), photo.width(), options.min_sides);
    for (true_side& s : sides) s.colors_differ = detail::colors_differ(photo, disparity, s, options);
    return sides;
}

/// Finds the nearest of a set of sides.
class nearest_side {
public:
    nearest_side(const std::vector<side_middle>& sides, std::size_t height, std::size_t width)
        : at_(2 * height + 1, 2 * width + 1, 1, std::int32_t{-1}) {
        for (std::size_t i = 0; i < sides.size(); ++i) at_(sides[i].y, sides[i].x) = static_cast<std::int32_t>(i);
    }

    /// Returns the distance between the middles in pixels, at most `farthest`, and the side's index, -1 if none is as close.
    std::pair<double, std::int32_t> find(const side_middle& from, std::int32_t farthest) const {
        std::int64_t best = std::int64_t{4} * farthest * farthest;
        std::int32_t found = -1;
        for (std::int64_t ring = 0; ring <= 2 * farthest && ring * ring <= best; ++ring)
            for (std::int64_t dy = -ring; dy <= ring; ++dy) {
                // Visits all columns in the top and bottom row of the ring, and only the two ends of the rows between.
                const std::int64_t step = std::abs(dy) == ring || ring == 0 ? 1 : 2 * ring;
                for (std::int64_t dx = -ring; dx <= ring; dx += step) {
                    const std::int64_t x = from.x + dx, y = from.y + dy, squared = dx * dx + dy * dy;
                    if (x < 0 || y < 0 || x >= static_cast<std::int64_t>(at_.width()) ||
                        y >= static_cast<std::int64_t>(at_.height()) || at_(y, x) < 0 || squared > best ||
                        (squared == best && found >= 0))
                        continue;
                    best = squared, found = at_(y, x);
                }
            }
        return {std::sqrt(static_cast<double>(best)) / 2, found};
    }

private:
    ldi::image<std::int32_t> at_;  ///< per half pixel: index of the side with this middle
};

}  // namespace ldi_quality
