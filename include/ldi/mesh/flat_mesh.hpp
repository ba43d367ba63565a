// Meshes charts in the plane: traces their outlines, simplifies them without self-intersections, adds studs (vertical lines of
// inner vertices, mesh/studs.hpp), and triangulates (paper, section "Meshing", Figure "meshing" a to d).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/mesh/detail/chart_polygon.hpp>
#include <ldi/mesh/detail/crossings.hpp>
#include <ldi/mesh/detail/mesh_checks.hpp>
#include <ldi/mesh/detail/stud_placer.hpp>
#include <ldi/mesh/detail/stud_sampler.hpp>
#include <ldi/mesh/flip.hpp>
#include <ldi/mesh/mesh_options.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/stud_set.hpp>
#include <ldi/mesh/triangulate.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Triangles of one chart, in the plane of the photo.
struct chart_mesh {
    buffer<std::int32_t> outline;        ///< outline vertices, loop by loop: indices in chart_outlines::corners
    std::int32_t first_stud_vertex = 0;  ///< first of the stud vertices: index into stud_set::vertices
    std::int32_t stud_vertex_count = 0;
    buffer<std::uint32_t> triangles;  ///< F x 3 indices into outline vertices, then stud vertices; counter-clockwise on screen
};

/// Results of all steps before the vertices are lifted to their depth, for inspection and tests.
struct flat_mesh {
    chart_outlines outlines;
    stud_set studs;
    buffer<chart_mesh> charts;
    /// Kept corners of the outline pieces that border only one chart, as indices in chart_outlines::corners. Piece p has the
    /// entries open_corners[first_open_corner[p] .. first_open_corner[p + 1]). Pieces between two charts have no entries.
    buffer<std::int32_t> open_corners, first_open_corner;
};

/// Triangulates every chart in the plane.
///
/// layers  in canonical order, with finite disparities
/// range   distances of surfaces at disparity 1 and 0; 0 < z_near <= z_far
/// charts  a partition of the pixels (make_charts)
///
/// Raises invalid_option for an option or a range out of bounds; mismatch if `layers` is a view whose graph violates an
/// invariant, if the charts are not a partition of the pixels, if a right neighbor is not the next pixel, as it is in canonical
/// order, or if a chart has two pixels at one position; invalid_data for disparities that are not finite; and too_large for a
/// bounding box above max_chart_box.
template <has_columns<disparity_column> Layers, executor Executor = const serial_executor>
flat_mesh build_flat_mesh(const Layers& layers, const depth_range& range, const chart_set& charts,
                          const mesh_options& options = {}, Executor&& threads = {});

namespace detail {

/// Checks the outlines of charts for crossings and triangulates the charts, one chart per call.
class chart_mesher {
public:
    chart_mesher(flat_mesh& flat, const simplified_boundary& boundary, const chart_set& charts)
        : flat_(flat), boundary_(boundary), charts_(charts) {}

    /// Stores in `to_split` the edges of chart c that must be split so that its outline does not cross itself. With
    /// `only_fresh`, assumes that edges older than the last split do not cross each other.
    void find_crossings(std::int32_t c, bool only_fresh, buffer<boundary_split>& to_split) {
        to_split.clear();
        outline_.assign(flat_.outlines, boundary_, charts_.charts[c], c);
        crossing_report report{*this, to_split};
        if (only_fresh)
            finder_.find_fresh(outline_.shape, outline_.fresh, report);
        else
            finder_.find_all(outline_.shape, report);
        const polygon& shape = outline_.shape;
        std::int32_t v = 0;
        for (std::int32_t l = flat_.outlines.first_loop[c]; l < flat_.outlines.first_loop[c + 1]; ++l) {
            // A narrow loop, almost a slit, can turn inside out without a crossing.
            std::int64_t twice_area = 0;
            const std::int32_t loop_start = v;
            std::int32_t next = v;
            do {
                v = next;
                next = shape.next[v];
                const lattice_point a = shape.points[v], b = shape.points[next];
                twice_area += std::int64_t{a.x} * b.y - std::int64_t{b.x} * a.y;
            } while (next != loop_start);
            ++v;
            if ((flat_.outlines.loop_area[l] > 0) != (twice_area > 0))
                for (std::int32_t w = loop_start; w < v; ++w) blame(w, to_split);
        }
    }

