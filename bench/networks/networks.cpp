// The shipped networks on the sample, one thread. Depth: the whole network and each step. Inpainting: the whole network in both
// number formats, its plans, and its smooth fills. Silhouettes: the whole network.

#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/depth/detail/band_input.hpp>
#include <ldi/depth/network_decider.hpp>
#include <ldi/depth/step_band.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/silhouettes.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/nn/dense/quantized_network.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace {

using namespace ldi_bench;

const std::string depth_file = "tiefenrausch_small.safetensors";

const ldi::tiefenrausch& depth_network() {
    static const ldi::tiefenrausch network = ldi::load_depth_network(model_file(depth_file));
    return network;
}
const ldi::image<std::uint8_t>& network_photo() {
    static const ldi::image<std::uint8_t> rgb = [] {
        ldi::serial_executor one_thread;
        return ldi::tiefenrausch::resize_for_network(sample().photo, one_thread);
    }();
    return rgb;
}

double products_of(const ldi::quantized_network::step_description& step) {
    return static_cast<double>(step.dense_products + step.depthwise_products);
}

/// Runs the whole network in each iteration, and reports only the time of step `wanted`.
void depth_step(benchmark::State& state, std::size_t wanted) {
    using clock = std::chrono::steady_clock;
    const ldi::image<std::uint8_t>& rgb = network_photo();
    std::vector<std::byte> memory(depth_network().working_bytes({rgb.height(), rgb.width()}, 1));
    ldi::serial_executor one_thread;
    for (auto _ : state) {
        std::size_t step = 0;
        clock::time_point start = clock::now();
        const auto after_step = [&](float) {
            const clock::time_point now = clock::now();
            if (step++ == wanted) state.SetIterationTime(std::chrono::duration<double>(now - start).count());
            start = now;
        };
        benchmark::DoNotOptimize(depth_network().levels(rgb, one_thread, after_step, memory));
    }
}

void add_depth() {
    for (const ldi::instruction_set& set : ldi::instruction_sets) {
        if (!ldi::is_available(set.id) || set.id == ldi::isa::scalar) continue;
        const ldi::isa target = set.id;
        add("networks/tiefenrausch/levels/" + std::string(to_string(target)), [target](benchmark::State& state) {
            const ldi::tiefenrausch network(ldi::read_quantized_network(ldi::load_safetensors(model_file(depth_file))), target);
            const ldi::image<std::uint8_t>& rgb = network_photo();
            double products = 0;
            for (const auto& step : network.describe_steps({rgb.height(), rgb.width()})) products += products_of(step);
            ldi::serial_executor one_thread;
            measure(state, size_text(rgb.width(), rgb.height()), {.int8_products = products, .set = target},
                    [&] { return network.levels(rgb, one_thread); });
        });
    }
    add("networks/tiefenrausch/disparity of a photo", [](benchmark::State& state) {
        const ldi::image<std::uint8_t>& photo = sample().photo;
        measure(state, size_text(photo.width(), photo.height()), {.pixels = static_cast<double>(photo.size()) / 3},
                [&] { return depth_network().disparity(photo); });
    });
    add("networks/quantized_network/pack", [](benchmark::State& state) {
        const ldi::network_description network = ldi::read_quantized_network(ldi::load_safetensors(model_file(depth_file)));
        measure(state, "depth network", {}, [&] { return ldi::quantized_network(network).layer_count(); });
    });
    add("networks/read_quantized_network", [](benchmark::State& state) {
        const ldi::named_tensors tensors = ldi::load_safetensors(model_file(depth_file));
        measure(state, "depth network", {}, [&] { return ldi::read_quantized_network(tensors).operators.size(); });
    });
    const ldi::image<std::uint8_t> none(384, 288, 3);
    std::size_t number = 0;
    for (const auto& step : depth_network().describe_steps({none.height(), none.width()})) {
        const double products = products_of(step);
        const std::string size = size_text(step.size.width, step.size.height);
        add("steps/tiefenrausch/" + std::string(step.name),
            [number, size, products](benchmark::State& state) {
                depth_step(state, number);
                report_rate(state, {.int8_products = products});
                state.SetLabel(size);
            })
            ->UseManualTime()
            ->Iterations(15);
        ++number;
    }
}

