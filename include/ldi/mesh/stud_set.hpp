// Studs of charts (mesh/studs.hpp), and the options for placing them.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/mesh/outlines.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of make_studs().
struct stud_options {
    /// Target distance between studs, and between the rows with single vertices, in pixels; at least 1. A smaller distance or
    /// disparity_tolerance results in more triangles and a smaller error. Both were tuned by experiment.
    std::int32_t spacing = 24;
    /// Maximum error of disparity interpolated between two vertices along a stud or row, at least 0.
    float disparity_tolerance = 0.006F;
    /// Minimum distance in pixels from a vertex to other charts and surfaces, and from a single vertex to a stud; 1 to 64. The
    /// clearance must be larger than the tolerance of outlines, so that studs stay away from simplified outlines.
    std::int32_t clearance = 4;
    /// Maximum shift of the texture over a triangle when it is drawn, in pixels, above 0 (depth_range::texture_shift). On slanted
    /// surfaces this moves studs and their vertices closer together, but not closer than twice the clearance.
    float texture_tolerance = 0.5F;
};

/// Studs of all charts. Single vertices are studs with one vertex.
struct stud_set {
    buffer<outline_corner> vertices;    ///< stud by stud, from top to bottom; corners between four pixels of one chart
    buffer<std::int32_t> first_vertex;  ///< stud s has vertices [first_vertex[s], first_vertex[s + 1]); one or more
    buffer<std::int32_t> first_stud;    ///< chart c has studs [first_stud[c], first_stud[c + 1])
};

}}  // namespace ldi
