// Studs: vertical polylines inside charts that carry the interior vertices (paper, section "Meshing", Figure "meshing" c).
//
// As in the paper, studs are distributed evenly between the left and right end of a chart, and the triangulation keeps their
// edges. This code differs in three ways. First, the vertices of a stud are not evenly spaced but lie where disparity bends:
// with even spacing, the error is several times as large for the same number of triangles. Second, extra vertices between the
// studs mark bends of disparity along evenly spaced rows. Without these vertices, upright shapes narrower than the distance
// between studs would be lost. They reduce the error by a quarter for the same number of vertices. Third, no vertex lies near
// the outline: the sweep that triangulates (triangulate.hpp) connects the first and last vertex of a stud to vertices of the
// outline, so outlines need no extra vertices.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/error.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/mesh/detail/boundary_walk.hpp>
#include <ldi/mesh/detail/mesh_checks.hpp>
#include <ldi/mesh/detail/stud_placer.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/stud_set.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Places the studs of all charts.
///
/// layers    in canonical order, with finite disparities
/// range     distances of surfaces at disparity 1 and 0; 0 < z_near <= z_far
/// charts    a partition of the pixels (make_charts)
/// outlines  outlines of these charts (trace_outlines)
///
/// Raises invalid_option for an option or a range out of bounds; mismatch if `layers` is a view whose graph violates an
/// invariant, or if the arguments don't fit together; invalid_data for disparities that are not finite; and too_large for a
/// bounding box above max_chart_box.
template <has_columns<disparity_column> Layers>
stud_set make_studs(const Layers& layers, const depth_range& range, const chart_set& charts, const chart_outlines& outlines,
                    const stud_options& options = {}) {
    const graph_view g = layers.topology();
    const array_view<const float> disparity = layers.template column<disparity_column>();
    check_topology(layers.topology(), "make_studs");
    check_charts(charts, g, "make_studs");
    detail::check_range(range, "make_studs");
    check_disparities(disparity, "make_studs");
    if (outlines.boundary_sides != detail::mark_boundary_sides(g, charts.chart_of) ||
        outlines.boundary_pixels != detail::pixels_with_boundary(outlines.boundary_sides))
        raise(error_code::mismatch, "make_studs", "outlines of these charts", "outlines of other charts");
    return detail::place_studs(g, disparity, range, charts, outlines, options);
}

}}  // namespace ldi
