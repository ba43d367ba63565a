// Assembles the mesh of a layered image from triangles in the plane: lifts vertices along their rays, and adds hems and soft
// edges.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/mesh/detail/hems.hpp>
#include <ldi/mesh/detail/pixel_stacks.hpp>
#include <ldi/mesh/detail/soft_edges.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/mesh_options.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/texture/atlas.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Lifts the vertices of all charts and appends the charts to one mesh.
class mesh_assembler {
public:
    /// stacks    the pixels of the layered image
    /// chart_of  chart of each pixel (chart_set::chart_of)
    /// hems      result of hem_finder::find(): one per entry of flat_mesh::open_corners
    mesh_assembler(const photo_facts& facts, const flat_mesh& flat, const pixel_stacks& stacks,
                   array_view<const std::int32_t> chart_of, buffer<hem> hems, const texture_atlas& atlas)
        : facts_(facts),
          camera_(facts.layers_camera()),
          flat_(flat),
          stacks_(stacks),
          chart_of_(chart_of),
          hems_(std::move(hems)),
          u_scale_(1.0F / nearest_float(atlas.color.width())),
          v_scale_(1.0F / nearest_float(atlas.color.height())),
          first_coordinate_(flat.outlines.corners.size(), -1),
          vertex_of_(flat.outlines.corners.size(), 0) {
        for (std::int32_t p = 0; p < flat.outlines.pieces.count(); ++p) {
            const auto first = hems_.begin() + flat.first_open_corner[p], last = hems_.begin() + flat.first_open_corner[p + 1];
            if (!std::all_of(first, last, [](const hem& h) { return h.is_empty(); })) hemmed_pieces_.push_back(p);
        }
        stable_sort(hemmed_pieces_, [&](std::int32_t a, std::int32_t b) { return chart_of_piece(a) < chart_of_piece(b); });
        std::size_t vertex_count = 0, index_count = 0;
        for (const chart_mesh& c : flat.charts) {
            vertex_count += c.outline.size() + static_cast<std::size_t>(c.stud_vertex_count);
            index_count += c.triangles.size();
        }
        mesh_.positions.reserve(3 * vertex_count), mesh_.texture_coordinates.reserve(2 * vertex_count);
        mesh_.pixels.reserve(vertex_count), mesh_.triangles.reserve(index_count);
    }

    /// Adds the next chart. Charts must be added in order.
    void add_chart(const chart_mesh& source, const chart& shape, const chart_placement& place) {
        ++chart_;
        const std::uint32_t first_vertex = static_cast<std::uint32_t>(mesh_.vertex_count());
        const std::array<std::int32_t, 2> to_atlas{place.x - shape.x, place.y - shape.y};
        for (std::int32_t id : source.outline) {
            vertex_of_[id] = static_cast<std::uint32_t>(mesh_.vertex_count());
            add_outline_position(id);
            add_texture(flat_.outlines.corners[id], to_atlas);
        }
        for (std::int32_t i = 0; i < source.stud_vertex_count; ++i) {
            const outline_corner& corner = flat_.studs.vertices[source.first_stud_vertex + i];
            add_position(corner);
            add_texture(corner, to_atlas);
        }
        for (std::uint32_t index : source.triangles) mesh_.triangles.push_back(first_vertex + index);
        add_hems(to_atlas);
    }

