// Moves the mesh of a layered image to the textures that texture/sheets.hpp draws: sorts vertices and triangles by texture, and
// converts the texture coordinates.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/sheet_layout.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Converts texture coordinates from the atlas to sheets.
class sheet_coordinates {
public:
    sheet_coordinates(const chart_set& charts, const texture_atlas& atlas, const sheet_layout& layout)
        : charts_(charts), atlas_(atlas), layout_(layout) {}

    /// Returns the texture coordinates of a vertex on its sheet. Charts that stay in the atlas keep their coordinates.
    ///
    /// chart  chart of the vertex
    /// u, v   coordinates in the atlas
    std::array<float, 2> moved(std::int32_t chart, float u, float v) const {
        const sheet_placement& place = layout_.placements[chart];
        if (place.sheet == 0) return {u, v};
        const ldi::chart& shape = charts_.charts[chart];
        const chart_placement from = atlas_.placements[chart];
        const rectangle_size size = layout_.sizes[place.sheet];
        const double x = double{u} * nearest_double(atlas_.color.width()) - from.x + shape.x;
        const double y = double{v} * nearest_double(atlas_.color.height()) - from.y + shape.y;
        return {on_sheet(layout_.across.in_photo(x) - place.photo_x, place.room.x, place.room.width, size.width),
                on_sheet(layout_.down.in_photo(y) - place.photo_y, place.room.y, place.room.height, size.height)};
    }

private:
    /// Returns a texture coordinate for an offset from the start of a chart's rectangle on the sheet. Clamps the offset,
    /// because hems may be wider than the padding inside the rectangle.
    static float on_sheet(double texels, std::int32_t room, std::int32_t room_length, std::int32_t length) {
        return static_cast<float>((room + std::clamp(texels, 0.0, nearest_double(room_length))) / length);
    }

    const chart_set& charts_;
    const texture_atlas& atlas_;
    const sheet_layout& layout_;
};

}  // namespace detail

/// Returns the mesh with texture coordinates on the sheets, one part per texture. Vertices and triangles of a part keep their
/// order.
///
/// mesh    result of build_mesh() for these charts and this atlas
/// layout  result of lay_out_sheets() for these charts and this atlas
///
/// Raises mismatch if the arguments don't fit together, and the errors of check_mesh().
inline textured_mesh move_to_sheets(const textured_mesh& mesh, const chart_set& charts, const texture_atlas& atlas,
                                    const sheet_layout& layout) {
    if (!mesh.parts.empty() || mesh.pixels.size() != mesh.vertex_count() || atlas.placements.size() != charts.charts.size() ||
        layout.placements.size() != charts.charts.size() || layout.sizes.empty())
        raise(error_code::mismatch, "move_to_sheets",
              "a mesh without parts, a pixel per vertex, and " + std::to_string(charts.charts.size()) +
                  " charts in the atlas and the layout",
              std::to_string(mesh.parts.size()) + " parts, " + std::to_string(mesh.vertex_count()) + " vertices, " +
                  std::to_string(mesh.pixels.size()) + " pixels, " + std::to_string(atlas.placements.size()) +
                  " charts in the atlas, and " + std::to_string(layout.placements.size()) + " on " +
                  std::to_string(layout.sizes.size()) + " textures");
    check_mesh(mesh, 1);
    for (const std::int32_t pixel : mesh.pixels) {
        if (pixel < 0 || pixel >= charts.chart_of.count())
            raise(error_code::mismatch, "move_to_sheets", "pixel indices below " + std::to_string(charts.chart_of.size()),
                  std::to_string(pixel));
        if (charts.chart_of[pixel] < 0 || charts.chart_of[pixel] >= charts.charts.count())
            raise(error_code::mismatch, "move_to_sheets", "chart indices below " + std::to_string(charts.charts.size()),
                  std::to_string(charts.chart_of[pixel]));
    }
    for (const auto& placement : layout.placements)
        if (static_cast<std::size_t>(placement.sheet) >= layout.sizes.size())
            raise(error_code::mismatch, "move_to_sheets", "sheet indices below " + std::to_string(layout.sizes.size()),
                  std::to_string(placement.sheet));
    const detail::sheet_coordinates coordinates(charts, atlas, layout);
    const auto chart_of = [&](std::size_t vertex) { return charts.chart_of[mesh.pixels[vertex]]; };
    const auto sheet_of = [&](std::size_t vertex) { return static_cast<std::size_t>(layout.placements[chart_of(vertex)].sheet); };

    // Counting sort by sheet: `next` contains the indices of each sheet's next vertex and next triangle.
    buffer<mesh_part> next(layout.sizes.size() + 1);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) ++next[sheet_of(v) + 1].first_vertex;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) ++next[sheet_of(mesh.triangles[i]) + 1].first_triangle;
    for (std::size_t s = 1; s < next.size(); ++s) {
        next[s].first_vertex += next[s - 1].first_vertex;
        next[s].first_triangle += next[s - 1].first_triangle;
    }
    textured_mesh moved;
    moved.parts.assign(next.begin(), next.end() - 1);
    moved.positions.resize(mesh.positions.size(), unset);
    moved.texture_coordinates.resize(mesh.texture_coordinates.size(), unset);
    moved.pixels.resize(mesh.pixels.size(), unset);
    moved.triangles.resize(mesh.triangles.size(), unset);
    buffer<std::uint32_t> place(mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        const std::size_t to = next[sheet_of(v)].first_vertex++;
        place[v] = static_cast<std::uint32_t>(to);
        std::copy_n(mesh.positions.data() + 3 * v, 3, moved.positions.data() + 3 * to);
        const std::array<float, 2> uv =
            coordinates.moved(chart_of(v), mesh.texture_coordinates[2 * v], mesh.texture_coordinates[2 * v + 1]);
        std::copy_n(uv.data(), 2, moved.texture_coordinates.data() + 2 * to);
        moved.pixels[to] = mesh.pixels[v];
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
        const std::size_t to = 3 * next[sheet_of(mesh.triangles[i])].first_triangle++;
        for (std::size_t k = 0; k < 3; ++k) moved.triangles[to + k] = place[mesh.triangles[i + k]];
    }
    moved.soft_edges = mesh.soft_edges;
    for (const hem_vertex& h : mesh.hem_vertices) moved.hem_vertices.push_back({place[h.outer], place[h.inner]});
    return moved;
}

}}  // namespace ldi
