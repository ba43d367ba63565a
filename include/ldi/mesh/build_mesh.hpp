// From charts to a textured triangle mesh (paper, section "Meshing"): chart polygons are simplified and triangulated in 2D, then
// every vertex is lifted along its ray according to its disparity.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/charts/charts.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi {

/// Makes the mesh of a layered image.
///
/// g           in canonical order
/// disparity   K values; clamped to [0, 1]
/// charts      a partition of the pixels (make_charts)
/// placements  where each chart lies in the atlas, which has atlas_width x atlas_height texels
/// camera      that took the photo; its width and height are those of g
/// Raises invalid_option, and mismatch where inputs don't fit together.
///
/// Charts share no vertices, for they lie at different places of the atlas; but where they meet, both have vertices with the same
/// position, bit for bit, and the same edges between them.
template <executor Executor = const serial_executor>
textured_mesh build_mesh(const graph& g, std::span<const float> disparity, const chart_set& charts,
                         std::span<const chart_placement> placements, std::int32_t atlas_width, std::int32_t atlas_height,
                         const pinhole_camera& camera, const depth_range& range, const mesh_options& options = {},
                         Executor&& threads = {}) {
    if (camera.width != g.width || camera.height != g.height || placements.size() != charts.charts.size())
        raise(error_code::mismatch, "build_mesh",
              "a camera of " + std::to_string(g.width) + "x" + std::to_string(g.height) + " and " +
                  std::to_string(charts.charts.size()) + " placements",
              std::to_string(camera.width) + "x" + std::to_string(camera.height) + " and " + std::to_string(placements.size()));
    const flat_mesh flat = build_flat_mesh(g, disparity, charts, range, options, threads);

    std::size_t vertex_count = 0, index_count = 0;
    for (const chart_mesh& c : flat.charts) {
        vertex_count += c.outline.size() + static_cast<std::size_t>(c.stud_vertex_count);
        index_count += c.triangles.size();
    }
    textured_mesh mesh;
    mesh.positions.reserve(3 * vertex_count), mesh.texture_coordinates.reserve(2 * vertex_count),
        mesh.triangles.reserve(index_count);
    const float u_scale = 1.0F / static_cast<float>(atlas_width), v_scale = 1.0F / static_cast<float>(atlas_height);
    // A corner is lifted once and copied from then on, so that charts meet exactly whatever the compiler does with floats.
    buffer<std::int32_t> vertex_of_corner(flat.outlines.corners.size(), -1);
    for (std::size_t c = 0; c < flat.charts.size(); ++c) {
        const chart_mesh& source = flat.charts[c];
        const chart& shape = charts.charts[c];
        const std::uint32_t first_vertex = static_cast<std::uint32_t>(mesh.vertex_count());
        const auto add_position = [&](const outline_corner& corner) {
            const float d = std::clamp(corner.disparity, 0.0F, 1.0F);
            const std::array<float, 3> point =
                camera.unproject(static_cast<float>(corner.x), static_cast<float>(corner.y), range.depth(d));
            mesh.positions.insert(mesh.positions.end(), point.begin(), point.end());
        };
        const auto add_texture_coordinate = [&](const outline_corner& corner) {
            mesh.texture_coordinates.push_back(static_cast<float>(corner.x - shape.x + placements[c].x) * u_scale);
            mesh.texture_coordinates.push_back(static_cast<float>(corner.y - shape.y + placements[c].y) * v_scale);
        };
        for (std::int32_t id : source.outline) {
            const outline_corner& corner = flat.outlines.corners[id];
            std::int32_t& lifted = vertex_of_corner[id];
            if (lifted < 0) {
                lifted = static_cast<std::int32_t>(mesh.vertex_count());
                add_position(corner);
            } else {
                for (std::size_t i = 0; i < 3; ++i)
                    mesh.positions.push_back(mesh.positions[3 * static_cast<std::size_t>(lifted) + i]);
            }
            add_texture_coordinate(corner);
        }
        for (std::int32_t i = 0; i < source.stud_vertex_count; ++i) {
            const outline_corner& corner = flat.studs.vertices[source.first_stud_vertex + i];
            add_position(corner);
            add_texture_coordinate(corner);
        }
        for (std::uint32_t index : source.triangles) mesh.triangles.push_back(first_vertex + index);
    }
    return mesh;
}

}  // namespace ldi
