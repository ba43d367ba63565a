// Charts, packing and padding at 1152 x 1536, on one thread. The paper's times (iPhone 11 Pro): chart generation 72 ms, chart
// padding 151 ms. bench/photo3d/run.sh measures them on a phone photo; this benchmark measures each part on a scene with many
// silhouettes.

#include "tests/texture/photo_scene.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/texture/atlas.hpp>

#include <benchmark/benchmark.h>

#include <optional>
#include <random>
#include <utility>

namespace {

// A shared photo with many depth edges, else a synthetic scene of the same size.
const ldi::photo_layers& scene() {
    static const ldi::photo_layers layers = [] {
        if (std::optional<ldi::photo_layers> photo = ldi::testing::shared_photo("mb_reindeer", 1536, 1152))
            return *std::move(photo);
        std::mt19937 random(7);
        return ldi::testing::random_scene(random, 1536, 1152);
    }();
    return layers;
}

const ldi::chart_set& charts() {
    static const ldi::chart_set result = ldi::make_charts(scene(), {});
    return result;
}

void report(benchmark::State& state) {
    state.counters["pixels"] = static_cast<double>(scene().size());
    state.counters["charts"] = static_cast<double>(charts().charts.size());
}

void chart_generation(benchmark::State& state) {
    charts();
    for (auto _ : state) benchmark::DoNotOptimize(ldi::make_charts(scene(), {}));
    report(state);
}
BENCHMARK(chart_generation)->Unit(benchmark::kMillisecond);

void chart_padding(benchmark::State& state) {
    charts();
    float fill = 0;
    for (auto _ : state) {
        const ldi::texture_atlas atlas = ldi::make_atlas(scene(), charts());
        fill = atlas.fill;
        benchmark::DoNotOptimize(atlas.color.data());
    }
    report(state);
    state.counters["fill"] = fill;
}
BENCHMARK(chart_padding)->Unit(benchmark::kMillisecond);

void packing(benchmark::State& state) {
    std::mt19937 random(1);
    std::vector<ldi::rectangle_size> sizes;
    for (std::int64_t i = 0; i < state.range(0); ++i) {
        const std::int32_t longest = i % 50 == 0 ? 60 : 6;
        sizes.push_back({1 + ldi::testing::below(random, longest), 1 + ldi::testing::below(random, longest)});
    }
    for (auto _ : state) benchmark::DoNotOptimize(ldi::pack(sizes, 4096));
}
BENCHMARK(packing)->Arg(100)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace
