// The result of the whole way from photo to 3D photo: one mesh with one texture.
#pragma once

#include <ldi/base/buffer.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION {

/// Translucent triangles along silhouettes, to be drawn after all others and in their order: from far to near. They hide nothing
/// behind them from each other (no depth is written). Space and texture as of the mesh that they belong to.
struct soft_edge_strip {
    buffer<float> positions;            ///< W x 3
    buffer<float> texture_coordinates;  ///< W x 2
    buffer<std::uint8_t> opacity;       ///< W, 0 to 255; 0 where nothing is left of the mesh
    buffer<std::uint32_t> triangles;    ///< G x 3 indices of these vertices, counter-clockwise seen from the photo's camera

    std::size_t vertex_count() const { return opacity.size(); }
};

/// V vertices, F triangles. Space and texture coordinates are glTF's.
struct textured_mesh {
    buffer<float> positions;            ///< V x 3; x right, y up, the photo's camera at the origin looking along -z
    buffer<float> texture_coordinates;  ///< V x 2, in [0, 1]; (0, 0) is the top left corner of the atlas
    buffer<std::int32_t> pixels;        ///< V; a pixel of the layered image that each vertex is a corner of or lies in
    buffer<std::uint32_t> triangles;    ///< F x 3 vertex indices, counter-clockwise seen from the photo's camera
    soft_edge_strip soft_edges = {};    ///< empty where edges are hard

    std::size_t vertex_count() const { return positions.size() / 3; }
    std::size_t triangle_count() const { return triangles.size() / 3; }
};

}  // namespace ldi