ldi::buffer<std::uint8_t> unknown_of_sample() {
    ldi::buffer<std::uint8_t> unknown;
    for (const std::uint8_t known : sample().uncolored.column<ldi::known_column>()) unknown.push_back(known == 0 ? 1 : 0);
    return unknown;
}

std::string unknown_text() {
    std::size_t count = 0;
    for (const std::uint8_t u : unknown_of_sample()) count += u;
    return pixels_text(sample().uncolored.size()) + ", " + std::to_string(count) + " unknown";
}

void add_inpainting() {
    for (const ldi::arithmetic kind : {ldi::arithmetic::float32, ldi::arithmetic::int8}) {
        const auto load = [kind] { return ldi::load_farbrausch(model_file("farbrausch.safetensors"), kind); };
        add("networks/farbrausch/inpaint, " + std::string(to_string(kind)), [=](benchmark::State& state) {
            const ldi::farbrausch network = load();
            const ldi::buffer<std::uint8_t> unknown = unknown_of_sample();
            measure(state, unknown_text(), {.pixels = static_cast<double>(unknown.size())},
                    [&] { return network.colors(sample().uncolored, unknown); });
        });
        add("networks/farbrausch/read and pack, " + std::string(to_string(kind)), [=](benchmark::State& state) {
            measure(state, "377064 weights", {}, [&] { return load().architecture().channels.size(); });
        });
    }
    static const ldi::farbrausch network = ldi::load_farbrausch(model_file("farbrausch.safetensors"));
    add("networks/farbrausch/plans of all levels", [](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> unknown = unknown_of_sample();
        measure(state, unknown_text(), {.pixels = static_cast<double>(unknown.size())},
                [&] { return ldi::detail::plan_farbrausch(sample_graph(), network.architecture().kernels, unknown).size(); });
    });
    add("networks/farbrausch/smooth fills", [](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> unknown = unknown_of_sample();
        const ldi::working_layers<>& layers = sample().uncolored;
        const ldi::serial_executor one_thread;
        const auto plans = ldi::detail::plan_farbrausch(sample_graph(), network.architecture().kernels, unknown);
        measure_change(state, unknown_text(), {.pixels = static_cast<double>(unknown.size())}, plans, [&](auto& levels) {
            return ldi::detail::smooth_filler(sample_graph(), layers.column<ldi::color_column>(),
                                              layers.column<ldi::known_column>(), levels, network.architecture().growth,
                                              one_thread)
                .run(ldi::detail::farbrausch_input<float>{});
        });
    });
}

/// Returns the input of network_decider for an estimate with a quarter of the photo's resolution.
ldi::undecided_depth undecided() {
    const sample_stages& s = sample();
    return {s.photo, s.estimate, s.filtered, ldi::surface_rule{}, 4.0F};
}

void add_silhouettes() {
    static const ldi::silhouette_network network = ldi::load_silhouettes(model_file("silhouettes.safetensors"));
    add("networks/silhouette_network/logits", [](benchmark::State& state) {
        const ldi::step_band band = ldi::find_step_band(sample().filtered);
        const ldi::buffer<std::uint8_t> input = ldi::detail::band_input(band, undecided());
        ldi::buffer<std::uint8_t> wanted;
        for (std::int32_t i = 0; i < band.region.count(); ++i) wanted.push_back(band.is_decided(i) ? 1 : 0);
        measure(state, pixels_text(band.region.size()), {.pixels = static_cast<double>(band.region.size())},
                [&] { return network.logits(band.region, ldi::buffer<std::uint8_t>(input), wanted); });
    });
    add("networks/silhouette_network/read and pack", [](benchmark::State& state) {
        measure(state, "silhouettes.safetensors", {},
                [&] { return ldi::load_silhouettes(model_file("silhouettes.safetensors")); });
    });
    add("depth/network_decider/decide", [](benchmark::State& state) {
        const ldi::network_decider decider(&network);
        const ldi::serial_executor one_thread;
        const sample_stages& s = sample();
        measure(state, size_text(s.photo.width(), s.photo.height()), {.pixels = static_cast<double>(s.filtered.size())},
                [&] { return decider.decide(undecided(), one_thread).disparity; });
    });
}

const bool registered = [] {
    add_depth();
    add_inpainting();
    add_silhouettes();
    return true;
}();

}  // namespace
