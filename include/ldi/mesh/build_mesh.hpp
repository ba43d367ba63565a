// Builds a textured triangle mesh from charts (paper, section "Meshing"): chart polygons are simplified and triangulated in 2D,
// then every vertex is lifted along its ray to its depth.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/mesh/detail/hems.hpp>
#include <ldi/mesh/detail/soft_edges.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/texture/atlas.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Finds the pixel of a chart that touches a lattice corner, which is a point between pixels.
class pixel_finder {
public:
    /// chart_of  chart of each pixel (chart_set::chart_of)
    pixel_finder(const graph_view& g, array_view<const float> disparity, array_view<const std::int32_t> chart_of)
        : graph_(g), disparity_(disparity), chart_of_(chart_of), shown_(g.position_count(), no_pixel) {}

    /// Index of the selected chart; -1 if it has no pixels.
    std::int32_t shown_chart() const { return chart_; }

    /// Selects the chart to search.
    void show(const chart& c) {
        for (const std::int32_t pixel : c.pixels) shown_[graph_.position_of(pixel)] = pixel;
        chart_ = c.pixels.empty() ? -1 : chart_of_[c.pixels.front()];
    }

    /// Returns the pixel of the selected chart that touches corner (x, y). If several do, returns the one whose disparity is
    /// closest to `disparity`; if none does, returns no_pixel.
    std::int32_t find(std::int32_t x, std::int32_t y, float disparity) const {
        std::int32_t best = no_pixel;
        float best_difference = 0;
        for (std::int32_t v = std::max<std::int32_t>(y - 1, 0); v <= std::min<std::int32_t>(y, graph_.height() - 1); ++v)
            for (std::int32_t u = std::max<std::int32_t>(x - 1, 0); u <= std::min<std::int32_t>(x, graph_.width() - 1); ++u) {
                const std::int32_t pixel = shown_[graph_.position(u, v)];
                if (pixel == no_pixel || chart_of_[pixel] != chart_) continue;
                const float difference = std::abs(disparity_[pixel] - disparity);
                if (best == no_pixel || difference < best_difference) best = pixel, best_difference = difference;
            }
        return best;
    }

private:
    graph_view graph_;
    array_view<const float> disparity_;
    array_view<const std::int32_t> chart_of_;
    std::int32_t chart_ = -1;
    buffer<std::int32_t> shown_;  // per position: its pixel in the most recently selected chart that covers it
};

inline void check_facts(const photo_facts& facts) {
    const auto is_positive = [](float value) { return value > 0 && std::isfinite(value); };
    if (!is_positive(facts.camera.focal_length))
        raise(error_code::invalid_option, "photo_facts::camera", "a positive, finite focal length",
              to_text(facts.camera.focal_length));
    if (!is_positive(facts.range.z_near) || !is_positive(facts.range.z_far) || facts.range.z_near > facts.range.z_far)
        raise(error_code::invalid_option, "photo_facts::range", "finite distances with 0 < z_near <= z_far",
              to_text(facts.range.z_near) + " and " + to_text(facts.range.z_far));
}

/// Lifts the vertices of all charts and appends the charts to one mesh.
class mesh_assembler {
public:
    /// hems  result of hem_finder::find(): one per entry of flat_mesh::open_corners
    mesh_assembler(const photo_facts& facts, const flat_mesh& flat, buffer<hem> hems, const texture_atlas& atlas)
        : facts_(facts),
          camera_(facts.layers_camera()),
          flat_(flat),
          hems_(std::move(hems)),
          u_scale_(1.0F / nearest_float(atlas.color.width())),
          v_scale_(1.0F / nearest_float(atlas.color.height())),
          first_coordinate_(flat.outlines.corners.size(), -1),
          vertex_of_(flat.outlines.corners.size(), 0) {
        for (std::int32_t p = 0; p < flat.outlines.pieces.count(); ++p) {
            const auto first = hems_.begin() + flat.first_open_corner[p], last = hems_.begin() + flat.first_open_corner[p + 1];
            if (!std::all_of(first, last, [](const hem& h) { return h.is_empty(); })) hemmed_pieces_.push_back(p);
        }
        stable_sort(hemmed_pieces_, [&](std::int32_t a, std::int32_t b) { return chart_of(a) < chart_of(b); });
        std::size_t vertex_count = 0, index_count = 0;
        for (const chart_mesh& c : flat.charts) {
            vertex_count += c.outline.size() + static_cast<std::size_t>(c.stud_vertex_count);
            index_count += c.triangles.size();
        }
        mesh_.positions.reserve(3 * vertex_count), mesh_.texture_coordinates.reserve(2 * vertex_count);
        mesh_.pixels.reserve(vertex_count), mesh_.triangles.reserve(index_count);
    }

