// Time of each step of the shipped depth network on the sample, and of the published one if ../shared has it. One line per step
// (a block, or a layer outside blocks), named after its result, with its share of the processor's peak multiplication rate,
// measured in the same run.
//
// Every line is the minimum over many runs of the whole network; --benchmark_filter only selects the lines to print.
#include <bench/support/peak_products.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/tiefenrausch_file.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

using seconds = std::chrono::duration<double>;
using std::chrono::steady_clock;

const std::filesystem::path published = LDI_SHARED_DIR "/tiefenrausch/model";  // compared if present

/// Measures the minimum seconds of each step over some runs on one thread.
ldi::buffer<double> measure(const ldi::tiefenrausch& network, const ldi::image<std::uint8_t>& rgb, std::size_t steps) {
    constexpr std::size_t runs = 31;
    ldi::buffer<double> fewest(steps, 1e9);
    std::vector<std::byte> memory(network.working_bytes({rgb.height(), rgb.width()}, 1));
    ldi::serial_executor serial;
    for (std::size_t run = 0; run < runs; ++run) {
        std::size_t step = 0;
        auto start = steady_clock::now();
        const auto after_step = [&](float) {
            fewest[step] = std::min(fewest[step], seconds(steady_clock::now() - start).count());
            ++step;
            start = steady_clock::now();
        };
        network.levels(rgb, serial, after_step, memory);
    }
    return fewest;
}

void report(const std::string& name, double time, double products, double peak) {
    const auto line = [time, products, peak](benchmark::State& state) {
        for (auto _ : state) state.SetIterationTime(time);
        state.counters["MMAC"] = products / 1e6;
        state.counters["GMAC/s"] = products / time / 1e9;
        if (peak > 0) state.counters["share_of_peak"] = products / time / peak;
    };
    benchmark::RegisterBenchmark(name.c_str(), line)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}

void report_steps(const std::string& name, const ldi::tiefenrausch& network, const ldi::image<std::uint8_t>& rgb) {
    const auto steps = network.describe_steps({rgb.height(), rgb.width()});
    const ldi::buffer<double> times = measure(network, rgb, steps.size());
    const double peak = ldi_bench::peak_products(network.target());
    const std::string prefix = name + "/" + std::string(to_string(network.target())) + "/";
    double time = 0, products = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const auto& s = steps[i];
        const double here = static_cast<double>(s.dense_products + s.depthwise_products);
        report(prefix + std::string(s.name) + " " + std::to_string(s.size.height) + "x" + std::to_string(s.size.width), times[i],
               here, peak);
        time += times[i], products += here;
    }
    report(prefix + "all steps", time, products, peak);
}

const bool registered = [] {
    ldi::serial_executor serial;
    const ldi::image<std::uint8_t> sample = ldi::load_photo(LDI_SOURCE_DIR "/examples/photo3d/sample.jpg").color;
    const ldi::image<std::uint8_t> rgb = ldi::tiefenrausch::resize_for_network(sample, serial);
    report_steps("tiefenrausch_small", ldi::load_depth_network(LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors"),
                 rgb);
    if (std::filesystem::exists(published)) report_steps("tiefenrausch", ldi::load_depth_network(published), rgb);
    return true;
}();

}  // namespace
