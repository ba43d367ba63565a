// The depth networks on the sample at 384 x 288: the shipped one, and the published one (6.83 billion multiplications) if
// ../shared has it. Earlier times of peers for the published network, on one thread of an unrecorded machine: QNNPACK 603 ms,
// ONNX Runtime 129 ms, oneDNN 66 ms. tiefenrausch.sh measures ONNX Runtime and oneDNN beside this library.
#include <ldi/io/photo.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <filesystem>
#include <string>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

ldi::image<std::uint8_t> photo() { return ldi::load_photo(LDI_SOURCE_DIR "/examples/photo3d/sample.jpg").color; }

void network(benchmark::State& state, const std::filesystem::path& file) {
    const ldi::tiefenrausch estimator = ldi::load_depth_network(file);
    ldi::thread_pool threads(static_cast<std::size_t>(state.range(0)));
    const ldi::image<std::uint8_t> rgb = ldi::tiefenrausch::resize_for_network(photo(), threads);
    for (auto _ : state) benchmark::DoNotOptimize(estimator.levels(rgb, threads));
    state.SetLabel(std::string(to_string(estimator.target())));
}

void build(benchmark::State& state, const std::filesystem::path& file) {
    for (auto _ : state) benchmark::DoNotOptimize(ldi::load_depth_network(file));
}

void resize(benchmark::State& state) {
    ldi::serial_executor serial;
    const ldi::image<std::uint8_t> from = photo();
    for (auto _ : state) benchmark::DoNotOptimize(ldi::tiefenrausch::resize_for_network(from, serial));
}
BENCHMARK(resize)->Name("area resize 1536x1152 to 384x288")->Unit(benchmark::kMillisecond);

void add(const std::string& name, const std::filesystem::path& file) {
    benchmark::RegisterBenchmark((name + "/network 384x288").c_str(), network, file)
        ->ArgName("threads")
        ->Arg(1)
        ->Arg(2)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
    benchmark::RegisterBenchmark((name + "/read and build").c_str(), build, file)->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    add("tiefenrausch_small", LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors");
    const std::filesystem::path published = LDI_SHARED_DIR "/tiefenrausch/model";
    if (std::filesystem::exists(published)) add("tiefenrausch", published);
    return true;
}();

}  // namespace