    /// Sets flat.charts[c], or stores in `to_split` the edges to split first.
    void triangulate(std::int32_t c, buffer<boundary_split>& to_split) {
        to_split.clear();
        outline_.assign(flat_.outlines, boundary_, charts_.charts[c], c);
        outline_.add_studs(flat_.studs, charts_.charts[c], c);
        if (const std::optional<polygon_conflict> conflict = triangulator_(outline_.shape, triangles_)) {
            for (std::int32_t v : conflict->edges) blame(v, to_split);
            // If none of these edges can be split, the cause lies elsewhere in the chart, so split all edges of its outline.
            for (std::int32_t v = 0, all = to_split.empty() ? outline_.shape.outline_count : 0; v < all; ++v) blame(v, to_split);
            if (to_split.empty())
                raise(error_code::mismatch, "build_mesh", "charts with at most one pixel per position",
                      "chart " + std::to_string(c) + ", whose outline crosses itself");
            return;
        }
        flip_to_delaunay(outline_.shape.points, triangles_, stack_);
        chart_mesh& result = flat_.charts[c];
        result.triangles = triangles_.triangles;
        result.outline = outline_.corners;
        const buffer<std::int32_t>&first_vertex = flat_.studs.first_vertex, &first_stud = flat_.studs.first_stud;
        result.first_stud_vertex = first_vertex[first_stud[c]];
        result.stud_vertex_count = first_vertex[first_stud[c + 1]] - result.first_stud_vertex;
    }

private:
    /// Requests splits of the edges that take part in a crossing.
    struct crossing_report {
        const chart_mesher& mesher;
        buffer<boundary_split>& to_split;

        void collision(std::int32_t v, std::int32_t w) {
            if (!mesher.align(v, w, to_split)) mesher.blame(v, to_split), mesher.blame(w, to_split);
        }
        void overlap(std::int32_t v, std::int32_t w) {
            const std::int32_t u = mesher.finder_.before(v), t = mesher.finder_.before(w);
            bool aligned = false;
            for (const auto& [e, f] : {std::pair{v, w}, std::pair{v, t}, std::pair{u, w}, std::pair{u, t}})
                if (mesher.align(e, f, to_split)) aligned = true;
            if (aligned) return;
            for (std::int32_t e : {u, v, t, w}) mesher.blame(e, to_split);
        }
        void spike(std::int32_t v) { mesher.blame(v, to_split), mesher.blame(mesher.finder_.before(v), to_split); }
    };

    /// Requests a split of the edge that starts at vertex v, at the skipped corner farthest from the edge. Does nothing for edges
    /// of studs, and for edges that skip no corner.
    void blame(std::int32_t v, buffer<boundary_split>& to_split) const {
        if (v >= outline_.shape.outline_count) return;
        const boundary_edge e = outline_.edges[v];
        const auto [first, last] = boundary_.left_out(e);
        if (first < last) to_split.push_back({e, boundary_.farthest_left_out(e)});
    }

    /// For each of two edges, requests splits at those skipped corners that are ends of the other edge. If the outline runs back
    /// along itself, because the chart has a slit, both sides must keep the same corners. Returns false if neither edge skips a
    /// corner at an end of the other.
    bool align(std::int32_t v, std::int32_t w, buffer<boundary_split>& to_split) const {
        bool aligned = false;
        for (const auto& [edge, other] : {std::pair{v, w}, std::pair{w, v}}) {
            const boundary_edge e = outline_.edges[edge];
            const auto [first, last] = boundary_.left_out(e);
            for (std::int32_t end : {other, outline_.shape.next[other]}) {
                const outline_corner& target = flat_.outlines.corners[outline_.corners[end]];
                for (std::int32_t c = first; c < last; ++c) {
                    const outline_corner& corner = flat_.outlines.corners[c];
                    if (corner.x != target.x || corner.y != target.y) continue;
                    to_split.push_back({e, c});
                    aligned = true;
                }
            }
        }
        return aligned;
    }

    flat_mesh& flat_;
    const simplified_boundary& boundary_;
    const chart_set& charts_;
    chart_polygon outline_;
    crossing_finder finder_;
    triangulator triangulator_;
    triangulation triangles_;
    buffer<std::int32_t> stack_;
};

/// Splits edges of simplified outlines until no outline crosses itself and every chart can be triangulated.
template <class Executor>
class outline_repair {
public:
    outline_repair(flat_mesh& flat, simplified_boundary& boundary, const chart_set& charts, Executor& threads)
        : flat_(flat), boundary_(boundary), charts_(charts), threads_(threads), to_split_(charts.charts.size()) {}

