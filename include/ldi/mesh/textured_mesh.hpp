// The mesh of a 3D photo, with one or several textures.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Translucent triangles along silhouettes. Draw them after all other triangles, in the given order (far to near), and without
/// writing depth. Positions are in the space of the mesh, and texture coordinates refer to its first texture.
struct soft_edge_strip {
    buffer<float> positions;            ///< W x 3 for W vertices
    buffer<float> texture_coordinates;  ///< W x 2
    buffer<std::uint8_t> opacity;       ///< W, 0 to 255; 0 at the strip's outer end
    buffer<std::uint32_t> triangles;    ///< G x 3 indices of these vertices, counter-clockwise as seen from the photo's camera

    std::size_t vertex_count() const { return opacity.size(); }
};

/// Start of the vertices and triangles that use one of several textures. A part ends at the start of the next one.
struct mesh_part {
    std::size_t first_vertex = 0, first_triangle = 0;
};

/// A vertex at the outer end of a hem, and the outline vertex at its inner end. A hem is a strip that extends a hidden surface
/// behind a nearer one (build_mesh).
struct hem_vertex {
    std::uint32_t outer, inner;
};

/// A mesh with V vertices and F triangles. Space and texture coordinates follow glTF.
struct textured_mesh {
    /// V x 3, in the unit of depth_range; x right, y up. The photo's camera is at the origin and looks along -z.
    buffer<float> positions;
    buffer<float> texture_coordinates;  ///< V x 2, in [0, 1]; (0, 0) is the top left corner of the texture
    buffer<std::int32_t> pixels;        ///< V; a pixel with a corner at the vertex (outer end of a hem: at its inner end)
    buffer<std::uint32_t> triangles;    ///< F x 3 vertex indices, counter-clockwise as seen from the photo's camera
    soft_edge_strip soft_edges = {};    ///< empty if edges are hard
    /// Part t uses texture t. Parts share no vertices; a part may have no triangles. If empty, the whole mesh uses one texture.
    buffer<mesh_part> parts = {};
    buffer<hem_vertex> hem_vertices = {};  ///< all vertices at outer ends of hems

    std::size_t vertex_count() const { return positions.size() / 3; }
    std::size_t triangle_count() const { return triangles.size() / 3; }
    std::size_t part_count() const { return (std::max)(parts.size(), std::size_t{1}); }
    /// Returns part t for t < part_count(), and the end of the last part for t = part_count().
    mesh_part part(std::size_t t) const {
        if (t == part_count()) return {vertex_count(), triangle_count()};
        return parts.empty() ? mesh_part{} : parts[t];
    }
    /// Whether any triangle uses texture t.
    bool uses_texture(std::size_t t) const {
        return part(t).first_triangle < part(t + 1).first_triangle || (t == 0 && !soft_edges.triangles.empty());
    }
};

namespace detail {

/// Checks the vertices and triangles of a mesh or a strip of soft edges. Raises the same errors as check_mesh().
template <class Mesh>
void check_triangles(const Mesh& mesh) {
    const std::size_t count = mesh.vertex_count();
    if (mesh.positions.size() != 3 * count || mesh.texture_coordinates.size() != 2 * count || mesh.triangles.size() % 3 != 0)
        raise(error_code::mismatch, "mesh", "3 coordinates and 2 texture coordinates per vertex, 3 vertices per triangle",
              std::to_string(mesh.positions.size()) + ", " + std::to_string(mesh.texture_coordinates.size()) + " and " +
                  std::to_string(mesh.triangles.size()) + " numbers");
    for (const std::uint32_t vertex : mesh.triangles)
        if (vertex >= count)
            raise(error_code::invalid_data, "mesh", "vertex indices below " + std::to_string(count),
                  "vertex " + std::to_string(vertex));
    for (const buffer<float>* values : {&mesh.positions, &mesh.texture_coordinates})
        for (const float& value : *values)
            if (!std::isfinite(value))
                raise(error_code::invalid_data, "mesh", "finite coordinates",
                      to_text(value) + " at index " + std::to_string(&value - values->data()) + " of " +
                          (values == &mesh.positions ? "positions" : "texture_coordinates"));
}

/// Raises invalid_data if a hem refers to a vertex that the mesh lacks.
inline void check_hems(const textured_mesh& mesh) {
    for (const hem_vertex& h : mesh.hem_vertices)
        if ((std::max)(h.outer, h.inner) >= mesh.vertex_count())
            raise(error_code::invalid_data, "mesh", "vertex indices of hems below " + std::to_string(mesh.vertex_count()),
                  std::to_string(h.inner) + " and " + std::to_string(h.outer));
}

}  // namespace detail

/// Checks a mesh, for example after the caller changed it. Writers and renderers also call this function. Raises mismatch
/// unless the mesh has as many texture coordinates as vertices and uses `textures` textures. Raises invalid_data for
/// coordinates that are not finite, for indices out of range, and for parts that are not consecutive or that use vertices of
/// other parts. Time is linear.
///
/// textures  number of textures; pass mesh.part_count() to accept any number
inline void check_mesh(const textured_mesh& mesh, std::size_t textures) {
    detail::check_triangles(mesh);
    detail::check_triangles(mesh.soft_edges);
    detail::check_hems(mesh);
    if (mesh.part_count() != textures)
        raise(error_code::mismatch, "mesh", std::to_string(mesh.part_count()) + " textures", std::to_string(textures));
    for (std::size_t t = 0; t < mesh.part_count(); ++t) {
        const mesh_part first = mesh.part(t), last = mesh.part(t + 1);
        if (first.first_vertex > last.first_vertex || first.first_triangle > last.first_triangle ||
            last.first_vertex > mesh.vertex_count() || last.first_triangle > mesh.triangle_count() ||
            (t == 0 && (first.first_vertex != 0 || first.first_triangle != 0)))
            raise(error_code::invalid_data, "mesh", "consecutive parts of the mesh that start at vertex 0 and triangle 0",
                  "part " + std::to_string(t) + " from vertex " + std::to_string(first.first_vertex) + " to " +
                      std::to_string(last.first_vertex) + " and from triangle " + std::to_string(first.first_triangle) + " to " +
                      std::to_string(last.first_triangle));
        for (std::size_t i = 3 * first.first_triangle; i < 3 * last.first_triangle; ++i)
            if (mesh.triangles[i] < first.first_vertex || mesh.triangles[i] >= last.first_vertex)
                raise(error_code::invalid_data, "mesh", "triangles that use only vertices of their own part",
                      "vertex " + std::to_string(mesh.triangles[i]) + " in part " + std::to_string(t));
    }
}

}}  // namespace ldi
