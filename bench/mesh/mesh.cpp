// Charts, atlas and mesh of the sample, one thread: include/ldi/charts, texture and mesh. The triangulation is compared with
// CGAL's constrained Delaunay triangulation of the same points and edges. CGAL triangulates the convex hull of each chart.
// Separating the inside of the chart from the outside would take additional time, which is not counted.

#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/flip.hpp>
#include <ldi/mesh/gather.hpp>
#include <ldi/mesh/move_to_sheets.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/studs.hpp>
#include <ldi/mesh/triangulate.hpp>
#include <ldi/photo3d/options.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>
#include <ldi/texture/sheets.hpp>

#if LDI_BENCH_HAS_CGAL
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#endif

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace ldi_bench;

work layer_pixels() { return {.pixels = static_cast<double>(sample().layers.size())}; }
std::string layer_text() { return pixels_text(sample().layers.size()); }
std::string chart_text() { return std::to_string(sample().charts.charts.size()) + " charts"; }

/// Length of a chart's side in macroblocks of 16 texels, with 4 texels of padding at both ends.
std::int32_t blocks(std::int32_t length) { return (length + 2 * 4 + 15) / 16; }

/// Returns the sizes of the sample's charts in macroblocks, as make_atlas() packs them. Repeats the charts until there are
/// `count` sizes.
ldi::buffer<ldi::rectangle_size> chart_blocks(std::size_t count) {
    ldi::buffer<ldi::rectangle_size> sizes;
    const auto& charts = sample().charts.charts;
    for (std::size_t i = 0; i < count; ++i) {
        const ldi::chart& c = charts[i % charts.size()];
        sizes.push_back({blocks(c.width), blocks(c.height)});
    }
    return sizes;
}

void add_texture() {
    add("charts/make_charts", [](benchmark::State& state) {
        measure(state, layer_text(), layer_pixels(), [] { return ldi::make_charts(sample().layers, {}).charts.size(); });
    });
    for (const std::size_t count : {std::size_t{100}, std::size_t{1000}, std::size_t{10000}})
        add("texture/pack/" + std::to_string(count) + " rectangles", [count](benchmark::State& state) {
            const ldi::buffer<ldi::rectangle_size> sizes = chart_blocks(count);
            measure(state, std::to_string(count), {}, [&] { return ldi::pack(sizes, 1 << 16); });
        });
    add("texture/pack_on_sheets/1000 rectangles", [](benchmark::State& state) {
        const ldi::buffer<ldi::rectangle_size> sizes = chart_blocks(1000);
        measure(state, "1000", {}, [&] { return ldi::pack_on_sheets(sizes, 256).sheets.size(); });
    });
    add("texture/packing_tree/insert 1000 rectangles", [](benchmark::State& state) {
        const ldi::buffer<ldi::rectangle_size> sizes = chart_blocks(1000);
        measure(state, "1000", {}, [&] {
            ldi::packing_tree tree({1 << 12, 1 << 12});
            ldi::rectangle_corner corner;
            std::size_t placed = 0;
            for (const ldi::rectangle_size& size : sizes)
                if (tree.insert(size, corner)) ++placed;
            return placed;
        });
    });
    add("texture/chart_padder/draw and pad all charts", [](benchmark::State& state) {
        const sample_stages& s = sample();
        const ldi::buffer<ldi::texel_kind> kinds(s.layers.size(), ldi::texel_kind::photo);
        measure_change(state, chart_text(), layer_pixels(), s.atlas, [&](ldi::texture_atlas& atlas) {
            std::fill(atlas.kind.begin(), atlas.kind.end(), ldi::texel_kind::empty);
            ldi::chart_padder padder(s.layers.topology(), s.layers.column<ldi::color_column>(), kinds, atlas.color, atlas.kind);
            for (std::size_t i = 0; i < s.charts.charts.size(); ++i) {
                const ldi::chart& c = s.charts.charts[i];
                const ldi::chart_placement at = s.atlas.placements[i];
                padder.draw(c, at, {at.x - 4, at.y - 4, blocks(c.width) * 16, blocks(c.height) * 16}, {});
            }
        });
    });
    add("texture/make_atlas", [](benchmark::State& state) {
        measure(state, layer_text(), layer_pixels(), [] { return ldi::make_atlas(sample().layers, sample().charts).fill; });
    });
}