    /// matte  the matte of each pixel
    void add_soft_edges(const chart_set& charts, const texture_atlas& atlas, array_view<const std::uint8_t> matte,
                        const soft_edge_options& options) {
        // Sizes in GLB files, in bytes. `texel_bytes` is the size of a texel in smooth areas with JPEG at quality 85.
        // `edge_bytes` is the size that the strip adds per edge.
        constexpr float vertex_bytes = 16, triangle_bytes = 6, texel_bytes = 0.06F, edge_bytes = 56;
        const float bytes = vertex_bytes * nearest_float(mesh_.vertex_count()) +
                            triangle_bytes * nearest_float(mesh_.triangle_count()) +
                            texel_bytes * nearest_float(atlas.color.size() / 3);
        soft_edge_builder builder(flat_, stacks_, matte, facts_.surface, camera_, facts_.range,
                                  limited_to(options, atlas.filter_padding));
        const float max_edges = nearest_float(flat_.open_corners.size());  // upper bound, for an infinite max_share
        builder.choose(static_cast<std::size_t>((std::min)(max_edges, options.max_share * bytes / edge_bytes)));
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
    std::int32_t chart_of_piece(std::int32_t piece) const { return flat_.outlines.pieces[piece].right_chart; }

    /// Adds the hems of the current chart. The chart's outline vertices are the inner ends of the hems.
    void add_hems(std::array<std::int32_t, 2> to_atlas) {
        const auto add_outer = [&](std::int32_t i) {
            const std::int32_t id = flat_.open_corners[i];
            if (hems_[i].is_empty()) return vertex_of_[id];
            const std::uint32_t vertex = static_cast<std::uint32_t>(mesh_.vertex_count());
            mesh_.hem_vertices.push_back({vertex, vertex_of_[id]});
            add_position(flat_.outlines.corners[id], hems_[i]);
            add_texture(flat_.outlines.corners[id], to_atlas, hems_[i]);
            return vertex;
        };
        for (; next_hemmed_ < hemmed_pieces_.count() && chart_of_piece(hemmed_pieces_[next_hemmed_]) == chart_; ++next_hemmed_) {
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
    /// beyond    the hem, if the vertex is its outer end; empty otherwise
    void add_texture(const outline_corner& corner, std::array<std::int32_t, 2> to_atlas, const hem& beyond = {}) {
        mesh_.texture_coordinates.push_back((nearest_float(corner.x + to_atlas[0]) + beyond.x) * u_scale_);
        mesh_.texture_coordinates.push_back((nearest_float(corner.y + to_atlas[1]) + beyond.y) * v_scale_);
        mesh_.pixels.push_back(pixel_at(corner));
    }

    /// Returns the pixel of the current chart that touches a corner. If several do, returns the one with the most similar
    /// disparity; if none does, returns no_pixel.
    std::int32_t pixel_at(const outline_corner& corner) const {
        std::int32_t best = no_pixel;
        float best_difference = 0;
        for (const std::int32_t y : {corner.y - 1, corner.y})
            for (const std::int32_t x : {corner.x - 1, corner.x}) {
                stacks_.for_each(x, y, [&](std::int32_t pixel) {
                    if (chart_of_[pixel] != chart_) return;
                    const float difference = std::abs(stacks_.disparity(pixel) - corner.disparity);
                    if (best == no_pixel || difference < best_difference) best = pixel, best_difference = difference;
                });
            }
        return best;
    }

    void add_position(const outline_corner& corner, const hem& beyond = {}) {
        const float disparity = beyond.is_empty() ? corner.disparity : beyond.disparity;
        // The disparity of a hem may be below that of the farthest surface, by up to 0.2 * surface_rule::max_step
        // (hem_finder::gap). With the default rule and range, the inverse depth of hems is at least 0.91 times that of
        // disparity 0. The minimum below only takes effect with other rules and ranges.
        const float min_inverse_depth = 0.9F * facts_.range.inverse_depth(0);
        const float inverse_depth = (std::max)(facts_.range.inverse_depth((std::min)(disparity, 1.0F)), min_inverse_depth);
        const std::array<float, 3> point =
            camera_.unproject(nearest_float(corner.x) + beyond.x, nearest_float(corner.y) + beyond.y, 1.0F / inverse_depth);
        mesh_.positions.append(point.begin(), point.end());
    }

    /// Lifts each corner once and copies its position afterward. Charts then meet exactly, even if the compiler evaluates the
    /// same float expression differently in two places.
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
    const pixel_stacks& stacks_;
    array_view<const std::int32_t> chart_of_;
    std::int32_t chart_ = -1;  ///< the chart that was added last
    buffer<hem> hems_;         ///< per entry of flat_mesh::open_corners
    float u_scale_, v_scale_;
    buffer<std::int32_t> first_coordinate_;  ///< per corner: index in mesh_.positions, or -1
    buffer<std::uint32_t> vertex_of_;        ///< per corner of the current chart: its vertex
    buffer<std::int32_t> hemmed_pieces_;     ///< pieces with a hem, sorted by chart
    std::int32_t next_hemmed_ = 0;           ///< index in hemmed_pieces_ of the next piece to add
    textured_mesh mesh_;
};

}}}  // namespace ldi::detail
