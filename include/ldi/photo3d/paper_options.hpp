// The options of the paper's experiments, without the stages that this library adds.
#pragma once

#include <ldi/occlusion/past_frame.hpp>
#include <ldi/photo3d/options.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Returns options with only the paper's numbers and stages, to reproduce the paper or to measure the effect of each addition.
/// The differences from the defaults:
///
/// - Surfaces grow by 50 pixels behind every silhouette (paper, "Occluded Surface Hallucination"), and end at the photo's border.
///   photo_facts::motion is then the largest motion without gaps, which for most photos is smaller than the default.
/// - Thresholds in pixels are not scaled, even if the depth map is coarser than the photo.
/// - The median filter runs once, at the photo's resolution.
/// - Depth edges are not sharpened, and silhouettes stay where the depth map has them.
/// - Colors beside silhouettes are not unmixed. A margin of the foreground, two pixels wide, is inpainted; the paper does not
///   state its width.
/// - Inpainted surfaces get no texture and no grain, and silhouettes are hard.
///
/// Three differences from the paper remain: short curves that join two junctions are kept (curve_options::min_length), surfaces
/// behind silhouettes join where their depth is similar (occlusion/expand.hpp), and a step of s in disparity grows the surface
/// behind it by at most s times the photo's long side. This limit is below 50 pixels only in small photos.
inline photo3d_options paper_options() {
    photo3d_options options;
    options.max_sample_size = 1.0F;
    options.passes_before_resampling = 0;
    options.sharpen.radius = 0;
    options.alignment.uncertainty = 0.0F;
    options.mixed_colors.background_margin = 0;
    options.mixed_colors.reach = 0.0F;
    options.expand.motion = 1.0F;
    options.expand.iterations = 50;
    options.expand.max_hidden = 5.0F;  // more hidden pixels per pixel of the photo than any photograph needs
    options.frame = photo_frame::crop;
    options.texture.strength = 0.0F;
    options.grain.strength = 0.0F;
    options.mesh.soft_edges.min_width = 0.0F;
    return options;
}

}}  // namespace ldi