/// The sample with its photo enlarged to 2304 x 3072, and with charts that fit on sheets.
struct large_photo {
    ldi::image<std::uint8_t> photo = ldi::area_resize(sample().photo, 3072, 2304);
    ldi::chart_set charts = ldi::make_charts(sample().layers, {}, ldi::for_sheets({}, 3072, 2304).charts);
    ldi::texture_atlas atlas = ldi::make_atlas(sample().layers, charts);
    ldi::textured_mesh mesh = ldi::build_mesh(sample().layers, sample().facts, charts, atlas);
    ldi::sheet_layout layout = ldi::lay_out_sheets(sample().layers, charts, atlas, 3072, 2304, {.margin = sample().facts.margin});
};
const large_photo& large() {
    static const large_photo made;
    return made;
}

void add_sheets() {
    add("texture/lay_out_sheets", [](benchmark::State& state) {
        measure(state, "2304 x 3072", {}, [] {
            return ldi::lay_out_sheets(sample().layers, large().charts, large().atlas, 3072, 2304,
                                       {.margin = sample().facts.margin})
                .sizes.size();
        });
    });
    add("texture/draw_sheet", [](benchmark::State& state) {
        const ldi::rectangle_size size = large().layout.sizes[1];
        measure(state, size_text(static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)),
                {.pixels = static_cast<double>(size.width) * size.height},
                [] { return ldi::draw_sheet(large().layout, 1, large().charts, large().atlas, sample().photo, large().photo); });
    });
    add("mesh/move_to_sheets", [](benchmark::State& state) {
        measure(state, std::to_string(large().mesh.triangle_count()) + " triangles", {},
                [] { return ldi::move_to_sheets(large().mesh, large().charts, large().atlas, large().layout).vertex_count(); });
    });
}

// Reconstructs the polygon from which a finished chart was triangulated.
ldi::polygon polygon_of(const ldi::flat_mesh& mesh, std::size_t chart) {
    const ldi::chart_outlines& outlines = mesh.outlines;
    const std::set<std::int32_t> used(mesh.charts[chart].outline.begin(), mesh.charts[chart].outline.end());
    ldi::polygon result;
    const auto add_corner = [&](const ldi::outline_corner& corner) {
        result.points.push_back({corner.x, corner.y});
        result.next.push_back(static_cast<std::int32_t>(result.points.size()));
    };
    for (std::int32_t l = outlines.first_loop[chart]; l < outlines.first_loop[chart + 1]; ++l) {
        const std::int32_t loop_start = static_cast<std::int32_t>(result.points.size());
        for (std::int32_t s = outlines.first_step[l]; s < outlines.first_step[l + 1]; ++s) {
            const ldi::outline_step step = outlines.steps[s];
            const ldi::boundary_piece& piece = outlines.pieces[step.piece];
            ldi::buffer<std::int32_t> corners{piece.start};
            for (std::int32_t c = piece.first_inner; c < piece.first_inner + piece.inner_count; ++c)
                if (used.count(c) != 0) corners.push_back(c);
            corners.push_back(piece.end);
            if (step.reversed) std::reverse(corners.begin(), corners.end());
            for (std::size_t i = 0; i + 1 < corners.size(); ++i) add_corner(outlines.corners[corners[i]]);
        }
        result.next.back() = loop_start;
    }
    result.outline_count = static_cast<std::int32_t>(result.points.size());
    for (std::int32_t s = mesh.studs.first_stud[chart]; s < mesh.studs.first_stud[chart + 1]; ++s) {
        for (std::int32_t v = mesh.studs.first_vertex[s]; v < mesh.studs.first_vertex[s + 1]; ++v)
            add_corner(mesh.studs.vertices[v]);
        result.next.back() = -1;
    }
    return result;
}

const std::vector<ldi::polygon>& polygons() {
    static const std::vector<ldi::polygon> made = [] {
        const sample_stages& s = sample();
        const ldi::flat_mesh mesh = ldi::build_flat_mesh(s.layers, s.facts.range, s.charts);
        std::vector<ldi::polygon> result;
        for (std::size_t c = 0; c < mesh.charts.size(); ++c) result.push_back(polygon_of(mesh, c));
        return result;
    }();
    return made;
}
std::string vertex_text() {
    std::size_t vertices = 0;
    for (const ldi::polygon& p : polygons()) vertices += p.points.size();
    return std::to_string(vertices) + " vertices";
}

