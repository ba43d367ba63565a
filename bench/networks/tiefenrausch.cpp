// The depth network as published, on a real photo at 384 x 288: 6.83 billion multiplications. Peers on one thread of another
// machine: QNNPACK 603 ms, ONNX Runtime 129 ms, oneDNN 66 ms.
#include <ldi/io/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/npy.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

const std::string folder = std::string(LDI_SHARED_DIR) + "/tiefenrausch/";

ldi::image<std::uint8_t> photo() {
    const auto array = ldi::testing::read_npy<std::uint8_t>(folder + "golden/columns_1024x768_rgb.npy");
    ldi::image<std::uint8_t> result(1024, 768, 3, std::uint8_t{0});
    if (array.values.size() == result.size()) std::copy(array.values.begin(), array.values.end(), result.data());
    return result;
}

void network(benchmark::State& state) {
    const auto operators = ldi::testing::read_bytes(folder + "model/tiefenrausch.pb");
    const auto weights = ldi::testing::read_bytes(folder + "model/tiefenrausch_init.pb");
    if (operators.empty()) {
        state.SkipWithError("the published network is absent");
        return;
    }
    const ldi::tiefenrausch estimator(ldi::read_caffe2(operators, weights));
    ldi::thread_pool threads(static_cast<std::size_t>(state.range(0)));
    const ldi::image<std::uint8_t> rgb = ldi::tiefenrausch::resize_for_network(photo(), threads);
    for (auto _ : state) benchmark::DoNotOptimize(estimator.levels(rgb, threads));
    state.SetLabel(std::string(to_string(estimator.target())));
    state.counters["MAC/s"] = benchmark::Counter(6.831e9, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(network)
    ->Name("tiefenrausch/network 384x288")
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void resize(benchmark::State& state) {
    ldi::serial_executor serial;
    const ldi::image<std::uint8_t> from = photo();
    for (auto _ : state) benchmark::DoNotOptimize(ldi::tiefenrausch::resize_for_network(from, serial));
}
BENCHMARK(resize)->Name("tiefenrausch/area resize 1024x768 to 384x288")->Unit(benchmark::kMillisecond);

void build(benchmark::State& state) {
    const auto operators = ldi::testing::read_bytes(folder + "model/tiefenrausch.pb");
    const auto weights = ldi::testing::read_bytes(folder + "model/tiefenrausch_init.pb");
    if (operators.empty()) {
        state.SkipWithError("the published network is absent");
        return;
    }
    for (auto _ : state) benchmark::DoNotOptimize(ldi::tiefenrausch(ldi::read_caffe2(operators, weights)));
}
BENCHMARK(build)->Name("tiefenrausch/read and build")->Unit(benchmark::kMillisecond);

}  // namespace
