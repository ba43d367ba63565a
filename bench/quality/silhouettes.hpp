// Distance of a 3D photo's discontinuity curves from the true silhouettes, and the share of closed discontinuities.
#pragma once

#include "metrics.hpp"
#include "true_silhouettes.hpp"

#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/lift.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ldi_quality {

inline constexpr double compared_long_side = 1152;  ///< distances refer to photos with this longer side

struct silhouette_distance {
    double pixels = unmeasured;  ///< median distance from our sides to the nearest true sides, if these separate two colors
    double missed = unmeasured;  ///< share of the true sides between two colors that have none of our sides within 12 pixels
};

/// Returns the middles of all sides of the curves. `width` is the photo's width in pixels.
inline std::vector<side_middle> sides_of(std::span<const ldi::discontinuity_curve> curves, std::int32_t width) {
    std::vector<side_middle> result;
    for (const ldi::discontinuity_curve& curve : curves)
        for (const ldi::discontinuity& d : curve.sides)
            result.push_back({d.back % width + d.front % width + 1, d.back / width + d.front / width + 1});
    return result;
}

/// Measures distances in pixels of a photo with a longer side of 1152. Only silhouettes whose surfaces differ in color count,
/// because others are invisible. Distances are clamped to 32 pixels of the photo.
inline silhouette_distance distance_of_silhouettes(const std::vector<side_middle>& ours, const std::vector<true_side>& truth,
                                                   std::size_t height, std::size_t width) {
    constexpr std::int32_t farthest = 32;
    constexpr double met_within = 12;  // four samples of a 384-pixel map
    const double scale = compared_long_side / static_cast<double>(std::max(height, width));
    std::vector<side_middle> true_middles;
    for (const true_side& s : truth) true_middles.push_back(s.middle());
    const nearest_side nearest_true(true_middles, height, width), nearest_ours(ours, height, width);
    ldi::buffer<double> to_truth, missed;
    for (const side_middle& s : ours) {
        const auto [distance, found] = nearest_true.find(s, farthest);
        if (found >= 0 && truth[static_cast<std::size_t>(found)].colors_differ) to_truth.push_back(scale * distance);
    }
    for (const true_side& s : truth)
        if (s.colors_differ) missed.push_back(scale * nearest_ours.find(s.middle(), farthest).first > met_within ? 1 : 0);
    silhouette_distance result;
    if (!to_truth.empty()) result.pixels = median(to_truth);
    if (!missed.empty()) result.missed = mean(missed);
    return result;
}

/// Share of the sides with a step in cleaned disparity that are on no curve: close_spurious_discontinuities() links their pixels
/// again. 0 if there is no step.
///
/// photo      H x W x 3
/// disparity  H x W x 1, in [0, 1]
inline double share_closed(const picture& photo, const ldi::image<float>& disparity,
                           std::span<const ldi::discontinuity_curve> curves, ldi::surface_rule surface) {
    const ldi::photo_layer lifted = ldi::lift(photo, disparity, {.surface = surface});
    const ldi::graph& g = lifted.topology();
    double steps = 0, kept = 0;
    for (std::int32_t y = 0, pixel = 0; y < g.height(); ++y)
        for (std::int32_t x = 0; x < g.width(); ++x, ++pixel) {
            steps += x + 1 < g.width() && g.right()[pixel] == ldi::no_pixel ? 1 : 0;
            steps += y + 1 < g.height() && g.down()[pixel] == ldi::no_pixel ? 1 : 0;
        }
    for (const ldi::discontinuity_curve& curve : curves) kept += static_cast<double>(curve.sides.size());
    return steps > 0 ? 1 - kept / steps : 0;
}

}  // namespace ldi_quality
