// Input and output of a silhouette_decider (photo3d/suppliers.hpp), and `aligned_silhouettes`, a decider without a network.
// network_decider.hpp defines the decider that uses a network.
#pragma once

#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/align_silhouettes.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A photo and its depth map, in which pixels beside silhouettes may still have a depth between the two surfaces. Input of a
/// silhouette_decider.
struct undecided_depth {
    image_view<const std::uint8_t> photo;  ///< H x W x 3
    image_view<const float> estimated;     ///< h x w x 1, disparity in [0, 1] at the estimator's resolution
    image<float> disparity;                ///< H x W x 1, sharpened, resampled and filtered
    surface_rule surface;
    float sample_size = 1.0F;  ///< side length of a sample of `estimated`, in photo pixels, 1 to 16
};

/// A depth map in which each pixel beside a silhouette is assigned to the front or the back surface. Result of a
/// silhouette_decider.
struct decided_depth {
    image<float> disparity;  ///< H x W x 1
    /// H x W x 1, or empty. The value is 0 for pixels that were not decided, otherwise 1 + 254 * (share of the front surface in
    /// the pixel). Pixels with a value of 128 or more belong to the front. If the image is not empty, clean_depth() merges flakes
    /// (depth/flakes.hpp) instead of middle components, and lift_photo() keeps shorter curves.
    image<std::uint8_t> shares;
};

/// Moves silhouettes onto the photo's edges with align_silhouettes(). Lengths in `options` are for a depth map with the photo's
/// resolution. For a coarser map, decide() multiplies them by the map's sample size, and limits the uncertainty to 256 pixels.
/// Raises invalid_option for a sample_size outside [1, 16], and the errors of align_silhouettes().
struct aligned_silhouettes {
    alignment_options options;

    template <executor Executor>
    decided_depth decide(undecided_depth depth, Executor&& threads) const {
        detail::check_sample_size(depth.sample_size);
        alignment_options scaled = options;
        constexpr float farthest = 256.0F;  // align_silhouettes() accepts no larger value
        if (options.uncertainty <= farthest) scaled.uncertainty = (std::min)(options.uncertainty * depth.sample_size, farthest);
        constexpr float longest = 0x1p40F;  // longer than any silhouette
        const float min_length = depth.sample_size * detail::nearest_float(scaled.min_length);
        scaled.min_length = static_cast<std::size_t>(detail::nearest_whole(double{(std::min)(min_length, longest)}));
        align_silhouettes(depth.disparity, depth.photo, depth.surface, scaled, threads);
        return {std::move(depth.disparity), {}};
    }
};

}}  // namespace ldi
