// Options of build_mesh() and of its parts.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/stud_set.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of soft edges (mesh/detail/soft_edges.hpp): silhouettes of foreground surfaces fade out over a strip. Widths are in
/// pixels, 0 to 64. build_mesh() reduces them to what the atlas's padding can color: (filter_padding + 0.5) / 1.5.
struct soft_edge_options {
    float min_width = 1.0F;  ///< minimum width of the strip; with 0, silhouettes have no strip and are hard
    float max_width = 3.0F;  ///< maximum width, used where the matte extends far
    /// Approximate maximum file size of the strip, as a fraction of the combined file size of mesh and texture. If this is not
    /// enough for all silhouette edges, only the edges with the largest steps in disparity have a strip. Infinity means no limit.
    float max_share = 0.08F;
};

/// Options of build_mesh() and build_flat_mesh().
struct mesh_options {
    simplify_options outlines;
    stud_options studs;
    soft_edge_options soft_edges;
};

}}  // namespace ldi
