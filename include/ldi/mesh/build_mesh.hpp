// Builds a textured triangle mesh from charts (paper, section "Meshing"): chart polygons are simplified and triangulated in 2D,
// then every vertex is lifted along its ray to its depth.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/mesh/detail/hems.hpp>
#include <ldi/mesh/detail/mesh_assembler.hpp>
#include <ldi/mesh/detail/mesh_checks.hpp>
#include <ldi/mesh/detail/pixel_stacks.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/mesh_options.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/texture/atlas.hpp>

#include <cmath>
#include <cstddef>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Builds the mesh of a layered image in the space of the photo's camera.
///
/// layers  in canonical order. Disparities above 1 count as 1. Negative disparities lie behind disparity 0, but their inverse
///         depth is clamped to at least 0.9 times that of disparity 0. Edges along silhouettes are soft if there is a matte
///         column. Where a hidden surface ends at a nearer one of similar depth, a strip extends the hidden surface behind the
///         nearer one, by at most as many pixels as the atlas's padding has texels. Cameras within facts.motion see almost no
///         gaps (bench/quality/README.md), unless a tolerance is larger or the padding smaller than its default
/// facts   the photo's camera (with a positive focal length), margin, range (0 < z_near <= z_far), surface rule (max_step at
///         least 0) and motion (finite, at least 0)
/// charts  a partition of the pixels (make_charts)
/// atlas   texture atlas of these charts
///
/// Raises invalid_option for options or facts out of range; mismatch if `layers` is a view whose graph violates an invariant,
/// if the inputs don't fit together, if there are charts but the atlas has no pixels, or if a chart lies outside the atlas;
/// invalid_data for disparities that are not finite; and too_large for a chart with a bounding box above max_chart_box.
///
/// Charts share no vertices, because each chart has its own position in the atlas. Where two charts meet, both have vertices
/// with bitwise equal positions, and the same edges between them. Time is linear, except for sorting, simplification, charts
/// with many edges across one scanline, and more than a few surfaces per position. The function allocates 2 to 30 bytes per
/// pixel, and up to 800 if most surfaces are single pixels.
template <has_columns<disparity_column> Layers, executor Executor = const serial_executor>
textured_mesh build_mesh(const Layers& layers, const photo_facts& facts, const chart_set& charts, const texture_atlas& atlas,
                         const mesh_options& options = {}, Executor&& threads = {}) {
    const auto& g = layers.topology();
    const pinhole_camera camera = facts.layers_camera();
    const buffer<chart_placement>& placements = atlas.placements;
    if (camera.width != g.width() || camera.height != g.height() || placements.size() != charts.charts.size())
        raise(error_code::mismatch, "build_mesh",
              "a camera of " + std::to_string(g.width()) + " x " + std::to_string(g.height()) + " and " +
                  std::to_string(charts.charts.size()) + " placements",
              std::to_string(camera.width) + " x " + std::to_string(camera.height) + " and " + std::to_string(placements.size()));
    if (!detail::is_positive(facts.camera.focal_length))
        raise(error_code::invalid_option, "photo_facts::camera", "a positive, finite focal length",
              detail::to_text(facts.camera.focal_length));
    if (!charts.charts.empty() && (atlas.color.empty() || atlas.filter_padding < 0 || atlas.filter_padding > max_filter_padding))
        raise(error_code::mismatch, "build_mesh",
              "an atlas with pixels and a padding of 0 to " + std::to_string(max_filter_padding),
              detail::shape_text(atlas.color) + " with a padding of " + std::to_string(atlas.filter_padding));
    const soft_edge_options& soft = options.soft_edges;
    if (!(soft.min_width >= 0 && soft.max_width >= soft.min_width && soft.max_width <= 64 && soft.max_share >= 0))
        raise(
            error_code::invalid_option, "soft_edge_options",
            "widths from 0 to 64 with min_width <= max_width, and a max_share of at least 0",
            detail::to_text(soft.min_width) + ", " + detail::to_text(soft.max_width) + " and " + detail::to_text(soft.max_share));
    if (!(facts.motion >= 0 && std::isfinite(facts.motion) && facts.surface.max_step >= 0))
        raise(error_code::invalid_option, "photo_facts", "a finite motion and a max_step, both at least 0",
              detail::to_text(facts.motion) + " and " + detail::to_text(facts.surface.max_step));
    const flat_mesh flat = build_flat_mesh(layers, facts.range, charts, options, threads);
    for (std::int32_t c = 0; c < charts.charts.count(); ++c) {
        const chart& shape = charts.charts[c];
        const std::int64_t right = std::int64_t{placements[c].x} + shape.width,
                           bottom = std::int64_t{placements[c].y} + shape.height;
        if (placements[c].x < 0 || placements[c].y < 0 || right > static_cast<std::int64_t>(atlas.color.width()) ||
            bottom > static_cast<std::int64_t>(atlas.color.height()))
            raise(error_code::mismatch, "build_mesh", "charts inside the atlas", "chart " + std::to_string(c) + " outside");
    }

    const detail::pixel_stacks stacks(g, layers.template column<disparity_column>());
    detail::mesh_assembler assembler(facts, flat, stacks, charts.chart_of,
                                     detail::hem_finder(flat, stacks, facts, atlas.filter_padding).find(), atlas);
    for (std::size_t c = 0; c < flat.charts.size(); ++c) assembler.add_chart(flat.charts[c], charts.charts[c], placements[c]);
    if constexpr (has_column<Layers, matte_column>)
        if (soft.min_width > 0) assembler.add_soft_edges(charts, atlas, layers.template column<matte_column>(), soft);
    return assembler.finish();
}

}}  // namespace ldi
