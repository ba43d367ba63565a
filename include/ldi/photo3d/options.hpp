// Options of make_photo3d() (photo3d.hpp).
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/align_silhouettes.hpp>
#include <ldi/depth/flakes.hpp>
#include <ldi/depth/level_dips.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/weighted_median.hpp>
#include <ldi/inpaint/grain.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/past_frame.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/sheets.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of make_photo3d() and its stages. Lengths and sizes in `alignment`, `components`, `flakes` and `curves` are in pixels,
/// for a depth map at the photo's resolution. If one depth sample covers several pixels, make_photo3d() multiplies lengths by
/// the sample's side and sizes by its area. Lengths in `curves` are only multiplied by 0.4 times the side if the
/// silhouette_decider returns shares. paper_options() (photo3d/paper_options.hpp) returns the options of the paper.
struct photo3d_options {
    /// Maximum long side in pixels, at least 1; a larger photo is shrunk to it.
    std::size_t long_side = 1536;
    /// 35 mm equivalent focal length of the photo in millimeters, 1 to 1e5. The default is a phone's main camera.
    float focal_length_35mm = 26.0F;
    /// Number of weighted median passes at the estimator's own resolution, 0 to 64, in addition to the pass at the photo's
    /// resolution. At the estimator's resolution, a blurred edge is only a few samples wide.
    int passes_before_resampling = 2;
    /// Maximum side of a depth sample in photo pixels, 1 to 16: the maximum factor by which lengths in `alignment`, `components`,
    /// `flakes` and `curves` are multiplied. Larger samples count as samples of this size, because they are too coarse to locate
    /// silhouettes. With 1, lengths and sizes are not scaled.
    float max_sample_size = 16.0F;
    surface_rule surface;
    normalize_options normalize;
    /// Leveling of dips, which joins pieces of the background beside objects. Off by default, because in 2 of 20 photographs,
    /// leveling opened holes of up to 11 pixels in views with a long side of 1000 pixels. Set it to level_options() for use
    /// with a network_decider (depth/network_decider.hpp), as the program does.
    level_options level{.radius = 0};
    sharpen_options sharpen;
    resample_options resample;
    weighted_median_options median;
    alignment_options alignment;
    middle_component_options components;  ///< used if the silhouette_decider returns no shares
    flake_options flakes;                 ///< used if the silhouette_decider returns shares
    mixed_color_options mixed_colors;
    curve_options curves;
    expand_options expand;
    /// Whether surfaces continue past the photo's border, as far as `expand.motion` uncovers them.
    photo_frame frame = photo_frame::grow;
    texture_options texture;
    grain_options grain;
    chart_options charts;
    atlas_options atlas;
    mesh_options mesh;
    /// Whether the result contains `estimated`, `resampled` and `disparity`. Without them, the conversion needs 8 bytes less per
    /// pixel, or 12 if the estimate is as large as the photo.
    bool keeps_depth_maps = true;
    /// Receives the progress of each stage under its name in the paper's table: "depth estimation", "depth filter", "connected
    /// components", "occluded geometry", "color inpainting", "chart generation", "chart padding", "meshing". Each stage begins
    /// with fraction 0 and ends with 1.
    progress_listener progress;
};

/// Returns the length of a side after the photo's longer side is shrunk to at most `long_side` pixels; at least 1.
///
/// length  0 to longer
/// longer  the photo's longer side in pixels, at least 1
inline std::size_t shrunk_length(std::size_t length, std::size_t longer, std::size_t long_side) {
    LDI_ASSERT(longer > 0);
    return std::max<std::size_t>((length * (std::min)(longer, long_side) + longer / 2) / longer, 1);
}

/// Returns the width that one depth sample covers, in photo pixels, clamped to [1, max_sample_size]. Returns 1 for an empty
/// map.
inline float sample_size(const image<float>& estimated, const image<std::uint8_t>& photo, const photo3d_options& options) {
    if (estimated.empty()) return 1.0F;
    return std::clamp(detail::nearest_float(photo.width()) / detail::nearest_float(estimated.width()), 1.0F,
                      options.max_sample_size);
}

namespace detail {
template <std::integral Count>
Count scaled(Count count, float by) {
    return static_cast<Count>(std::lround(nearest_float(count) * by));
}
}  // namespace detail

/// Converts lengths and pixel counts for a depth map at the photo's resolution to those for a map with larger samples.
inline middle_component_options scaled(middle_component_options options, float sample_size) {
    options.min_size = detail::scaled(options.min_size, sample_size * sample_size);
    return options;
}
inline flake_options scaled(flake_options options, float sample_size) {
    options.min_size = detail::scaled(options.min_size, sample_size * sample_size);
    options.min_width *= sample_size;
    return options;
}
inline curve_options scaled(curve_options options, float sample_size) {
    options.min_length = detail::scaled(options.min_length, sample_size);
    options.tangent_length = detail::scaled(options.tangent_length, sample_size);
    return options;
}

namespace detail {

/// Returns how far silhouettes may be from the photo's edges after alignment, in pixels; 0 for a depth map at the photo's
/// resolution.
inline int rim_width(const alignment_options& options, float sample_size) {
    return sample_size > 1.0F ? static_cast<int>(std::lround(options.uncertainty * sample_size)) : 0;
}

inline void check(const photo3d_options& options) {
    if (options.long_side == 0 || !(options.focal_length_35mm >= 1.0F && options.focal_length_35mm <= 1e5F))
        raise(error_code::invalid_option, "photo3d_options", "a long side of at least 1 and a focal length from 1 to 1e5",
              std::to_string(options.long_side) + " and " + to_text(options.focal_length_35mm));
    if (!(options.surface.max_step >= 0.001F && options.surface.max_step <= 1.0F))
        raise(error_code::invalid_option, "photo3d_options, surface", "a max_step from 0.001 to 1",
              to_text(options.surface.max_step));
    if (!(options.max_sample_size >= 1.0F && options.max_sample_size <= 16.0F))
        raise(error_code::invalid_option, "photo3d_options, max_sample_size", "1 to 16", to_text(options.max_sample_size));
    if (options.passes_before_resampling < 0 || options.passes_before_resampling > 64)
        raise(error_code::invalid_option, "photo3d_options, passes_before_resampling", "0 to 64",
              std::to_string(options.passes_before_resampling));
}

}  // namespace detail

/// Limits the size of charts so that all charts fit on full-size sheets (texture/sheets.hpp) for a photo of `photo_height` x
/// `photo_width` pixels. Raises too_large if the photo is too large for sheets, mismatch if it has no pixel or long_side is 0.
inline photo3d_options for_sheets(photo3d_options options, std::size_t photo_height, std::size_t photo_width,
                                  const sheet_options& sheets = {}) {
    if (photo_height == 0 || photo_width == 0 || options.long_side == 0)
        raise(error_code::mismatch, "for_sheets", "a photo with at least one pixel, and a long_side of at least 1",
              std::to_string(photo_height) + " x " + std::to_string(photo_width) + " pixels, long_side " +
                  std::to_string(options.long_side));
    const std::size_t longer = (std::max)(photo_height, photo_width);
    double scale = 1;
    for (const std::size_t length : {photo_height, photo_width})
        scale = (std::max)(
            scale, detail::nearest_double(length) / detail::nearest_double(shrunk_length(length, longer, options.long_side)));
    options.charts.max_side = (std::min)(options.charts.max_side, max_chart_side(scale, sheets));
    return options;
}

}}  // namespace ldi
