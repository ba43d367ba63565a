// Kernels on cached rows, for each instruction set of this machine: layers of the shipped depth network (bytes) and of the
// inpainting network, each named after its shape. Also the plain functions of include/ldi/kernels: resizing, packing,
// requantization.

#include "bench/support/convolution_case.hpp"
#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"
#include "tests/support/random_bytes.hpp"

#include <ldi/io/weight_files.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/kernels/repeat_pixels_u8.hpp>
#include <ldi/kernels/requantize_float.hpp>
#include <ldi/nn/dense/detail/packed_layer.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <variant>
#include <vector>

namespace {

using namespace ldi_bench;
using ldi::detail::packed_layer;

constexpr std::size_t wanted_pixels = 64;  ///< pixels of a layer's result per call, as in the network

/// Sizes of a layer's input and result, as they are stored. A depthwise convolution first enlarges its input by the factor
/// `repeat`.
struct layer_case {
    ldi::tensor_size input, output;
    std::size_t input_channels, repeat;
};

/// The rows of a layer's input that one call reads, and memory for the result.
struct layer_rows {
    std::size_t row_bytes;
    ldi::buffer<std::uint8_t> input, result;

    layer_rows(const layer_case& c, std::size_t kernel, std::size_t outputs)
        : row_bytes((c.input.width + kernel) * c.input_channels),
          input(random_byte_values((kernel + wanted_pixels / c.output.width + 1) * row_bytes + 64)),
          result((wanted_pixels + c.output.width) * outputs) {}
    const std::uint8_t* row(std::size_t y) const { return input.data() + y * row_bytes; }
};

std::string row_text(std::size_t pixels) { return "row of " + std::to_string(pixels); }

void run_layer(benchmark::State& state, const ldi::detail::dense_layer& layer, const layer_case& c, ldi::isa set) {
    layer_rows r(c, layer.kernel, layer.weights->outputs);
    const std::size_t rows = layer.kernel == 1 ? (wanted_pixels + c.output.width - 1) / c.output.width : 1;
    const std::uint8_t* segments[ldi::gemm_u8_data::max_segments] = {};
    for (std::size_t k = 0; k < layer.kernel; ++k) segments[k] = r.row(k);
    const std::size_t pixels = rows * c.output.width;
    const std::size_t products = pixels * layer.weights->segments * layer.weights->inputs * layer.weights->outputs;
    measure(state, row_text(pixels), {.int8_products = static_cast<double>(products), .set = set},
            [&] { ldi::gemm_u8(layer.weights, segments, c.input_channels * layer.stride, pixels, r.result.data()); });
}

void run_layer(benchmark::State& state, const ldi::detail::depthwise_layer& layer, const layer_case& c, ldi::isa set) {
    layer_rows r(c, 3, layer.weights->channels);
    const std::uint8_t* const window[] = {r.row(0), r.row(1), r.row(2)};
    const std::size_t products = 9 * layer.weights->channels * c.output.width;
    measure(state, row_text(c.output.width), {.int8_products = static_cast<double>(products), .set = set},
            [&] { ldi::depthwise_u8(layer.weights, window, c.input.width, c.repeat, r.result.data()); });
}

void run_layer(benchmark::State& state, const ldi::detail::addition_layer& layer, const layer_case& c, ldi::isa set) {
    layer_rows r(c, 1, c.input_channels);
    const ldi::buffer<std::uint8_t> other = r.input;
    const std::size_t count = c.output.width * c.input_channels;
    measure(state, row_text(c.output.width), {.bytes = 3.0 * static_cast<double>(count), .set = set},
            [&] { ldi::add_u8(layer.sum, r.row(0), other.data(), count, r.result.data()); });
}

void run_layer(benchmark::State&, const ldi::detail::resize_layer&, const layer_case&, ldi::isa) {}

/// Returns a benchmark's name: the kernel, then the layer's shape.
std::string name_of(const packed_layer& layer, const layer_case& c) {
    std::string text;
    if (const auto* d = std::get_if<ldi::detail::dense_layer>(&layer.kind)) {
        const std::string k = std::to_string(d->kernel);
        text = "kernels/gemm_u8/" + k + "x" + k + " " + std::to_string(c.input_channels) + "->" + std::to_string(layer.channels);
        if (d->stride > 1) text += " stride 2";
    } else if (const auto* w = std::get_if<ldi::detail::depthwise_layer>(&layer.kind)) {
        text = "kernels/depthwise_u8/" + std::to_string(layer.channels) + " channels";
        if (w->weights->stride > 1) text += " stride 2";
        if (c.repeat > 1) text += " enlarged";
    } else {
        text = "kernels/add_u8/" + std::to_string(layer.channels) + " channels";
    }
    return text + " at " + std::to_string(c.output.width) + " x " + std::to_string(c.output.height);
}

/// Adds one benchmark per shape of the network's layers at 288 x 384.
void add_network_layers(ldi::isa set) {
    const ldi::network_description network =
        ldi::read_quantized_network(ldi::load_safetensors(model_file("tiefenrausch_small.safetensors")));
    ldi::buffer<ldi::quantization> values{network.input};
    ldi::buffer<std::size_t> channels{network.input_channels}, repeats{1};
    std::vector<ldi::tensor_size> stored{{384, 288}};  // sizes before the enlargement by `repeats`
    std::set<std::string> names;
    for (const ldi::operator_description& op : network.operators) {
        const packed_layer layer = ldi::detail::pack_layer(set, op, values, channels);
        const std::size_t from = layer.inputs[0];
        const auto* resize = std::get_if<ldi::detail::resize_layer>(&layer.kind);
        const ldi::tensor_size enlarged{stored[from].height * repeats[from], stored[from].width * repeats[from]};
        const layer_case c{stored[from], ldi::detail::size_after(layer, enlarged), channels[from], repeats[from]};
        values.push_back(op.output);
        channels.push_back(layer.channels);
        stored.push_back(resize == nullptr ? c.output : stored[from]);
        repeats.push_back(resize == nullptr ? 1 : resize->factor);
        const std::string name = name_of(layer, c);
        if (resize == nullptr && names.insert(name).second)
            add(name + "/" + std::string(to_string(set)), [=](benchmark::State& state) {
                std::visit([&](const auto& kind) { run_layer(state, kind, c, set); }, layer.kind);
            });
    }
}

constexpr std::size_t row_pixels = 288;

template <class Value, class Weights, class Run>
void run_row(benchmark::State& state, const convolution_shape& s, const Weights& weights, const ldi::buffer<Value>& input,
             work done, Run run) {
    const std::size_t k = static_cast<std::size_t>(s.kernel_size), row_values = (row_pixels + k) * s.inputs;
    const Value* rows[15] = {};
    for (std::size_t r = 0; r < k; ++r) rows[r] = input.data() + r * row_values;
    done.set = weights->target;
    measure(state, row_text(row_pixels), done, [&] { run(rows); });
}

void add_convolutions(ldi::isa set) {
    for (const convolution_shape s : {convolution_shape{3, 16, 16}, convolution_shape{3, 32, 32}, convolution_shape{7, 4, 20},
                                      convolution_shape{5, 20, 40}, convolution_shape{3, 60, 20}, convolution_shape{3, 24, 3}}) {
        const std::size_t inputs =
            static_cast<std::size_t>(s.kernel_size) * (row_pixels + static_cast<std::size_t>(s.kernel_size)) * s.inputs;
        const double products = static_cast<double>(row_pixels * s.weights());
        const std::string name = shape_text(s) + "/" + std::string(to_string(set));
        add("kernels/conv_f32/" + name, [=](benchmark::State& state) {
            const ldi::conv_f32_weights weights = float_weights(s, set);
            const ldi::buffer<float> input = random_floats(inputs);
            ldi::buffer<float> result(row_pixels * s.outputs);
            run_row(state, s, weights, input, {.float_products = products}, [&](const float* const* rows) {
                ldi::conv_f32(weights, rows, s.inputs, row_pixels, nullptr, result.data());
            });
        });
        const ldi::quantized_source source{s.inputs, byte_input};
        add("kernels/conv_u8/" + name, [=](benchmark::State& state) {
            const ldi::conv_u8_weights weights = byte_weights(s, set, std::span(&source, 1));
            const ldi::buffer<std::uint8_t> input = random_byte_values(inputs);
            ldi::buffer<std::uint8_t> result(row_pixels * s.outputs);
            run_row(state, s, weights, input, {.int8_products = products}, [&](const std::uint8_t* const* rows) {
                ldi::conv_u8(weights, rows, s.inputs, row_pixels, nullptr, result.data());
            });
        });
    }
}

/// Adds packing for the best instruction set.
void add_packing() {
    constexpr std::size_t inputs = 96, outputs = 96, weights = inputs * outputs;
    const ldi::requantization output = ldi::make_requantization(0.002F, 128);
    add("kernels/pack_gemm_u8/1x1 96->96", [=](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> values = random_byte_values(weights);
        const ldi::buffer<std::int32_t> bias(outputs, 1000);
        measure(state, std::to_string(weights) + " weights", {.bytes = 2.0 * weights},
                [&] { return ldi::pack_gemm_u8(ldi::best_isa(), values, 128, bias, 1, 128, output); });
    });
    add("kernels/pack_depthwise_u8/96 channels", [=](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> values = random_byte_values(9 * outputs);
        const ldi::buffer<std::int32_t> bias(outputs, 1000);
        measure(state, std::to_string(9 * outputs) + " weights", {.bytes = 18.0 * outputs},
                [&] { return ldi::pack_depthwise_u8(ldi::best_isa(), values, 128, bias, 1, 128, output); });
    });
    add("kernels/pack_conv_f32/3x3 32->32", [](benchmark::State& state) {
        const ldi::buffer<float> values = random_floats(9 * 32 * 32), bias = random_floats(32);
        measure(state, "9216 weights", {.bytes = 8.0 * 9216},
                [&] { return ldi::pack_conv_f32(ldi::best_isa(), values, bias, 3, ldi::relu); });
    });
    add("kernels/pack_conv_u8/3x3 32->32", [](benchmark::State& state) {
        const ldi::buffer<std::int8_t> values(9 * 32 * 32, 17);
        const ldi::buffer<std::uint8_t> zero_points(3 * 32, 128);
        const ldi::buffer<float> scales(32, 0.01F), bias(32, 0.5F);
        measure(state, "9216 weights", {.bytes = 2.0 * 9216},
                [&] { return ldi::pack_conv_u8(ldi::best_isa(), values, zero_points, scales, bias, 3, ldi::relu, 10); });
    });
    add("kernels/prepare_add_u8", [](benchmark::State& state) {
        const ldi::quantized_addition sum = ldi::make_quantized_addition(byte_input, byte_input, {0.02F, 128});
        measure(state, "1 addition", {}, [&] { return ldi::prepare_add_u8(ldi::best_isa(), sum); });
    });
}

void add_resizing() {
    add("kernels/area_resize/photo to 288 x 384", [](benchmark::State& state) {
        const ldi::image<std::uint8_t>& photo = sample().photo;
        measure(state, size_text(photo.width(), photo.height()), {.bytes = static_cast<double>(photo.size()) * (1 + 1 / 16.0)},
                [&] { return ldi::area_resize(photo, 384, 288); });
    });
    add("kernels/area_resize/photo to half", [](benchmark::State& state) {
        const ldi::image<std::uint8_t>& photo = sample().photo;
        measure(state, size_text(photo.width(), photo.height()), {.bytes = static_cast<double>(photo.size()) * 1.25},
                [&] { return ldi::area_resize(photo, 768, 576); });
    });
    add("kernels/area_resize_row", [](benchmark::State& state) {
        const ldi::image<std::uint8_t>& photo = sample().photo;
        const ldi::area_weights across = ldi::make_area_weights(1152, 288), down = ldi::make_area_weights(1536, 384);
        ldi::buffer<float> sums;
        ldi::buffer<std::uint8_t> result(std::size_t{3} * 288);
        measure(state, "4 rows of 1152", {.bytes = 3.0 * (4 * 1152 + 288)},
                [&] { ldi::area_resize_row(across, down, 100, photo, sums, result.data()); });
    });
    add("kernels/add_area_row", [](benchmark::State& state) {
        const ldi::area_weights across = ldi::make_area_weights(1152, 288);
        ldi::buffer<float> sums(std::size_t{3} * 288, 0.0F);
        measure(state, "row of 1152", {.bytes = 3.0 * (1152 + 2 * 4 * 288)},
                [&] { ldi::add_area_row(across, sample().photo.row(100), 3, 0.25F, sums.data()); });
    });
    add("kernels/make_area_weights", [](benchmark::State& state) {
        measure(state, "1152 to 288", {.pixels = 1152}, [] { return ldi::make_area_weights(1152, 288); });
    });
    add("kernels/repeat_pixels_u8/16 channels, twice", [](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> row = random_byte_values(std::size_t{16} * 144);
        ldi::buffer<std::uint8_t> result(std::size_t{16} * 288);
        measure(state, "row of 144", {.bytes = 16.0 * (144 + 288)},
                [&] { ldi::repeat_pixels_u8(row.data(), 144, 16, 2, result.data()); });
    });
}

void add_requantization() {
    add("kernels/requantize/integer form", [](benchmark::State& state) {
        const ldi::requantization output = ldi::make_requantization(0.002F, 128);
        ldi::testing::random_bytes random;
        const ldi::buffer<std::int32_t> sums = random.integers(4096, -100000, 100000);
        ldi::buffer<std::uint8_t> result(sums.size());
        measure(state, "4096 sums", {.bytes = 5.0 * 4096}, [&] {
            std::transform(sums.begin(), sums.end(), result.begin(), [&](std::int32_t s) { return ldi::requantize(s, output); });
        });
    });
    add("kernels/find_float_requantization", [](benchmark::State& state) {
        const ldi::requantization output = ldi::make_requantization(0.002F, 128);
        measure(state, "1 scale", {}, [&] { return ldi::find_float_requantization(output); });
    });
    add("kernels/find_unfused_requantization", [](benchmark::State& state) {
        const ldi::requantization output = ldi::make_requantization(0.002F, 128);
        measure(state, "1 scale", {}, [&] { return ldi::find_unfused_requantization(output); });
    });
    add("kernels/add_quantized/integer form", [](benchmark::State& state) {
        const ldi::quantized_addition sum = ldi::make_quantized_addition(byte_input, byte_input, {0.02F, 128});
        const ldi::buffer<std::uint8_t> a = random_byte_values(4096);
        ldi::buffer<std::uint8_t> result(a.size());
        measure(state, "4096 sums", {.bytes = 3.0 * 4096}, [&] {
            std::transform(a.begin() + 1, a.end(), a.begin(), result.begin(),
                           [&](std::uint8_t x, std::uint8_t y) { return ldi::add_quantized(x, y, sum); });
        });
    });
}

const bool registered = [] {
    for (const ldi::isa set : ldi::testing::available_isas()) {
        add_network_layers(set);
        add_convolutions(set);
    }
    add_packing();
    add_resizing();
    add_requantization();
    return true;
}();

}  // namespace