    void add_chart(const chart_mesh& source, const chart& shape, const chart_placement& place, pixel_finder& finder) {
        finder.show(shape);
        const std::uint32_t first_vertex = static_cast<std::uint32_t>(mesh_.vertex_count());
        const std::array<std::int32_t, 2> to_atlas{place.x - shape.x, place.y - shape.y};
        for (std::int32_t id : source.outline) {
            vertex_of_[id] = static_cast<std::uint32_t>(mesh_.vertex_count());
            add_outline_position(id);
            add_texture(flat_.outlines.corners[id], to_atlas, finder);
        }
        for (std::int32_t i = 0; i < source.stud_vertex_count; ++i) {
            const outline_corner& corner = flat_.studs.vertices[source.first_stud_vertex + i];
            add_position(corner);
            add_texture(corner, to_atlas, finder);
        }
        for (std::uint32_t index : source.triangles) mesh_.triangles.push_back(first_vertex + index);
        add_hems(to_atlas, finder);
    }

    void add_soft_edges(const chart_set& charts, const texture_atlas& atlas, const visible_surfaces& seen,
                        const soft_edge_options& options) {
        // Sizes in GLB files, in bytes. `texel_bytes` is the size of a texel in smooth areas with JPEG at quality 85.
        // `edge_bytes` is the size that the strip adds per edge.
        constexpr float vertex_bytes = 16, triangle_bytes = 6, texel_bytes = 0.06F, edge_bytes = 56;
        const float bytes = vertex_bytes * nearest_float(mesh_.vertex_count()) +
                            triangle_bytes * nearest_float(mesh_.triangle_count()) +
                            texel_bytes * nearest_float(atlas.color.size() / 3);
        soft_edge_builder builder(flat_, seen, facts_.surface, camera_, facts_.range, options);
        builder.choose(static_cast<std::size_t>(options.max_share * bytes / edge_bytes));
        for (std::int32_t p = 0; p < flat_.outlines.pieces.count(); ++p) {
            const std::int32_t c = flat_.outlines.pieces[p].right_chart;
            const std::array<std::int32_t, 2> to_atlas{atlas.placements[c].x - charts.charts[c].x,
                                                       atlas.placements[c].y - charts.charts[c].y};
            builder.add_piece(p, to_atlas, {u_scale_, v_scale_});
        }
        mesh_.soft_edges = builder.finish();
    }

    textured_mesh finish() { return std::move(mesh_); }

private:
    std::int32_t chart_of(std::int32_t piece) const { return flat_.outlines.pieces[piece].right_chart; }

    /// Adds the hems of the chart that `finder` has selected. The chart's outline vertices are the inner ends of the hems.
    void add_hems(std::array<std::int32_t, 2> to_atlas, const pixel_finder& finder) {
        const auto add_outer = [&](std::int32_t i) {
            const std::int32_t id = flat_.open_corners[i];
            if (hems_[i].is_empty()) return vertex_of_[id];
            const std::uint32_t vertex = static_cast<std::uint32_t>(mesh_.vertex_count());
            mesh_.hem_vertices.push_back({vertex, vertex_of_[id]});
            add_position(flat_.outlines.corners[id], hems_[i]);
            add_texture(flat_.outlines.corners[id], to_atlas, finder, hems_[i]);
            return vertex;
        };
        const std::int32_t c = finder.shown_chart();
        for (; next_hemmed_ < hemmed_pieces_.count() && chart_of(hemmed_pieces_[next_hemmed_]) == c; ++next_hemmed_) {
            const std::int32_t p = hemmed_pieces_[next_hemmed_];
            std::uint32_t outer_a = add_outer(flat_.first_open_corner[p]);
            for (std::int32_t i = flat_.first_open_corner[p] + 1; i < flat_.first_open_corner[p + 1]; ++i) {
                const std::uint32_t a = vertex_of_[flat_.open_corners[i - 1]], b = vertex_of_[flat_.open_corners[i]];
                const std::uint32_t outer_b = add_outer(i);
                if (outer_b != b) mesh_.triangles.insert(mesh_.triangles.end(), {a, b, outer_b});
                if (outer_a != a) mesh_.triangles.insert(mesh_.triangles.end(), {a, outer_b, outer_a});
                outer_a = outer_b;
            }
        }
    }