std::size_t triangulate_all(bool flips) {
    static ldi::triangulator triangulate;
    static ldi::triangulation t;
    static ldi::buffer<std::int32_t> stack;
    std::size_t triangles = 0;
    for (const ldi::polygon& p : polygons()) {
        if (triangulate(p, t)) continue;
        if (flips) ldi::flip_to_delaunay(p.points, t, stack);
        triangles += t.triangles.size() / 3;
    }
    return triangles;
}

#if LDI_BENCH_HAS_CGAL
using kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::size_t triangulate_with_cgal() {
    struct input {
        std::vector<kernel::Point_2> points;
        std::vector<std::pair<std::size_t, std::size_t>> edges;
    };
    static const std::vector<input> inputs = [] {
        std::vector<input> result;
        for (const ldi::polygon& p : polygons()) {
            input made;
            for (const ldi::lattice_point& q : p.points) made.points.emplace_back(q.x, q.y);
            for (std::size_t v = 0; v < p.next.size(); ++v)
                if (p.next[v] >= 0) made.edges.emplace_back(v, static_cast<std::size_t>(p.next[v]));
            result.push_back(std::move(made));
        }
        return result;
    }();
    std::size_t faces = 0;
    for (const input& i : inputs) {
        CGAL::Constrained_Delaunay_triangulation_2<kernel> t;
        t.insert_constraints(i.points.begin(), i.points.end(), i.edges.begin(), i.edges.end());
        faces += t.number_of_faces();
    }
    return faces;
}
#endif

void add_triangulation() {
    add("mesh/triangulator/sweep alone",
        [](benchmark::State& state) { measure(state, vertex_text(), {}, [] { return triangulate_all(false); }); });
    add("mesh/flip_to_delaunay/sweep and flips",
        [](benchmark::State& state) { measure(state, vertex_text(), {}, [] { return triangulate_all(true); }); });
#if LDI_BENCH_HAS_CGAL
    add("peers/CGAL/sweep and flips", [](benchmark::State& state) {
        triangulate_with_cgal();
        measure(state, vertex_text(), {}, [] { return triangulate_with_cgal(); });
    });
#endif
}

void add_mesh() {
    add("mesh/trace_outlines", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, layer_text(), layer_pixels(), [&] {
            return ldi::trace_outlines(s.layers.topology(), s.layers.column<ldi::disparity_column>(), s.charts).pieces.size();
        });
    });
    static const auto outlines = [] {
        const sample_stages& s = sample();
        return ldi::trace_outlines(s.layers.topology(), s.layers.column<ldi::disparity_column>(), s.charts);
    };
    add("mesh/simplified_boundary", [](benchmark::State& state) {
        const ldi::chart_outlines traced = outlines();
        measure(state, std::to_string(traced.corners.size()) + " corners", {},
                [&] { return ldi::simplified_boundary(traced, {}, sample().facts.range).corners(0).size(); });
    });
    add("mesh/make_studs", [](benchmark::State& state) {
        const sample_stages& s = sample();
        const ldi::chart_outlines traced = outlines();
        measure(state, layer_text(), layer_pixels(),
                [&] { return ldi::make_studs(s.layers, s.facts.range, s.charts, traced).vertices.size(); });
    });
    add("mesh/build_flat_mesh", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, layer_text(), layer_pixels(),
                [&] { return ldi::build_flat_mesh(s.layers, s.facts.range, s.charts).charts.size(); });
    });
    for (const bool soft : {false, true})
        add(std::string("mesh/build_mesh/") + (soft ? "with soft edges" : "hard edges"), [soft](benchmark::State& state) {
            const sample_stages& s = sample();
            ldi::mesh_options options;
            if (!soft) options.soft_edges.min_width = 0;
            std::size_t triangles = 0;
            measure(state, layer_text(), layer_pixels(), [&] {
                const ldi::textured_mesh mesh = ldi::build_mesh(s.layers, s.facts, s.charts, s.atlas, options);
                return triangles = mesh.triangle_count();
            });
            state.counters["triangles"] = static_cast<double>(triangles);
        });
    add("mesh/gather/color", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, std::to_string(s.mesh.vertex_count()) + " vertices", {},
                [&] { return ldi::gather<ldi::color_column>(s.mesh, s.layers, s.facts.camera); });
    });
    add("mesh/check_mesh", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, std::to_string(s.mesh.vertex_count()) + " vertices", {}, [&] {
            ldi::check_mesh(s.mesh, 1);
            return s.mesh.triangles.data();
        });
    });
}

const bool registered = [] {
    add_texture();
    add_sheets();
    add_mesh();
    add_triangulation();
    return true;
}();

}  // namespace
