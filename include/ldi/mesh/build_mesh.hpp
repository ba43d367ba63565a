// From charts to a textured triangle mesh (paper, section "Meshing"): chart polygons are simplified and triangulated in 2D, then
// every vertex is lifted along its ray according to its disparity.
#pragma once

#include <ldi/core/camera.hpp>
#include <ldi/core/error.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/flip.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/studs.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/mesh/triangulate.hpp>
#include <ldi/texture/charts.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi {

struct mesh_options {
    simplify_options outlines;
    stud_options studs;
};

/// The triangles of one chart, in the plane of the photo.
struct chart_mesh {
    std::vector<std::int32_t> outline;   ///< its first vertices: indices of corners in chart_outlines, loop by loop
    std::int32_t first_stud_vertex = 0;  ///< its other vertices: stud_set::vertices from here on
    std::int32_t stud_vertex_count = 0;
    std::vector<std::uint32_t> triangles;  ///< F x 3 indices into the two, counter-clockwise on screen
};

/// Everything up to lifting, for those who want to look at or test the steps.
struct flat_mesh {
    chart_outlines outlines;
    stud_set studs;
    std::vector<chart_mesh> charts;
};

/// Triangulates every chart in the plane. Arguments as for build_mesh.
template <executor Executor>
flat_mesh build_flat_mesh(const graph& g, std::span<const float> disparity, const chart_set& charts, const mesh_options& options,
                          Executor& threads);

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
template <executor Executor>
textured_mesh build_mesh(const graph& g, std::span<const float> disparity, const chart_set& charts,
                         std::span<const chart_placement> placements, std::int32_t atlas_width, std::int32_t atlas_height,
                         const pinhole_camera& camera, const depth_range& range, const mesh_options& options,
                         Executor&& threads) {
    if (camera.width != g.width || camera.height != g.height || placements.size() != charts.charts.size())
        raise(error_code::mismatch, "build_mesh",
              "a camera of " + std::to_string(g.width) + "x" + std::to_string(g.height) + " and " +
                  std::to_string(charts.charts.size()) + " placements",
              std::to_string(camera.width) + "x" + std::to_string(camera.height) + " and " + std::to_string(placements.size()));
    const flat_mesh flat = build_flat_mesh(g, disparity, charts, options, threads);

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
    std::vector<std::int32_t> vertex_of_corner(flat.outlines.corners.size(), -1);
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
            const outline_corner& corner = flat.outlines.corners[static_cast<std::size_t>(id)];
            std::int32_t& lifted = vertex_of_corner[static_cast<std::size_t>(id)];
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
            const outline_corner& corner = flat.studs.vertices[static_cast<std::size_t>(source.first_stud_vertex + i)];
            add_position(corner);
            add_texture_coordinate(corner);
        }
        for (std::uint32_t index : source.triangles) mesh.triangles.push_back(first_vertex + index);
    }
    return mesh;
}

namespace detail {

/// A chart as the triangulator takes it, and the piece that the edge after each outline vertex belongs to.
struct chart_polygon {
    polygon shape;
    std::vector<std::int32_t> corners, pieces;

    void assign(const flat_mesh& flat, const simplified_boundary& boundary, const chart& box, std::size_t chart_index) {
        shape.clear(), corners.clear(), pieces.clear();
        const auto add = [&](const outline_corner& corner) {
            shape.points.push_back({corner.x - box.x, corner.y - box.y});
            shape.next.push_back(static_cast<std::int32_t>(shape.points.size()));
        };
        const chart_outlines& outlines = flat.outlines;
        for (std::int32_t l = outlines.first_loop[chart_index]; l < outlines.first_loop[chart_index + 1]; ++l) {
            const std::int32_t loop_start = static_cast<std::int32_t>(shape.points.size());
            for (std::int32_t s = outlines.first_step[static_cast<std::size_t>(l)];
                 s < outlines.first_step[static_cast<std::size_t>(l) + 1]; ++s) {
                const outline_step step = outlines.steps[static_cast<std::size_t>(s)];
                const std::span<const std::int32_t> kept = boundary.corners(step.piece);
                for (std::size_t i = 0; i + 1 < kept.size(); ++i) {
                    const std::int32_t id = kept[step.reversed ? kept.size() - 1 - i : i];
                    add(outlines.corners[static_cast<std::size_t>(id)]);
                    corners.push_back(id), pieces.push_back(step.piece);
                }
            }
            shape.next.back() = loop_start;
        }
        shape.outline_count = static_cast<std::int32_t>(shape.points.size());
        const stud_set& studs = flat.studs;
        for (std::int32_t s = studs.first_stud[chart_index]; s < studs.first_stud[chart_index + 1]; ++s) {
            const std::int32_t end = studs.first_vertex[static_cast<std::size_t>(s) + 1];
            for (std::int32_t v = studs.first_vertex[static_cast<std::size_t>(s)]; v < end; ++v)
                add(studs.vertices[static_cast<std::size_t>(v)]);
            shape.next.back() = -1;
        }
    }
};

}  // namespace detail