    /// Adds the texture coordinates and the pixel of a vertex.
    ///
    /// to_atlas  offset from the lattice to texels
    /// beyond    outer end of the hem, for a vertex of a hem
    void add_texture(const outline_corner& corner, std::array<std::int32_t, 2> to_atlas, const pixel_finder& finder,
                     const hem& beyond = {}) {
        mesh_.texture_coordinates.push_back((nearest_float(corner.x + to_atlas[0]) + beyond.x) * u_scale_);
        mesh_.texture_coordinates.push_back((nearest_float(corner.y + to_atlas[1]) + beyond.y) * v_scale_);
        mesh_.pixels.push_back(finder.find(corner.x, corner.y, corner.disparity));
    }

    void add_position(const outline_corner& corner, const hem& beyond = {}) {
        const float disparity = beyond.is_empty() ? corner.disparity : beyond.disparity;
        // Hems may lie behind the farthest surface. This minimum limits how far.
        const float min_inverse_depth = 0.9F * facts_.range.inverse_depth(0);
        const float inverse_depth = (std::max)(facts_.range.inverse_depth((std::min)(disparity, 1.0F)), min_inverse_depth);
        const std::array<float, 3> point =
            camera_.unproject(nearest_float(corner.x) + beyond.x, nearest_float(corner.y) + beyond.y, 1.0F / inverse_depth);
        mesh_.positions.append(point.begin(), point.end());
    }

    /// Lifts each corner once and copies its position afterward, so that charts meet exactly, even if the compiler changes float
    /// arithmetic.
    void add_outline_position(std::int32_t corner) {
        std::int32_t& first_coordinate = first_coordinate_[corner];
        if (first_coordinate < 0) {
            first_coordinate = mesh_.positions.count();
            add_position(flat_.outlines.corners[corner]);
        } else {
            for (std::int32_t i = 0; i < 3; ++i) mesh_.positions.push_back(mesh_.positions[first_coordinate + i]);
        }
    }

    const photo_facts& facts_;
    pinhole_camera camera_;  ///< camera of the lattice, which includes the margin
    const flat_mesh& flat_;
    buffer<hem> hems_;  ///< per entry of flat_mesh::open_corners
    float u_scale_, v_scale_;
    buffer<std::int32_t> first_coordinate_;  ///< per corner: index in mesh_.positions, or -1
    buffer<std::uint32_t> vertex_of_;        ///< per corner of the current chart: its vertex
    buffer<std::int32_t> hemmed_pieces_;     ///< pieces with a hem, sorted by chart
    std::int32_t next_hemmed_ = 0;           ///< index in hemmed_pieces_ of the next piece to add
    textured_mesh mesh_;
};

/// Collects the disparity of the nearest surface at each position, and its matte if there is a matte column.
template <has_columns<disparity_column> Layers>
visible_surfaces find_visible(const Layers& layers) {
    constexpr bool has_matte = has_column<Layers, matte_column>;
    const auto& g = layers.topology();
    const std::size_t rows = static_cast<std::size_t>(g.height()), columns = static_cast<std::size_t>(g.width());
    visible_surfaces seen{image<float>(rows, columns, 1),
                          has_matte ? image<std::uint8_t>(rows, columns, 1) : image<std::uint8_t>()};
    std::fill_n(seen.disparity.data(), seen.disparity.size(), visible_surfaces::nothing);
    const auto disparity = layers.template column<disparity_column>();
    for (std::int32_t i = 0; i < g.count(); ++i) {
        const std::size_t position = g.position_of(i);
        if (disparity[i] <= seen.disparity.data()[position]) continue;
        seen.disparity.data()[position] = disparity[i];
        if constexpr (has_matte) seen.matte.data()[position] = layers.template column<matte_column>()[i];
    }
    return seen;
}

}  // namespace detail

