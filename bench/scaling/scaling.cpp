// Scaling laws: a convolution, its plan, coarsening and components as functions of the number of pixels, the number of layers,
// and the share of irregular pixels, compared with an image. bench/scaling/run.sh draws the plots of bench/scaling/README.md.

#include "bench/support/convolution_case.hpp"
#include "bench/support/cut_graph.hpp"
#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

namespace {

using namespace ldi_bench;

constexpr convolution_shape shape{3, 16, 16};

/// Counters for the plots. `x` is the quantity on the horizontal axis.
void describe(benchmark::State& state, const ldi::graph_view& g, const ldi::convolution_plan& plan, double x) {
    state.counters["x"] = x;
    state.counters["pixels"] = static_cast<double>(g.size());
    state.counters["irregular_percent"] =
        100.0 * static_cast<double>(plan.irregular().size()) / static_cast<double>(plan.output_count());
    state.counters["plan_kB"] = static_cast<double>(plan.bytes()) / 1000;
}

/// Measures operators on one graph, which make() returns: convolutions in float32 and int8, the plan, coarsening, components.
///
/// axis  name of the plot
/// what  name of the line: "ldi" or "image"
/// x     position of the graph on the plot's horizontal axis
template <class Make>
void add_graph(const std::string& axis, const std::string& what, double x, Make make) {
    const std::string prefix = joined("scaling/", axis, "/", what, "/"), place = joined("/", std::to_string(x));
    add(joined(prefix, "float32", place), [=](benchmark::State& state) {
        const ldi::graph g = make();
        const ldi::convolution_plan plan = ldi::plan_convolution(g, shape.kernel_size);
        const ldi::buffer<float> values(g.size() * shape.inputs, 0.5F);
        ldi::buffer<float> result(g.size() * shape.outputs);
        const ldi::conv_f32_weights weights = float_weights(shape, ldi::best_isa());
        const ldi::feature_view source{values, shape.inputs, {}, {}};
        measure(state, pixels_text(g.size()), {.float_products = shape.products(plan)},
                [&] { ldi::convolve(plan, weights, std::span<const ldi::feature_view>(&source, 1), result); });
        describe(state, g, plan, x);
    });
    add(joined(prefix, "int8", place), [=](benchmark::State& state) {
        const ldi::graph g = make();
        const ldi::convolution_plan plan = ldi::plan_convolution(g, shape.kernel_size);
        const ldi::buffer<std::uint8_t> values(g.size() * shape.inputs, std::uint8_t{150});
        ldi::buffer<std::uint8_t> result(g.size() * shape.outputs);
        const ldi::quantized_source quantized{shape.inputs, byte_input};
        const ldi::conv_u8_weights weights = byte_weights(shape, ldi::best_isa(), std::span(&quantized, 1));
        const ldi::basic_feature_view<std::uint8_t> source{values, shape.inputs, {}, {}, byte_input.zero_point};
        measure(state, pixels_text(g.size()), {.int8_products = shape.products(plan)}, [&] {
            ldi::convolve(plan, weights, std::span<const ldi::basic_feature_view<std::uint8_t>>(&source, 1), result);
        });
        describe(state, g, plan, x);
    });
    const auto add_graph_function = [&](const std::string& name, auto function) {
        add(joined(prefix, name, place), [=](benchmark::State& state) {
            const ldi::graph g = make();
            measure(state, pixels_text(g.size()), {.pixels = static_cast<double>(g.size())}, [&] { return function(g); });
            describe(state, g, ldi::plan_convolution(g, shape.kernel_size), x);
        });
    };
    add_graph_function("plan", [](const ldi::graph& g) { return ldi::plan_convolution(g, shape.kernel_size); });
    add_graph_function("coarsen", [](const ldi::graph& g) { return ldi::coarsen(g, ldi::orphan_rule::adopt_nearest); });
    add_graph_function("components", [](const ldi::graph& g) { return ldi::connected_components(g); });
}

/// Adds images with an aspect ratio of 3:4 and 0.1 to 48 megapixels, whole and cut into squares whose sides are an eighth of
/// the short side. The cut images have about as many silhouettes as a photo of objects.
void add_pixels() {
    for (const double megapixels : {0.1, 0.3, 1.0, 3.0, 12.0, 24.0, 48.0}) {
        const auto width = static_cast<std::int32_t>(std::lround(std::sqrt(megapixels * 1e6 * 0.75)));
        const std::int32_t height = width * 4 / 3;
        add_graph("pixels", "image", megapixels, [=] { return cut_graph(width, height, 0); });
        add_graph("pixels", "ldi", megapixels, [=] { return cut_graph(width, height, width / 8); });
    }
}

/// Adds stacks of one to eight images of 512 x 512, one behind the other, and single images with the same number of pixels.
void add_layers() {
    for (std::int32_t layers = 1; layers <= 8; ++layers) {
        add_graph("layers", "ldi", layers, [=] { return stacked_graph(512, 512, layers); });
        add_graph("layers", "image", layers, [=] { return cut_graph(512, 512 * layers, 0); });
    }
}

/// Adds an image of 1152 x 1024, whole and cut into ever smaller squares.
void add_irregular() {
    for (const std::int32_t side : {0, 512, 128, 64, 32, 16, 12, 8, 7, 6, 5})
        add_graph("irregular", "ldi", side, [=] { return cut_graph(1152, 1024, side); });
}

const bool registered = [] {
    add_pixels();
    add_layers();
    add_irregular();
    return true;
}();

}  // namespace
