// Converts a photo to a 3D photo: calls all stages of the paper (Kopf et al., "One Shot 3D Photography", SIGGRAPH 2020) in the
// paper's order. Additional stages sharpen depth edges (depth/sharpen_edges.hpp), align silhouettes with the photo's edges,
// unmix the colors beside silhouettes, add texture to hidden surfaces (inpaint/), continue surfaces past the photo's border
// (occlusion/past_frame.hpp), and soften silhouettes (mesh/detail/soft_edges.hpp). Each stage is a separate function in the
// headers below. Call these functions to run only some stages, or to insert your own.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/inpaint/grain.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/past_frame.hpp>
#include <ldi/photo3d/clean_depth.hpp>
#include <ldi/photo3d/lift_photo.hpp>
#include <ldi/photo3d/options.hpp>
#include <ldi/photo3d/suppliers.hpp>
#include <ldi/texture/atlas.hpp>

#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A 3D photo, and the results of all stages. `Own` lists the tags of the caller's own columns.
template <payload_column... Own>
struct basic_photo3d {
    image<std::uint8_t> photo;  ///< H x W x 3, at the size of the layered image without its margin
    image<float> estimated;     ///< h x w x 1, disparity in [0, 1] at the estimator's resolution
    image<float> resampled;     ///< H x W x 1, the estimate at the photo's resolution, before filtering
    image<float> disparity;     ///< H x W x 1, cleaned disparity
    buffer<discontinuity_curve> curves;
    /// Total number of pixel sides in the silhouettes that were dropped because of curve_options::max_density or max_sides.
    /// Across these sides, the mesh connects the front and the back surface. Usually 0 for photographs.
    std::size_t dropped_sides = 0;
    /// facts.motion is less than expand_options::motion if expand_options::iterations or max_hidden limited the hidden surfaces.
    photo_facts facts;
    layered_image<color_column, disparity_column, known_column, matte_column, Own...> layers;
    chart_set charts;
    texture_atlas atlas;
    textured_mesh mesh;
};
using photo3d = basic_photo3d<>;

/// Colors the hidden surfaces, adds texture and grain to them, and restores the colors of the rims.
///
/// layers     result of expand(), changed in place
/// rims       lifted_photo::rims of the same photo
/// inpainter  its result receives texture and grain; if it makes its own texture, set options.texture.strength and
///            options.grain.strength to 0
template <has_columns<color_column, disparity_column, known_column, rim_column> Layers, class Inpainter,
          executor Executor = const serial_executor>
void inpaint_hidden(Layers& layers, std::span<const uncertain_rim> rims, const Inpainter& inpainter,
                    const photo3d_options& options = {}, Executor&& threads = {}) {
    inpainter.inpaint(layers, options.progress, threads);
    add_texture(layers, options.texture, options.grain, threads);
    restore_rims(layers, rims, options.mixed_colors.contrast);
}

/// Makes a 3D photo from a photo with cleaned depth: runs the stages after clean_depth().
///
/// photo      result of clean_depth() with the same options
/// own        columns that accompany their pixels through all stages; gather() (mesh/gather.hpp) transfers them to the vertices
/// inpainter  its result receives texture and grain; if it makes its own texture, set options.texture.strength and
///            options.grain.strength to 0
///
/// Raises the same errors as the overload that accepts an estimator and a decider, except the errors of the estimator and the
/// decider.
template <color_inpainter Inpainter, payload_column... Own, executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(cleaned_photo photo, const photo_columns<Own...>& own, const Inpainter& inpainter,
                                   const photo3d_options& options = {}, Executor&& threads = {}) {
    const progress_listener& progress = options.progress;
    progress.report("occluded geometry", 0.0F);
    lifted_photo<Own...> lifted = lift_photo(photo, own, options, threads);
    if (!options.keeps_depth_maps) photo.estimated = {}, photo.resampled = {}, photo.disparity = {};
    basic_photo3d<Own...> result;
    result.photo = std::move(photo.photo), result.estimated = std::move(photo.estimated);
    result.resampled = std::move(photo.resampled), result.disparity = std::move(photo.disparity);
    result.curves = std::move(lifted.curves), result.dropped_sides = lifted.dropped_sides, result.facts = lifted.facts;
    auto [layers, motion] =
        expand(std::move(lifted.layer), options.surface, result.curves, options.expand, progress, nullptr, threads);
    result.facts.motion = motion;

    progress.report("color inpainting", 0.0F);
    inpaint_hidden(layers, lifted.rims, inpainter, options, threads);
    result.layers = decltype(result.layers)(std::move(layers));
    if (options.frame == photo_frame::grow) result.facts.margin = grow_past_frame(result.layers, result.facts, threads);
    progress.report("color inpainting", 1.0F);

    progress.report("chart generation", 0.0F);
    result.charts = make_charts(result.layers, options.surface, options.charts);
    progress.report("chart generation", 1.0F);

    progress.report("chart padding", 0.0F);
    result.atlas = make_atlas(result.layers, result.charts, options.atlas, threads);
    progress.report("chart padding", 1.0F);

    progress.report("meshing", 0.0F);
    result.mesh = build_mesh(result.layers, result.facts, result.charts, result.atlas, options.mesh, threads);
    progress.report("meshing", 1.0F);
    return result;
}