template <executor Executor>
flat_mesh build_flat_mesh(const graph& g, std::span<const float> disparity, const chart_set& charts, const mesh_options& options,
                          Executor& threads) {
    if (!(options.outlines.tolerance < static_cast<float>(options.studs.clearance)))
        raise(error_code::invalid_option, "mesh_options", "an outline tolerance below the clearance of studs",
              std::to_string(options.outlines.tolerance) + " and " + std::to_string(options.studs.clearance));
    flat_mesh flat;
    flat.outlines = trace_outlines(g, disparity, charts);
    flat.studs = make_studs(g, disparity, charts, flat.outlines.boundary_sides, options.studs);
    simplified_boundary boundary(flat.outlines, options.outlines);
    const std::size_t count = charts.charts.size();
    flat.charts.resize(count);

    // An outline that crosses itself once simplified says where; the pieces in question are refined, and the charts on both sides
    // of them done again. The detailed outlines never cross, so this ends.
    std::vector<std::int32_t> open(count);
    for (std::size_t c = 0; c < count; ++c) open[c] = static_cast<std::int32_t>(c);
    std::vector<std::vector<std::int32_t>> to_refine(count);
    while (!open.empty()) {
        parallel_for(threads, open.size(), 8, [&](std::size_t first, std::size_t last) {
            triangulator triangulate;
            triangulation flat_triangles;
            std::vector<std::int32_t> stack;
            detail::chart_polygon outline;
            for (std::size_t i = first; i < last; ++i) {
                const std::size_t c = static_cast<std::size_t>(open[i]);
                outline.assign(flat, boundary, charts.charts[c], c);
                chart_mesh& result = flat.charts[c];
                to_refine[c].clear();
                const std::optional<polygon_conflict> conflict = triangulate(outline.shape, flat_triangles);
                if (conflict) {
                    // Both pieces that meet in a vertex may be to blame.
                    for (std::int32_t v : conflict->vertices) {
                        if (v < 0 || v >= outline.shape.outline_count) continue;
                        to_refine[c].push_back(outline.pieces[static_cast<std::size_t>(v)]);
                        to_refine[c].push_back(outline.pieces[static_cast<std::size_t>(triangulate.vertex_before(v))]);
                    }
                    continue;
                }
                flip_to_delaunay(outline.shape.points, flat_triangles, stack);
                result.triangles = flat_triangles.triangles;
                result.outline = outline.corners;
                result.first_stud_vertex = flat.studs.first_vertex[static_cast<std::size_t>(flat.studs.first_stud[c])];
                result.stud_vertex_count =
                    flat.studs.first_vertex[static_cast<std::size_t>(flat.studs.first_stud[c + 1])] - result.first_stud_vertex;
            }
        });
        std::vector<std::int32_t> again;
        for (std::int32_t chart_index : open) {
            const std::size_t c = static_cast<std::size_t>(chart_index);
            bool refined = to_refine[c].empty();
            const auto refine = [&](std::int32_t p) {
                if (!boundary.refine(p)) return;
                refined = true;
                const boundary_piece& piece = flat.outlines.pieces[static_cast<std::size_t>(p)];
                again.push_back(piece.right_chart);
                if (piece.left_chart != no_chart) again.push_back(piece.left_chart);
            };
            std::sort(to_refine[c].begin(), to_refine[c].end());
            to_refine[c].erase(std::unique(to_refine[c].begin(), to_refine[c].end()), to_refine[c].end());
            for (std::int32_t p : to_refine[c]) refine(p);
            if (refined) continue;
            for (std::int32_t s = flat.outlines.first_step[static_cast<std::size_t>(flat.outlines.first_loop[c])];
                 s < flat.outlines.first_step[static_cast<std::size_t>(flat.outlines.first_loop[c + 1])]; ++s)
                refine(flat.outlines.steps[static_cast<std::size_t>(s)].piece);
            if (!refined)
                raise(error_code::mismatch, "build_mesh", "charts with at most one pixel at a position",
                      "chart " + std::to_string(c) + ", whose outline crosses itself");
        }
        std::sort(again.begin(), again.end());
        again.erase(std::unique(again.begin(), again.end()), again.end());
        open = std::move(again);
    }
    return flat;
}

}  // namespace ldi
