// Converts a column of a layered image, which has a value per pixel, to values per vertex of its mesh, so that callers can
// export their own columns with the mesh.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/mesh/textured_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Up to four pixels of one surface around a corner of the lattice.
struct corner_pixels {
    std::array<std::int32_t, 4> pixels{};
    std::size_t count = 0;
};

/// Collects the pixels that share the corner (x, y): first `pixel` itself, then the pixels that are connected to it by links
/// around the corner. The result is empty if `pixel` does not touch the corner.
inline corner_pixels pixels_around_corner(const graph_view& g, std::int32_t pixel, float x, float y) {
    corner_pixels around;
    const auto add = [&](std::int32_t p) { around.pixels[around.count++] = p; };
    const float dx = x - nearest_float(g.x()[pixel]), dy = y - nearest_float(g.y()[pixel]);
    if (!(dx >= 0 && dx <= 1 && dy >= 0 && dy <= 1)) return around;  // also true for NaN
    add(pixel);
    const side across = dx == 1 ? side::right : side::left, along = dy == 1 ? side::down : side::up;
    const std::int32_t beside = g.neighbor(pixel, across), below = g.neighbor(pixel, along);
    if (beside != no_pixel) add(beside);
    if (below != no_pixel) add(below);
    std::int32_t opposite_pixel = beside == no_pixel ? no_pixel : g.neighbor(beside, along);
    if (opposite_pixel == no_pixel && below != no_pixel) opposite_pixel = g.neighbor(below, across);
    if (opposite_pixel != no_pixel) add(opposite_pixel);
    return around;
}

}  // namespace detail

/// Returns V x channels scalars. At each vertex, the column's `at_vertex` rule combines the values of the surrounding pixels of
/// the vertex's surface. The outer end of a hem has the values of its inner end.
///
/// mesh    result of build_mesh() for these layers
/// camera  camera of the photo (photo_facts::camera)
///
/// Raises mismatch if `layers` is a view whose graph violates an invariant, if the mesh refers to pixels outside the layers, or
/// if a vertex does not project to a corner of its pixel, because it was moved or belongs to another camera; and invalid_data
/// for hems with vertex indices outside the mesh. Time is linear.
template <payload_column Column, has_column<Column> Layers>
buffer<typename Column::scalar> gather(const textured_mesh& mesh, const Layers& layers, const pinhole_camera& camera) {
    using scalar = typename Column::scalar;
    check_topology(layers.topology(), "gather");
    const graph_view g = layers.topology();
    const pinhole_camera lattice{g.width(), g.height(), camera.focal_length};  // its width and height include photo_facts::margin
    if (mesh.pixels.size() != mesh.vertex_count())
        raise(error_code::mismatch, "gather", "a pixel for each of " + std::to_string(mesh.vertex_count()) + " vertices",
              std::to_string(mesh.pixels.size()) + " pixels");
    detail::check_hems(mesh);
    buffer<std::uint32_t> inner(mesh.pixels.size(), unset);  // per vertex: itself, or the inner end of its hem
    std::iota(inner.begin(), inner.end(), std::uint32_t{0});
    for (const hem_vertex& h : mesh.hem_vertices) inner[h.outer] = h.inner;
    buffer<scalar> result(mesh.pixels.size() * Column::channels, unset);
    for (std::size_t v = 0; v < mesh.pixels.size(); ++v) {
        if (mesh.pixels[v] < 0 || mesh.pixels[v] >= g.count())
            raise(error_code::mismatch, "gather", "pixel indices below " + std::to_string(g.size()) + " at the vertices",
                  "pixel " + std::to_string(mesh.pixels[v]));
        const float* position = mesh.positions.data() + 3 * std::size_t{inner[v]};
        const std::array<float, 2> seen = lattice.project({position[0], position[1], position[2]});
        const float x = std::round(seen[0]), y = std::round(seen[1]);
        const detail::corner_pixels around = detail::pixels_around_corner(g, mesh.pixels[v], x, y);
        constexpr float tolerance = 0.25F;  // pixels; far above the rounding errors of float positions
        if (around.count == 0 || std::abs(seen[0] - x) > tolerance || std::abs(seen[1] - y) > tolerance)
            raise(error_code::mismatch, "gather", "vertices at corners of their pixels, as this camera sees them",
                  "vertex " + std::to_string(v) + " at (" + detail::to_text(seen[0]) + ", " + detail::to_text(seen[1]) +
                      "), for pixel " + std::to_string(mesh.pixels[v]) + " at (" + std::to_string(g.x()[mesh.pixels[v]]) + ", " +
                      std::to_string(g.y()[mesh.pixels[v]]) + ")");
        std::array<scalar, 4 * Column::channels> values{};
        for (std::size_t i = 0; i < around.count && i < 4; ++i)  // count is at most 4; g++ 12 warns without the limit
            std::copy_n(layers.template at<Column>(around.pixels[i]).data(), Column::channels, &values[i * Column::channels]);
        const auto at_vertex = vertex_values<Column>({{values.data(), around.count * Column::channels}});
        std::copy(at_vertex.begin(), at_vertex.end(), result.data() + v * Column::channels);
    }
    return result;
}

}}  // namespace ldi
