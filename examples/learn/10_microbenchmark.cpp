// A convolution takes little longer on a layered image than on an image with the same number of pixels. The reason is that a
// layered image consists mostly of rows: linked pixels that are contiguous in memory. Google Benchmark measures the difference.
#include "whole_sample.hpp"

#include <ldi/nn/ldi/convolution_layer.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>

void convolution(benchmark::State& state, const ldi::graph_view& g) {
    constexpr std::size_t channels = 16;
    const ldi::buffer<float> weights(channels * channels * 9, 0.01F), bias(channels, 0.0F);
    const ldi::convolution_layer layer(weights, bias, {.after = ldi::relu});
    const ldi::convolution_plan plan = ldi::plan_convolution(g, 3);  // once per graph, for all layers of this kernel size
    ldi::feature_map input(g.size(), channels);
    std::fill(input.values.begin(), input.values.end(), 1.0F);
    for (auto _ : state) benchmark::DoNotOptimize(layer(plan, input));
    state.counters["pixels/s"] = benchmark::Counter(static_cast<double>(g.size()), benchmark::Counter::kIsIterationInvariantRate);
    state.counters["gathered windows, %"] = 100.0 * static_cast<double>(plan.irregular().size()) / static_cast<double>(g.size());
}

void plan(benchmark::State& state, const ldi::graph_view& g) {
    for (auto _ : state) benchmark::DoNotOptimize(ldi::plan_convolution(g, 3));
}

int main(int count, char** arguments) {
    const ldi::photo_layers layers = learn::layers_of(learn::load_sample(learn::everything, 2), 50);
    const ldi::graph& layered = layers.topology();
    const ldi::graph image = ldi::make_grid(layered.width(), layered.count() / layered.width());
    benchmark::RegisterBenchmark("layered image/3x3 16->16", convolution, layered)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("image/3x3 16->16", convolution, image)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("layered image/plan", plan, layered)->Unit(benchmark::kMillisecond);
    benchmark::Initialize(&count, arguments);
    benchmark::RunSpecifiedBenchmarks();
}