/// Builds the mesh of a layered image in the space of the photo's camera.
///
/// layers  in canonical order. Disparities above 1 count as 1. Negative disparities lie behind disparity 0, but their inverse
///         depth is at least 0.9 times that of disparity 0. Edges along silhouettes are soft if there is a matte column. Where a
///         hidden surface ends at a nearer one of similar depth, a strip extends it up to 4 pixels behind the nearer surface.
///         With the default tolerances or smaller ones, no camera within facts.motion then sees a gap
/// facts   supply camera (with a positive focal length), margin, range (0 < z_near <= z_far), surface rule and motion
/// charts  a partition of the pixels (make_charts)
/// atlas   texture atlas of these charts
///
/// Raises invalid_option; mismatch if inputs don't fit together, or if there are charts and the atlas has no pixels; invalid_data
/// for disparities that are not finite; and too_large for a chart with a bounding box above max_chart_box.
///
/// Charts share no vertices, because each chart has its own position in the atlas. Where two charts meet, both have vertices
/// with bitwise equal positions, and the same edges between them. Time is linear, except for sorting, simplification, and charts
/// with many edges across one scanline. Memory is 30 bytes per pixel, and up to 100 if most surfaces are single pixels.
template <has_columns<disparity_column> Layers, executor Executor = const serial_executor>
textured_mesh build_mesh(const Layers& layers, const photo_facts& facts, const chart_set& charts, const texture_atlas& atlas,
                         const mesh_options& options = {}, Executor&& threads = {}) {
    const auto& g = layers.topology();
    const pinhole_camera camera = facts.layers_camera();
    const buffer<chart_placement>& placements = atlas.placements;
    if (camera.width != g.width() || camera.height != g.height() || placements.size() != charts.charts.size())
        raise(error_code::mismatch, "build_mesh",
              "a camera of " + std::to_string(g.width()) + "x" + std::to_string(g.height()) + " and " +
                  std::to_string(charts.charts.size()) + " placements",
              std::to_string(camera.width) + "x" + std::to_string(camera.height) + " and " + std::to_string(placements.size()));
    detail::check_facts(facts);
    if (!charts.charts.empty() && atlas.color.empty())
        raise(error_code::mismatch, "build_mesh", "an atlas with pixels", detail::shape_text(atlas.color));
    check_charts(charts, g, "build_mesh");
    for (const float d : layers.template column<disparity_column>())
        if (!std::isfinite(d)) raise(error_code::invalid_data, "build_mesh", "finite disparities", detail::to_text(d));
    const soft_edge_options& soft = options.soft_edges;
    if (!(soft.min_width >= 0 && soft.max_width >= soft.min_width && soft.max_width <= 64 && soft.max_share >= 0))
        raise(
            error_code::invalid_option, "soft_edge_options",
            "widths from 0 to 64 with min_width <= max_width, and a max_share of at least 0",
            detail::to_text(soft.min_width) + ", " + detail::to_text(soft.max_width) + " and " + detail::to_text(soft.max_share));
    const flat_mesh flat = build_flat_mesh(layers, facts.range, charts, options, threads);

    const detail::visible_surfaces seen = detail::find_visible(layers);
    const auto disparity = layers.template column<disparity_column>();
    detail::mesh_assembler assembler(facts, flat, detail::hem_finder(flat, g, disparity, seen.disparity, facts).find(), atlas);
    {
        detail::pixel_finder finder(g, disparity, charts.chart_of);
        for (std::size_t c = 0; c < flat.charts.size(); ++c)
            assembler.add_chart(flat.charts[c], charts.charts[c], placements[c], finder);
    }
    if constexpr (has_column<Layers, matte_column>)
        if (soft.min_width > 0) assembler.add_soft_edges(charts, atlas, seen, soft);
    return assembler.finish();
}

}}  // namespace ldi
