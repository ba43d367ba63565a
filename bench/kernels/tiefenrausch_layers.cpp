// Kernels of the depth networks, layer by layer, at 384 x 288: the shipped network, and the published one if ../shared has it.
// Each line has the time of a layer whose rows are in the caches, and its share of the processor's peak multiplication rate,
// measured in the same run. Layers of one shape share a line, named after the first. Compare with
// networks/tiefenrausch_steps.cpp, which includes the cost of fetching rows.
#include <bench/support/peak_products.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/caffe2.hpp>
#include <ldi/io/safetensors_file.hpp>
#include <ldi/nn/dense/detail/packed_layer.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>
#include <tests/support/npy.hpp>
#include <tests/support/random_bytes.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

using ldi::detail::packed_layer;

constexpr std::size_t wanted_pixels = 64;  ///< pixels of a layer's result per step, as in the network

struct shape {
    ldi::tensor_size input, output;  ///< stored sizes; a depthwise convolution enlarges its input by `repeat`
    std::size_t input_channels, repeat;
};

/// Some rows of a layer's input, and memory for its result.
struct rows {
    ldi::buffer<std::uint8_t> input, other, result;
    std::size_t row_bytes;

    rows(const shape& s, std::size_t kernel, std::size_t outputs) : row_bytes((s.input.width + kernel) * s.input_channels) {
        ldi::testing::random_bytes random;
        input = random.bytes((kernel + wanted_pixels / s.output.width + 1) * row_bytes + 64);
        other = input;
        result.resize((wanted_pixels + s.output.width) * outputs);
    }
    const std::uint8_t* row(std::size_t y) const { return input.data() + y * row_bytes; }
};

/// Returns the minimum time in seconds of `function` for one of `count` items, over tries of a fraction of a millisecond each.
template <class Function>
double fewest_seconds(std::size_t count, Function&& function) {
    double fewest = std::numeric_limits<double>::max();
    for (int tries = 0; tries < 40; ++tries) {
        std::size_t done = 0;
        const auto start = std::chrono::steady_clock::now();
        std::chrono::duration<double> time{};
        while (time.count() < 2e-4) {
            function();
            done += count;
            time = std::chrono::steady_clock::now() - start;
        }
        fewest = std::min(fewest, time.count() / static_cast<double>(done));
    }
    return fewest;
}

/// Measures the seconds for one row of the result.
double measure(const ldi::detail::dense_layer& layer, const shape& s) {
    rows r(s, layer.kernel, layer.weights.outputs);
    const std::size_t count = layer.kernel == 1 ? (wanted_pixels + s.output.width - 1) / s.output.width : 1;
    const std::uint8_t* segments[ldi::gemm_u8_weights::max_segments] = {};
    for (std::size_t k = 0; k < layer.kernel; ++k) segments[k] = r.row(k);
    return fewest_seconds(count, [&] {
        ldi::gemm_u8(layer.weights, segments, s.input_channels * layer.stride, count * s.output.width, r.result.data());
        benchmark::ClobberMemory();
    });
}

double measure(const ldi::detail::depthwise_layer& layer, const shape& s) {
    rows r(s, 3, layer.weights.channels);
    const std::uint8_t* const window[] = {r.row(0), r.row(1), r.row(2)};
    return fewest_seconds(1, [&] {
        ldi::depthwise_u8(layer.weights, window, s.input.width, s.repeat, r.result.data());
        benchmark::ClobberMemory();
    });
}

double measure(const ldi::detail::addition_layer& layer, const shape& s) {
    rows r(s, 1, s.input_channels);
    return fewest_seconds(1, [&] {
        ldi::add_u8(layer.sum, r.row(0), r.other.data(), s.output.width * s.input_channels, r.result.data());
        benchmark::ClobberMemory();
    });
}

double measure(const ldi::detail::resize_layer&, const shape&) { return 0; }

std::size_t products_of(const ldi::detail::dense_layer& layer, const shape&) {
    return layer.weights.segments * layer.weights.inputs * layer.weights.outputs;
}
std::size_t products_of(const ldi::detail::depthwise_layer& layer, const shape&) { return 9 * layer.weights.channels; }
std::size_t products_of(const ldi::detail::addition_layer&, const shape&) { return 0; }
std::size_t products_of(const ldi::detail::resize_layer&, const shape&) { return 0; }