    /// Sets flat.charts. A simplified outline can cross itself. This function then splits the affected edges and checks the
    /// charts on both sides again. The repair terminates, because outlines with all their corners never cross. The triangulator
    /// detects all crossings, but it stops at the first one. crossing_finder therefore finds most crossings before the
    /// triangulation.
    void triangulate_all() {
        buffer<std::int32_t> open;
        for (std::int32_t c = 0; c < charts_.charts.count(); ++c) open.push_back(c);
        buffer<std::int32_t> pending = open;
        for (bool only_fresh = false; !pending.empty(); only_fresh = true) {
            while (!open.empty()) {
                for_each_chart(open,
                               [&](chart_mesher& mesher, std::int32_t c) { mesher.find_crossings(c, only_fresh, to_split_[c]); });
                open = split(open);
                only_fresh = true;
                pending.insert(pending.end(), open.begin(), open.end());
            }
            sort_unique(pending);
            for_each_chart(pending, [&](chart_mesher& mesher, std::int32_t c) { mesher.triangulate(c, to_split_[c]); });
            open = split(pending);
            pending = open;
        }
    }

private:
    template <class Function>
    void for_each_chart(const buffer<std::int32_t>& indices, Function&& function) {
        parallel_for(threads_, indices.size(), 8, [&](std::size_t first, std::size_t last) {
            chart_mesher mesher(flat_, boundary_, charts_);
            for (std::size_t i = first; i < last; ++i) function(mesher, indices[i]);
        });
    }

    /// Performs the splits that the charts in `indices` requested, and returns the charts on both sides of the split edges.
    buffer<std::int32_t> split(const buffer<std::int32_t>& indices) {
        buffer<boundary_split> splits;
        for (std::int32_t c : indices) splits.insert(splits.end(), to_split_[c].begin(), to_split_[c].end());
        sort_unique(splits);
        boundary_.split(splits);
        buffer<std::int32_t> touched;
        for (const boundary_split& s : splits) {
            const boundary_piece& piece = flat_.outlines.pieces[s.edge.piece];
            touched.push_back(piece.right_chart);
            if (piece.left_chart != no_chart) touched.push_back(piece.left_chart);
        }
        sort_unique(touched);
        return touched;
    }

    template <class T>
    static void sort_unique(buffer<T>& values) {
        std::sort(values.begin(), values.end());
        values.erase(std::unique(values.begin(), values.end()), values.end());
    }

    flat_mesh& flat_;
    simplified_boundary& boundary_;
    const chart_set& charts_;
    Executor& threads_;
    buffer<buffer<boundary_split>> to_split_;
};

}  // namespace detail

template <has_columns<disparity_column> Layers, executor Executor>
flat_mesh build_flat_mesh(const Layers& layers, const depth_range& range, const chart_set& charts, const mesh_options& options,
                          Executor&& threads) {
    if (!(options.outlines.tolerance < detail::nearest_float(options.studs.clearance)))
        raise(error_code::invalid_option, "mesh_options", "an outline tolerance below the clearance of studs",
              detail::to_text(options.outlines.tolerance) + " and " + std::to_string(options.studs.clearance));
    check_topology(layers.topology(), "build_mesh");
    const array_view<const float> disparity = layers.template column<disparity_column>();
    detail::check_range(range, "depth_range");
    check_disparities(disparity, "build_mesh");
    flat_mesh flat;
    flat.outlines = detail::outlines_of_sound(layers.topology(), disparity, charts);
    flat.studs = detail::place_studs(layers.topology(), disparity, range, charts, flat.outlines, options.studs);
    flat.charts.resize(charts.charts.size());
    simplified_boundary boundary(flat.outlines, options.outlines, range);
    detail::outline_repair(flat, boundary, charts, threads).triangulate_all();
    flat.first_open_corner.push_back(0);
    for (std::int32_t p = 0; p < flat.outlines.pieces.count(); ++p) {
        const std::span<const std::int32_t> kept = boundary.corners(p);
        if (flat.outlines.pieces[p].left_chart == no_chart)
            flat.open_corners.insert(flat.open_corners.end(), kept.begin(), kept.end());
        flat.first_open_corner.push_back(flat.open_corners.count());
    }
    return flat;
}

}}  // namespace ldi