/// Converts a photo to a 3D photo.
///
/// photo           H x W x 3, at least one pixel
/// estimator       source of the photo's depth
/// decider         decides whether pixels beside a silhouette belong to the front or the back surface, such as
///                 aligned_silhouettes
/// own             columns that accompany their pixels through all stages; gather() (mesh/gather.hpp) transfers them to the
///                 vertices
/// inpainter       its result receives texture and grain; if it makes its own texture, set options.texture.strength and
///                 options.grain.strength to 0
///
/// Raises
/// - invalid_data for a photo without pixels or with a number of channels other than 3, for disparity that is not finite, and
///   for inverse depth below 0
/// - mismatch if an image of `own` or the estimator's map has no pixel or the wrong number of channels
/// - invalid_option for an option outside its range
/// - too_large for 2^31 pixels or more, for more than 65,535 pixels per side with the margin, and if the charts do not fit in
///   the atlas; a smaller options.long_side helps
/// - canceled if options.progress requests to stop
/// - the errors of the estimator, the decider and the inpainter.
///
/// Throws std::bad_alloc if memory is exhausted; without exceptions, raises out_of_memory.
///
/// Memory and time are bounded for any depth map: each stage documents its bound, and bench/photo3d/README.md lists measured
/// peaks.
template <depth_estimator Estimator, silhouette_decider Decider, color_inpainter Inpainter, payload_column... Own,
          executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(image_view<const std::uint8_t> photo, const photo_columns<Own...>& own,
                                   const Estimator& estimator, const Decider& decider, const Inpainter& inpainter,
                                   const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(clean_depth(photo, estimator, decider, options, threads), own, inpainter, options, threads);
}
/// Same, without the caller's own columns.
template <depth_estimator Estimator, silhouette_decider Decider, color_inpainter Inpainter,
          executor Executor = const serial_executor>
photo3d make_photo3d(image_view<const std::uint8_t> photo, const Estimator& estimator, const Decider& decider,
                     const Inpainter& inpainter, const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(photo, photo_columns<>(), estimator, decider, inpainter, options, threads);
}
/// Same, with aligned_silhouettes as the decider.
template <depth_estimator Estimator, color_inpainter Inpainter, payload_column... Own, executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(image_view<const std::uint8_t> photo, const photo_columns<Own...>& own,
                                   const Estimator& estimator, const Inpainter& inpainter, const photo3d_options& options = {},
                                   Executor&& threads = {}) {
    return make_photo3d(photo, own, estimator, aligned_silhouettes{options.alignment}, inpainter, options, threads);
}
/// Same, with aligned_silhouettes as the decider and without the caller's own columns.
template <depth_estimator Estimator, color_inpainter Inpainter, executor Executor = const serial_executor>
photo3d make_photo3d(image_view<const std::uint8_t> photo, const Estimator& estimator, const Inpainter& inpainter,
                     const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(photo, photo_columns<>(), estimator, inpainter, options, threads);
}

}}  // namespace ldi