std::string to_string(const packed_layer& layer, const shape& s) {
    std::string text;
    if (const auto* d = std::get_if<ldi::detail::dense_layer>(&layer.kind)) {
        text = std::to_string(d->kernel) + "x" + std::to_string(d->kernel) + " " + std::to_string(s.input_channels) + " to " +
               std::to_string(layer.channels);
        if (d->stride > 1) text += " stride " + std::to_string(d->stride);
    } else if (const auto* w = std::get_if<ldi::detail::depthwise_layer>(&layer.kind)) {
        text = "depthwise " + std::to_string(layer.channels);
        if (w->weights.stride > 1) text += " stride " + std::to_string(w->weights.stride);
        if (s.repeat > 1) text += " enlarged";
    } else {
        text = "addition " + std::to_string(layer.channels);
    }
    if (layer.values.zero_point == 0) text += " rectified";
    return text + " at " + std::to_string(s.output.height) + "x" + std::to_string(s.output.width);
}

/// Layers of one shape.
struct line {
    std::string first;
    std::size_t layers = 0;
    double seconds = 0, products = 0;  ///< sum over all of them
};

void report(const std::string& name, const line& what, double peak) {
    const auto show = [what, peak](benchmark::State& state) {
        for (auto _ : state) state.SetIterationTime(what.seconds);
        state.counters["layers"] = static_cast<double>(what.layers);
        if (what.products == 0) return;
        state.counters["MMAC"] = what.products / 1e6;
        state.counters["GMAC/s"] = what.products / what.seconds / 1e9;
        if (peak > 0) state.counters["share_of_peak"] = what.products / what.seconds / peak;
    };
    benchmark::RegisterBenchmark(name.c_str(), show)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}

void report_layers(const std::string& network_name, const ldi::network_description& network) {
    const ldi::isa target = ldi::best_isa();
    const double peak = ldi_bench::peak_products(target);

    ldi::buffer<ldi::quantization> values{network.input};
    ldi::buffer<std::size_t> channels{network.input_channels}, repeats{1};
    std::vector<ldi::tensor_size> stored{{384, 288}};  // not enlarged yet where `repeats` is above 1
    std::map<std::string, line> lines;
    line all{"", 0, 0, 0};
    for (const ldi::operator_description& op : network.operators) {
        const packed_layer layer = ldi::detail::pack_layer(target, op, values, channels);
        const std::size_t from = layer.inputs[0];
        const auto* resize = std::get_if<ldi::detail::resize_layer>(&layer.kind);
        const ldi::tensor_size enlarged{stored[from].height * repeats[from], stored[from].width * repeats[from]};
        const shape s{stored[from], ldi::detail::size_after(layer, enlarged), channels[from], repeats[from]};
        values.push_back(op.output);
        channels.push_back(layer.channels);
        stored.push_back(resize == nullptr ? s.output : stored[from]);
        repeats.push_back(resize == nullptr ? 1 : resize->factor);
        if (resize != nullptr) continue;

        line& here = lines[to_string(layer, s)];
        if (here.layers++ == 0) {
            here.first = layer.name;
            here.seconds = std::visit([&](const auto& kind) { return measure(kind, s); }, layer.kind);
            here.seconds *= static_cast<double>(s.output.height);
            here.products = static_cast<double>(std::visit([&](const auto& kind) { return products_of(kind, s); }, layer.kind) *
                                                s.output.height * s.output.width);
        }
    }
    for (auto& [name, here] : lines) {
        here.seconds *= static_cast<double>(here.layers), here.products *= static_cast<double>(here.layers);
        report(network_name + "/" + std::string(to_string(target)) + "/" + here.first + " " + name, here, peak);
        all.layers += here.layers, all.seconds += here.seconds, all.products += here.products;
    }
    report(network_name + "/" + std::string(to_string(target)) + "/all layers", all, peak);
}

const bool registered = [] {
    report_layers(
        "tiefenrausch_small",
        ldi::read_quantized_network(ldi::load_safetensors(LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors")));
    const std::string published = LDI_SHARED_DIR "/tiefenrausch/model/tiefenrausch";
    const auto operators = ldi::testing::read_bytes(published + ".pb"),
               weights = ldi::testing::read_bytes(published + "_init.pb");
    if (!operators.empty()) report_layers("tiefenrausch", ldi::read_caffe2(operators, weights));
    return true;
}();

}  // namespace
