// From charts to a textured triangle mesh (paper, section "Meshing"): chart polygons are simplified and triangulated in 2D, then
// every vertex is lifted along its ray according to its disparity.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/texture/atlas.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi {

namespace detail {

/// Finds the pixel of a chart at a corner of the lattice.
class pixel_finder {
public:
    pixel_finder(const graph& g, std::span<const float> disparity)
        : graph_(g),
          disparity_(disparity),
          shown_(static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height), {-1, no_pixel}) {}

    /// The chart to search from now on.
    void show(const chart& c) {
        ++chart_;
        for (const std::int32_t pixel : c.pixels) shown_[position(graph_.x[pixel], graph_.y[pixel])] = {chart_, pixel};
    }

    /// Of the chart's pixels round the corner (x, y), the one nearest in disparity.
    std::int32_t find(std::int32_t x, std::int32_t y, float disparity) const {
        std::int32_t best = no_pixel;
        float best_difference = 0;
        for (std::int32_t v = std::max<std::int32_t>(y - 1, 0); v <= std::min<std::int32_t>(y, graph_.height - 1); ++v)
            for (std::int32_t u = std::max<std::int32_t>(x - 1, 0); u <= std::min<std::int32_t>(x, graph_.width - 1); ++u) {
                const auto [of_chart, pixel] = shown_[position(u, v)];
                if (of_chart != chart_) continue;
                const float difference = std::abs(disparity_[static_cast<std::size_t>(pixel)] - disparity);
                if (best == no_pixel || difference < best_difference) best = pixel, best_difference = difference;
            }
        return best;
    }

private:
    struct occupant {
        std::int32_t chart, pixel;
    };
    std::size_t position(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(graph_.width) + static_cast<std::size_t>(x);
    }

    const graph& graph_;
    std::span<const float> disparity_;
    std::int32_t chart_ = -1;
    buffer<occupant> shown_;
};

}  // namespace detail

/// Makes the mesh of a layered image, as its camera sees it over its range of distances.
///
/// layers  in canonical order; disparities are clamped to [0, 1]
/// charts  a partition of the pixels (make_charts)
/// atlas   of these charts
/// Raises invalid_option, and mismatch where inputs don't fit together.
///
/// Charts share no vertices, for they lie at different places of the atlas; but where they meet, both have vertices with the same
/// position, bit for bit, and the same edges between them.
template <has_columns<disparity_column> Layers, executor Executor = const serial_executor>
textured_mesh build_mesh(const Layers& layers, const chart_set& charts, const texture_atlas& atlas,
                         const mesh_options& options = {}, Executor&& threads = {}) {
    const graph& g = layers.topology;
    const buffer<float>& disparity = layers.template column<disparity_column>();
    const pinhole_camera& camera = layers.camera;
    const buffer<chart_placement>& placements = atlas.placements;
    if (camera.width != g.width || camera.height != g.height || placements.size() != charts.charts.size())
        raise(error_code::mismatch, "build_mesh",
              "a camera of " + std::to_string(g.width) + "x" + std::to_string(g.height) + " and " +
                  std::to_string(charts.charts.size()) + " placements",
              std::to_string(camera.width) + "x" + std::to_string(camera.height) + " and " + std::to_string(placements.size()));
    const flat_mesh flat = build_flat_mesh(g, disparity, charts, layers.range, options, threads);

    std::size_t vertex_count = 0, index_count = 0;
    for (const chart_mesh& c : flat.charts) {
        vertex_count += c.outline.size() + static_cast<std::size_t>(c.stud_vertex_count);
        index_count += c.triangles.size();
    }
    textured_mesh mesh;
    mesh.positions.reserve(3 * vertex_count), mesh.texture_coordinates.reserve(2 * vertex_count),
        mesh.pixels.reserve(vertex_count), mesh.triangles.reserve(index_count);
    const float u_scale = 1.0F / static_cast<float>(atlas.color.width()),
                v_scale = 1.0F / static_cast<float>(atlas.color.height());
    // A corner is lifted once and copied from then on, so that charts meet exactly whatever the compiler does with floats.
    buffer<std::int32_t> vertex_of_corner(flat.outlines.corners.size(), -1);
    detail::pixel_finder finder(g, disparity);
    for (std::size_t c = 0; c < flat.charts.size(); ++c) {
        const chart_mesh& source = flat.charts[c];
        const chart& shape = charts.charts[c];
        finder.show(shape);
        const std::uint32_t first_vertex = static_cast<std::uint32_t>(mesh.vertex_count());
        const auto add_position = [&](const outline_corner& corner) {
            const float d = std::clamp(corner.disparity, 0.0F, 1.0F);
            const std::array<float, 3> point =
                camera.unproject(static_cast<float>(corner.x), static_cast<float>(corner.y), layers.range.depth(d));
            mesh.positions.append(point.begin(), point.end());
        };
        const auto add_pixel = [&](const outline_corner& corner) {
            mesh.pixels.push_back(finder.find(corner.x, corner.y, corner.disparity));
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
            add_pixel(corner);
        }
        for (std::int32_t i = 0; i < source.stud_vertex_count; ++i) {
            const outline_corner& corner = flat.studs.vertices[source.first_stud_vertex + i];
            add_position(corner);
            add_texture_coordinate(corner);
            add_pixel(corner);
        }
        for (std::uint32_t index : source.triangles) mesh.triangles.push_back(first_vertex + index);
    }
    return mesh;
}

}  // namespace ldi
