// The stages of make_photo3d() (photo3d.hpp) from the photo to its cleaned depth.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/flakes.hpp>
#include <ldi/depth/level_dips.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/weighted_median.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/photo3d/options.hpp>
#include <ldi/photo3d/suppliers.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Shrinks a photo, H x W x 3, to a long side of at most `long_side` pixels; each side keeps at least one pixel. Copies a
/// smaller photo. Raises invalid_data for a photo without pixels.
template <executor Executor>
image<std::uint8_t> shrink_photo(image_view<const std::uint8_t> photo, std::size_t long_side, Executor& threads) {
    if (photo.empty())
        raise(error_code::invalid_data, "shrink_photo", "a photo with at least one pixel", detail::shape_text(photo));
    const std::size_t longer = (std::max)(photo.height(), photo.width());
    return area_resize(photo, shrunk_length(photo.height(), longer, long_side), shrunk_length(photo.width(), longer, long_side),
                       threads);
}

/// Resamples the estimate, h x w x 1, to the photo's resolution. If the estimate has a lower resolution than the photo, first
/// levels its dips, sharpens its edges, and filters it.
template <executor Executor>
image<float> resample_estimate(const image<float>& estimated, const image<std::uint8_t>& photo, const photo3d_options& options,
                               Executor& threads) {
    if (estimated.height() >= photo.height())
        return resample_to_photo(estimated, photo, options.surface, options.resample, threads);
    image<float> sharpened = sharpen_edges(level_dips(estimated, options.level), options.surface, options.sharpen, threads);
    for (int pass = 0; pass < options.passes_before_resampling; ++pass)
        sharpened = weighted_median(sharpened, options.surface, options.median, threads);
    return resample_to_photo(sharpened, photo, options.surface, options.resample, threads);
}

namespace detail {

inline void check_photo(image_view<const std::uint8_t> photo, std::size_t long_side) {
    if (photo.empty() || photo.channels() != 3)
        raise(error_code::invalid_data, "photo", "H x W x 3 values, at least one pixel", shape_text(photo));
    const std::size_t side = std::min<std::size_t>((std::max)(photo.height(), photo.width()), long_side);
    if (side > std::size_t{max_lattice_side})
        raise(error_code::too_large, "photo3d_options::long_side",
              "a photo with at most " + std::to_string(max_lattice_side) + " pixels per side after it is shrunk",
              std::to_string(side) + " pixels");
}

}  // namespace detail

/// A photo at the size of its layered image, and its depth.
struct cleaned_photo {
    image<std::uint8_t> photo;   ///< H x W x 3, long side at most options.long_side
    image<float> estimated;      ///< h x w x 1, disparity in [0, 1] at the estimator's resolution
    image<float> resampled;      ///< H x W x 1, the estimate at the photo's resolution, before filtering
    image<float> disparity;      ///< H x W x 1, cleaned disparity
    image<std::uint8_t> shares;  ///< H x W x 1 or empty: decided_depth::shares
    depth_range range;           ///< distances at disparity 1 and 0
};

/// Estimates and cleans the depth of a photo: the stages "depth estimation", "depth filter" and "connected components".
///
/// photo      H x W x 3, at least one pixel
/// estimator  source of the photo's depth; clean_depth() moves the map of a temporary given_disparity instead of copying it
/// decider    decides whether pixels beside a silhouette belong to the front or the back surface
///
/// Raises the errors of the stages. Before it estimates depth, raises invalid_data for a photo of any other shape, too_large for
/// a photo with a side above max_lattice_side after it is shrunk to long_side (without the margin of grow_past_frame()), and
/// invalid_option if long_side is 0, the focal length is not in [1, 1e5], max_sample_size is not in [1, 16],
/// passes_before_resampling is not in [0, 64], or the surface rule's step is not in [0.001, 1].
template <depth_estimator Estimator, silhouette_decider Decider, executor Executor = const serial_executor>
cleaned_photo clean_depth(image_view<const std::uint8_t> photo, Estimator&& estimator, const Decider& decider,
                          const photo3d_options& options = {}, Executor&& threads = {}) {
    const progress_listener& progress = options.progress;
    detail::check(options);
    detail::check_photo(photo, options.long_side);
    cleaned_photo result;
    progress.report("depth estimation", 0.0F);
    normalize_options normalize_with = options.normalize;
    normalize_with.relative_step =
        (std::max)(normalize_with.relative_step, static_cast<float>(estimator.quantization_step()) - 1.0F);
    normalized_disparity normalized =
        normalize(std::forward<Estimator>(estimator).disparity(photo, progress, threads), normalize_with);
    result.estimated = std::move(normalized.disparity);
    result.range = normalized.range;
    result.photo = shrink_photo(photo, options.long_side, threads);
    progress.report("depth estimation", 1.0F);

    progress.report("depth filter", 0.0F);
    result.resampled = resample_estimate(result.estimated, result.photo, options, threads);
    const float sample = sample_size(result.estimated, result.photo, options);
    decided_depth decided =
        decider.decide({result.photo, result.estimated,
                        weighted_median(result.resampled, options.surface, options.median, threads), options.surface, sample},
                       threads);
    result.disparity = std::move(decided.disparity), result.shares = std::move(decided.shares);
    progress.report("depth filter", 1.0F);

    progress.report("connected components", 0.0F);
    if (result.shares.empty())
        merge_middle_components(result.disparity, options.surface, scaled(options.components, sample));
    else
        merge_flakes(result.disparity, result.shares, options.surface, scaled(options.flakes, sample));
    progress.report("connected components", 1.0F);
    return result;
}
/// Same, with aligned_silhouettes as the decider.
template <depth_estimator Estimator, executor Executor = const serial_executor>
cleaned_photo clean_depth(image_view<const std::uint8_t> photo, Estimator&& estimator, const photo3d_options& options = {},
                          Executor&& threads = {}) {
    return clean_depth(photo, std::forward<Estimator>(estimator), aligned_silhouettes{options.alignment}, options, threads);
}

}}  // namespace ldi
