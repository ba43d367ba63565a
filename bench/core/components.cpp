// Connected components and coarsening at 1152 x 1536. The paper's components take 12 ms on an iPhone 11 Pro.

#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>

#include "bench/core/photo_graph.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <benchmark/benchmark.h>

namespace {

void connected_components(benchmark::State& state, const ldi::graph_view& g) {
    std::size_t count = 0;
    for (auto _ : state) {
        const ldi::components found = ldi::connected_components(g);
        benchmark::DoNotOptimize(found.label.data());
        count = found.count();
    }
    state.counters["components"] = static_cast<double>(count);
    state.counters["paper_ms"] = 12;
}

void components_of_photo(benchmark::State& state) {
    const ldi::graph g = ldi::benchmarks::photo_graph();
    connected_components(state, g);
}
BENCHMARK(components_of_photo)->Unit(benchmark::kMillisecond);

void components_of_image(benchmark::State& state) {
    const ldi::graph g = ldi::make_grid(ldi::benchmarks::photo_width, ldi::benchmarks::photo_height);
    connected_components(state, g);
}
BENCHMARK(components_of_image)->Unit(benchmark::kMillisecond);

/// Connected components of a graph in which a tenth of all links is missing: short runs and many small components.
void components_of_noise(benchmark::State& state) {
    std::mt19937 random(1);
    ldi::testing::sketched_graph g(ldi::make_grid(ldi::benchmarks::photo_width, ldi::benchmarks::photo_height));
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i)
        for (const ldi::side s : {ldi::side::up, ldi::side::left})
            if (ldi::testing::chance(random, 10)) g.unlink(i, s);
    connected_components(state, g);
}
BENCHMARK(components_of_noise)->Unit(benchmark::kMillisecond);

/// Pixels in random order: the worst case.
void components_of_shuffled_image(benchmark::State& state) {
    std::mt19937 random(1);
    const ldi::graph g = ldi::make_grid(ldi::benchmarks::photo_width, ldi::benchmarks::photo_height);
    const ldi::graph shuffled = ldi::reordered(g, ldi::testing::random_permutation(random, g.size()));
    connected_components(state, shuffled);
}
BENCHMARK(components_of_shuffled_image)->Unit(benchmark::kMillisecond);

void coarsen_photo(benchmark::State& state) {
    const ldi::graph g = ldi::benchmarks::photo_graph();
    for (auto _ : state) benchmark::DoNotOptimize(ldi::coarsen(g, ldi::orphan_rule::adopt_nearest).parent.data());
}
BENCHMARK(coarsen_photo)->Unit(benchmark::kMillisecond);

}  // namespace
