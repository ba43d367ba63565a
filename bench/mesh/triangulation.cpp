// Triangulates the simplified outlines and studs of a photo's charts: ldi's plane sweep, with and without flipping to
// constrained Delaunay, beside CGAL's constrained Delaunay triangulation of the same points and edges. CGAL fills the convex
// hull of each chart and would still need to separate inside from outside, which is not counted. The counter `cgal_times_ours`
// is CGAL's time divided by that of sweep and flips, both measured in turns in the same run.
//
// The photo is one of ../shared/rgbd with its disparity if present, else the sample.

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/photo3d.hpp>

#include <benchmark/benchmark.h>

#if LDI_BENCH_HAS_CGAL
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

namespace {

ldi::serial_executor one_thread;

struct workload {
    std::vector<ldi::polygon> charts;
    std::size_t vertices = 0;
};

// Reconstructs the polygon from which a finished chart was triangulated.
ldi::polygon polygon_of(const ldi::flat_mesh& mesh, std::size_t chart) {
    const ldi::chart_outlines& outlines = mesh.outlines;
    const std::set<std::int32_t> used(mesh.charts[chart].outline.begin(), mesh.charts[chart].outline.end());
    ldi::polygon result;
    const auto add = [&](const ldi::outline_corner& corner) {
        result.points.push_back({corner.x, corner.y});
        result.next.push_back(static_cast<std::int32_t>(result.points.size()));
    };
    for (std::int32_t l = outlines.first_loop[chart]; l < outlines.first_loop[chart + 1]; ++l) {
        const std::int32_t loop_start = static_cast<std::int32_t>(result.points.size());
        for (std::int32_t s = outlines.first_step[static_cast<std::size_t>(l)];
             s < outlines.first_step[static_cast<std::size_t>(l) + 1]; ++s) {
            const ldi::outline_step step = outlines.steps[static_cast<std::size_t>(s)];
            const ldi::boundary_piece& piece = outlines.pieces[static_cast<std::size_t>(step.piece)];
            ldi::buffer<std::int32_t> corners{piece.start};
            for (std::int32_t c = piece.first_inner; c < piece.first_inner + piece.inner_count; ++c)
                if (used.count(c) != 0) corners.push_back(c);
            corners.push_back(piece.end);
            if (step.reversed) std::reverse(corners.begin(), corners.end());
            for (std::size_t i = 0; i + 1 < corners.size(); ++i) add(outlines.corners[static_cast<std::size_t>(corners[i])]);
        }
        result.next.back() = loop_start;
    }
    result.outline_count = static_cast<std::int32_t>(result.points.size());
    for (std::int32_t s = mesh.studs.first_stud[chart]; s < mesh.studs.first_stud[chart + 1]; ++s) {
        const std::size_t first = static_cast<std::size_t>(mesh.studs.first_vertex[static_cast<std::size_t>(s)]);
        const std::size_t last = static_cast<std::size_t>(mesh.studs.first_vertex[static_cast<std::size_t>(s) + 1]);
        for (std::size_t v = first; v < last; ++v) add(mesh.studs.vertices[v]);
        result.next.back() = -1;
    }
    return result;
}

workload load() {
    const std::filesystem::path shared = std::filesystem::path(LDI_SHARED_DIR) / "rgbd";
    const std::filesystem::path sample = std::filesystem::path(LDI_SOURCE_DIR) / "examples/photo3d";
    const bool has_shared = std::filesystem::exists(shared / "iphone_a.jpg");
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = has_shared;
    const ldi::given_disparity depth{
        ldi::fill_invalid(ldi::load_depth_map(has_shared ? shared / "iphone_a_disparity.png" : sample / "sample_depth.png"))};
    const ldi::photo3d photo =
        ldi::make_photo3d(ldi::load_photo(has_shared ? shared / "iphone_a.jpg" : sample / "sample.jpg").color, depth,
                          ldi::diffusion_inpainter(), options, one_thread);
    const ldi::flat_mesh mesh = ldi::build_flat_mesh(photo.layers, photo.facts.range, photo.charts, options.mesh, one_thread);
    workload result;
    for (std::size_t c = 0; c < mesh.charts.size(); ++c) {
        result.charts.push_back(polygon_of(mesh, c));
        result.vertices += result.charts.back().points.size();
    }
    return result;
}

const workload& photo() {
    static const workload result = load();
    return result;
}

std::size_t sweep(const workload& w, bool flips) {
    static ldi::triangulator triangulate;
    static ldi::triangulation t;
    static ldi::buffer<std::int32_t> stack;
    std::size_t triangles = 0;
    for (const ldi::polygon& p : w.charts) {
        if (triangulate(p, t)) continue;
        if (flips) ldi::flip_to_delaunay(p.points, t, stack);
        triangles += t.triangles.size() / 3;
    }
    return triangles;
}

void sweep_alone(benchmark::State& state) {
    std::size_t triangles = 0;
    for (auto _ : state) triangles = sweep(photo(), false);
    state.counters["vertices"] = static_cast<double>(photo().vertices);
    state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(sweep_alone)->Unit(benchmark::kMillisecond);

void sweep_and_flips(benchmark::State& state) {
    std::size_t triangles = 0;
    for (auto _ : state) triangles = sweep(photo(), true);
    state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(sweep_and_flips)->Unit(benchmark::kMillisecond);

#if LDI_BENCH_HAS_CGAL
using kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using cgal_triangulation = CGAL::Constrained_Delaunay_triangulation_2<kernel>;

struct cgal_input {
    std::vector<kernel::Point_2> points;
    std::vector<std::pair<std::size_t, std::size_t>> edges;
};

std::vector<cgal_input> to_cgal(const workload& w) {
    std::vector<cgal_input> result;
    for (const ldi::polygon& p : w.charts) {
        cgal_input input;
        for (const ldi::lattice_point& q : p.points) input.points.emplace_back(q.x, q.y);
        for (std::size_t v = 0; v < p.next.size(); ++v)
            if (p.next[v] >= 0) input.edges.emplace_back(v, static_cast<std::size_t>(p.next[v]));
        result.push_back(std::move(input));
    }
    return result;
}

std::size_t triangulate_with_cgal(const std::vector<cgal_input>& inputs) {
    std::size_t faces = 0;
    for (const cgal_input& input : inputs) {
        cgal_triangulation t;
        t.insert_constraints(input.points.begin(), input.points.end(), input.edges.begin(), input.edges.end());
        faces += t.number_of_faces();
    }
    return faces;
}

void cgal_beside_ours(benchmark::State& state) {
    static const std::vector<cgal_input> inputs = to_cgal(photo());
    using clock = std::chrono::steady_clock;
    double ours = 1e9, cgal = 1e9;
    std::size_t faces = 0;
    for (auto _ : state) {
        const clock::time_point start = clock::now();
        faces = triangulate_with_cgal(inputs);
        const clock::time_point middle = clock::now();
        benchmark::DoNotOptimize(sweep(photo(), true));
        const clock::time_point end = clock::now();
        cgal = std::min(cgal, std::chrono::duration<double>(middle - start).count());
        ours = std::min(ours, std::chrono::duration<double>(end - middle).count());
        state.SetIterationTime(std::chrono::duration<double>(middle - start).count());
    }
    state.counters["cgal_faces"] = static_cast<double>(faces);
    state.counters["cgal_times_ours"] = cgal / ours;
}
BENCHMARK(cgal_beside_ours)->Unit(benchmark::kMillisecond)->UseManualTime();
#endif

}  // namespace
