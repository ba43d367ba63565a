// Convolutions on the layered depth image of a real photo, 1152 x 1536 and expanded, beside the same on an image with the same
// number of pixels; and the plans that they share. One thread. Without ../shared, the photo is the sample.
#include <ldi/nn/ldi/convolution.hpp>

#include "bench/support/converted_photo.hpp"

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace {

const ldi::graph& photo() {
    static const ldi::photo3d made = ldi_bench::converted_photo();
    return made.layers.topology();
}

const ldi::coarsened& coarse_photo() {
    static const ldi::coarsened coarse = ldi::coarsen(photo(), ldi::orphan_rule::stay);
    return coarse;
}

/// Makes an image with the same number of pixels, rounded down to whole rows.
const ldi::graph& image() {
    static const ldi::graph g = ldi::make_grid(1152, static_cast<std::int32_t>(photo().size() / 1152));
    return g;
}

ldi::buffer<float> random_floats(std::size_t count) {
    std::mt19937 random(1);
    ldi::buffer<float> values(count);
    for (float& value : values) value = static_cast<float>(random() % 2001) / 1000.0F - 1.0F;
    return values;
}

void plan(benchmark::State& state) {
    const std::int32_t kernel_size = static_cast<std::int32_t>(state.range(0));
    const bool halves = state.range(1) == 2;
    coarse_photo();
    ldi::convolution_plan made;
    for (auto _ : state) {
        made = halves ? ldi::plan_convolution(photo(), kernel_size, coarse_photo()) : ldi::plan_convolution(photo(), kernel_size);
        benchmark::DoNotOptimize(made);
    }
    state.counters["pixels"] = static_cast<double>(photo().size());
    state.counters["segments"] = static_cast<double>(made.segments.size());
    state.counters["irregular_percent"] =
        100.0 * static_cast<double>(made.irregular.size()) / static_cast<double>(made.output_count);
    state.counters["kB"] = static_cast<double>(made.bytes()) / 1024.0;
}
BENCHMARK(plan)
    ->ArgNames({"kernel", "stride"})
    ->Args({3, 1})
    ->Args({3, 2})
    ->Args({5, 2})
    ->Args({7, 2})
    ->Unit(benchmark::kMillisecond);

struct layer {
    std::int32_t kernel_size;
    std::size_t inputs, outputs;
    std::int32_t stride;
    bool on_image, is_partial;
};

void measure(benchmark::State& state, const layer& l, const ldi::graph_view& g, std::span<const ldi::feature_view> sources) {
    const std::size_t elements = static_cast<std::size_t>(l.kernel_size * l.kernel_size);
    const ldi::buffer<float> weights = random_floats(l.outputs * l.inputs * elements), bias = random_floats(l.outputs);
    const ldi::conv_f32_weights packed = ldi::pack_convolution(ldi::best_isa(), weights, bias, l.kernel_size, ldi::relu);
    const ldi::convolution_plan plan =
        l.stride == 2 ? ldi::plan_convolution(g, l.kernel_size, ldi::coarsen(g, ldi::orphan_rule::adopt_nearest))
                      : ldi::plan_convolution(g, l.kernel_size);
    ldi::buffer<float> result(plan.output_count * l.outputs);
    ldi::serial_executor one_thread;
    for (auto _ : state) {
        if (l.is_partial)
            ldi::convolve_partially(plan, packed, sources, result, {}, one_thread);
        else
            ldi::convolve(plan, packed, sources, result, one_thread);
        benchmark::ClobberMemory();
    }
    state.SetLabel(std::string(to_string(packed.target)));
    state.counters["MAC/s"] = benchmark::Counter(static_cast<double>(plan.output_count * l.outputs * l.inputs * elements),
                                                 benchmark::Counter::kIsIterationInvariantRate);
}

void convolution(benchmark::State& state, const layer& l) {
    const ldi::graph& g = l.on_image ? image() : photo();
    const ldi::buffer<float> values = random_floats(g.size() * l.inputs);
    const ldi::feature_view source{values, l.inputs, {}, {}};
    measure(state, l, g, std::span(&source, 1));
}

void masked(benchmark::State& state, const layer& l) {
    const ldi::graph& g = photo();
    const ldi::buffer<float> values = random_floats(g.size() * l.inputs);
    ldi::buffer<std::uint8_t> mask(g.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i / 100 % 10 != 0 ? 1 : 0;
    const ldi::feature_view source{values, l.inputs, {}, mask};
    measure(state, l, g, std::span(&source, 1));
}

/// A decoder stage: a third of the inputs is from this level, the others are upsampled from the coarser level.
void decoder(benchmark::State& state, const layer& l) {
    const ldi::graph& g = photo();
    const std::size_t beside = l.inputs / 3, above = l.inputs - beside;
    const ldi::buffer<float> coarse = random_floats(coarse_photo().kept.size() * above), fine = random_floats(g.size() * beside);
    const ldi::feature_view sources[] = {{coarse, above, coarse_photo().parent, {}}, {fine, beside, {}, {}}};
    measure(state, l, g, sources);
}

const auto registered = [] {
    const auto add = [](const char* name, auto run, const layer& l) {
        benchmark::RegisterBenchmark(name, [=](benchmark::State& state) { run(state, l); })
            ->Unit(benchmark::kMillisecond)
            ->MinTime(0.5);
    };
    add("ldi/3x3 32->32", convolution, {3, 32, 32, 1, false, false});
    add("image/3x3 32->32", convolution, {3, 32, 32, 1, true, false});
    add("ldi/3x3 16->16", convolution, {3, 16, 16, 1, false, false});
    add("image/3x3 16->16", convolution, {3, 16, 16, 1, true, false});
    add("ldi/partial 3x3 32->32", convolution, {3, 32, 32, 1, false, true});
    add("ldi/masked 3x3 32->32", masked, {3, 32, 32, 1, false, true});
    add("ldi/partial 7x7 4->20 stride 2", convolution, {7, 4, 20, 2, false, true});
    add("image/partial 7x7 4->20 stride 2", convolution, {7, 4, 20, 2, true, true});
    add("ldi/partial 5x5 20->40 stride 2", convolution, {5, 20, 40, 2, false, true});
    add("ldi/decoder 3x3 60->20", decoder, {3, 60, 20, 1, false, true});
    add("ldi/decoder 3x3 24->3", decoder, {3, 24, 3, 1, false, true});
    return true;
}();

}  // namespace
