#include <ldi/io/weight_files.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>

#include "tests/networks/reference_farbrausch.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>

#ifndef LDI_SOURCE_DIR
#define LDI_SOURCE_DIR "."
#endif

using namespace ldi;

namespace {

serial_executor one_thread;

const std::filesystem::path folder = std::filesystem::path(LDI_SOURCE_DIR) / "tests/networks/files";

/// Weights that tests/networks/files/farbrausch.py also computes: a hash of their index.
buffer<float> hashed(std::uint64_t tensor_index, std::size_t count, double spread) {
    buffer<float> values(count);
    for (std::uint64_t n = 0; n < count; ++n) {
        std::uint64_t h = (n * 2654435761U + tensor_index * 40503U + 12345U) & 0xFFFFFFFFU;
        h ^= h >> 15;
        h = (h * 2246822519U) & 0xFFFFFFFFU;
        h ^= h >> 13;
        values[static_cast<std::size_t>(n)] = static_cast<float>((static_cast<double>(h) / 2147483648.0 - 1.0) * spread);
    }
    return values;
}

/// Calls visit(name, level, stride, kernel size, inputs, outputs) for every layer.
template <class Visit>
void for_each_layer(const inpainting_architecture& a, Visit&& visit) {
    const std::size_t depth = a.channels.size();
    for (std::size_t i = 0; i < depth; ++i)
        visit("encoder." + std::to_string(i), i, std::size_t{2}, static_cast<std::size_t>(a.kernels[i]), a.inputs(i),
              a.channels[i]);
    for (std::size_t i = depth; i-- > 0;)
        visit("decoder." + std::to_string(depth - 1 - i), i, std::size_t{1}, std::size_t{3}, a.channels[i] + a.inputs(i),
              i == 0 ? std::size_t{3} : a.inputs(i));
}

named_tensors hashed_weights(const inpainting_architecture& a) {
    named_tensors weights;
    std::uint64_t index = 0;
    for_each_layer(
        a, [&](const std::string& name, std::size_t, std::size_t, std::size_t k, std::size_t inputs, std::size_t outputs) {
            const double fan_in = static_cast<double>(inputs * k * k);
            weights.tensors[name + ".weight"] = {{outputs, inputs, k, k},
                                                 hashed(index++, outputs * inputs * k * k, 2.0 / std::sqrt(fan_in))};
            weights.tensors[name + ".bias"] = {{outputs}, hashed(index++, outputs, 0.1)};
        });
    return weights;
}

/// Adds the ranges that 8-bit arithmetic requires, wide enough for random layers.
named_tensors ranged(named_tensors weights, const inpainting_architecture& a) {
    const auto add = [&](const std::string& name) { weights.tensors[name + ".range"] = {{2}, buffer<float>{-4.0F, 4.0F}}; };
    add("input");
    for (std::size_t i = 0; i < a.channels.size(); ++i) {
        add("encoder." + std::to_string(i));
        if (i > 0) add("decoder." + std::to_string(i - 1));
    }
    return weights;
}

const inpainting_architecture small{{4, 5, 6}, {7, 5, 3}, 2, 0.2F};

/// Has as many levels as the full-size PartialConv. A small layered image has no pixels on the coarsest levels.
const inpainting_architecture small_masked{{3, 4, 5, 4, 3, 4, 5, 4}, {7, 5, 5, 3, 3, 3, 3, 3}, 0, 0.2F, missing_colors::masked};

/// An image with holes, which is PyTorch's input, and PyTorch's output.
struct golden_case {
    photo_layers layers;
    buffer<float> output;      ///< at unknown pixels
    buffer<float> fill, tone;  ///< at all pixels; may be empty
};

golden_case read_case(const std::string& name, const std::string& network = "farbrausch") {
    const named_tensors file = load_safetensors(folder / (network + "_" + name + ".safetensors"));
    const buffer<std::size_t> shape = file.tensors.at("image").shape;
    const buffer<std::uint8_t>&image = tensor_values<std::uint8_t>(file, "image", shape),
          &known = tensor_values<std::uint8_t>(file, "known", {shape[1], shape[2]}),
          &exists = tensor_values<std::uint8_t>(file, "exists", {shape[1], shape[2]});
    buffer<std::int32_t> order;
    for (std::size_t i = 0; i < exists.size(); ++i)
        if (exists[i] != 0) order.push_back(static_cast<std::int32_t>(i));
    const std::size_t count = order.size();
    golden_case result{
        photo_layers(make_grid(static_cast<std::int32_t>(shape[2]), static_cast<std::int32_t>(shape[1]))), {}, {}, {}};
    result.layers.keep(exists);
    std::size_t holes = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t p = static_cast<std::size_t>(order[i]);
        result.layers.column<known_column>()[i] = known[p];
        if (known[p] == 0) ++holes;
        for (std::size_t c = 0; c < 3; ++c) result.layers.column<color_column>()[3 * i + c] = image[c * shape[1] * shape[2] + p];
    }
    result.output = tensor_values<float>(file, "output", {holes, 3});
    if (file.tensors.contains("fill")) {
        result.fill = tensor_values<float>(file, "fill", {count, 3});
        result.tone = tensor_values<float>(file, "tone", {count, 3});
    }
    return result;
}

/// Waves of color and an edge, and two unknown regions.
photo_layers smooth_picture() {
    photo_layers layers(make_grid(128, 96));
    for (std::size_t y = 0; y < 96; ++y)
        for (std::size_t x = 0; x < 128; ++x) {
            const std::size_t i = 128 * y + x;
            const double fx = static_cast<double>(x), fy = static_cast<double>(y), edge = 2 * x + y > 150 ? 70.0 : 0.0;
            for (std::size_t c = 0; c < 3; ++c)
                layers.column<color_column>()[3 * i + c] = static_cast<std::uint8_t>(
                    90.0 + edge + 30.0 * std::sin(fx / 23.0 + static_cast<double>(c)) + 20.0 * std::cos(fy / 7.0 - fx / 11.0));
            const bool is_hidden = (x > 40 && x < 62 && y > 20 && y < 80) || (x > 100 && y > 70);
            layers.column<known_column>()[i] = is_hidden ? 0 : 1;
        }
    return layers;
}

buffer<std::uint8_t> unknown_of(const photo_layers& layers) {
    buffer<std::uint8_t> wanted;
    for (const std::uint8_t k : layers.column<known_column>()) wanted.push_back(k == 0 ? 1 : 0);
    return wanted;
}

buffer<float> run(const farbrausch& network, const photo_layers& layers) {
    return network.colors(layers, unknown_of(layers), {}, one_thread);
}

template <class A, class B>
double largest_difference(const A& a, const B& b) {
    REQUIRE(a.size() == b.size());
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        largest = std::max(largest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
    return largest;
}

/// Maximum error relative to the largest of `expected`, or to 1.
template <class A, class B>
double largest_relative_difference(const A& a, const B& expected) {
    double largest = 1.0;
    for (const auto value : expected) largest = std::max(largest, std::abs(static_cast<double>(value)));
    return largest_difference(a, expected) / largest;
}

/// PSNR of colors clamped to [0, 1], in dB.
double peak_signal_to_noise(const buffer<float>& a, const buffer<float>& b) {
    REQUIRE(a.size() == b.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += std::pow(double{std::clamp(a[i], 0.0F, 1.0F)} - double{std::clamp(b[i], 0.0F, 1.0F)}, 2.0);
    return -10.0 * std::log10(sum / static_cast<double>(a.size()));
}

testing::reference_result reference(const named_tensors& weights, const inpainting_architecture& a, const photo_layers& layers) {
    buffer<double> color;
    for (const std::uint8_t c : layers.column<color_column>()) color.push_back(c / 255.0);
    return testing::reference_farbrausch(weights, a).run(layers.topology(), color, layers.column<known_column>());
}

/// A random layered image with some unknown pixels.
photo_layers random_layers(std::mt19937& random, std::int32_t side) {
    photo_layers layers(testing::random_graph(random, side).topology());
    for (std::uint8_t& c : layers.column<color_column>()) c = static_cast<std::uint8_t>(testing::below(random, 256));
    const std::int32_t percent = testing::below(random, 101);
    for (std::uint8_t& k : layers.column<known_column>()) k = testing::chance(random, percent) ? 1 : 0;
    return layers;
}

/// Selects the rows of `all` (three values per pixel) of marked pixels.
template <class Value>
buffer<Value> rows_of(const buffer<Value>& all, const buffer<std::uint8_t>& marks) {
    buffer<Value> result;
    for (std::size_t i = 0; i < marks.size(); ++i)
        if (marks[i] != 0)
            result.insert(result.end(), all.begin() + static_cast<std::ptrdiff_t>(3 * i),
                          all.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    return result;
}

}  // namespace

TEST_CASE("on images with holes, the network matches PyTorch") {
    const farbrausch few = load_farbrausch(folder / "farbrausch_weights.safetensors");
    CHECK(few.architecture().channels == buffer<std::size_t>{6, 8, 10, 12, 14});
    CHECK(few.architecture().kernels == buffer<std::int32_t>{7, 5, 5, 3, 3});
    const golden_case whole = read_case("whole"), cut = read_case("cut"), large = read_case("large");
    CHECK(largest_difference(run(few, whole.layers), whole.output) < 1e-4);
    CHECK(largest_difference(run(few, cut.layers), cut.output) < 1e-4);
    const farbrausch all(hashed_weights({}));
    CHECK(largest_difference(run(all, large.layers), large.output) < 1e-4);
}

TEST_CASE("the reference implementation of these tests matches PyTorch") {
    const golden_case cut = read_case("cut");
    const named_tensors weights = load_safetensors(folder / "farbrausch_weights.safetensors");
    const auto expected = reference(weights, {{6, 8, 10, 12, 14}, {7, 5, 5, 3, 3}, 4, 0.2F}, cut.layers);
    CHECK(largest_difference(expected.fill, cut.fill) < 1e-5);
    CHECK(largest_difference(expected.tone, cut.tone) < 1e-5);
    CHECK(largest_difference(rows_of(expected.output, unknown_of(cut.layers)), cut.output) < 1e-4);
}

TEST_CASE("two surfaces in one layered image are inpainted as if each were alone") {
    const farbrausch network = load_farbrausch(folder / "farbrausch_weights.safetensors");
    const golden_case a = read_case("whole"), b = read_case("cut");
    const graph &first = a.layers.topology(), &second = b.layers.topology();
    testing::sketched_graph both(std::max(first.width(), second.width()), std::max(first.height(), second.height()));
    for (const graph* g : {&first, &second}) {
        const std::int32_t shift = both.count();
        for (std::int32_t i = 0; i < g->count(); ++i) both.add_pixel(g->x()[i], g->y()[i]);
        for (const side s : {side::right, side::down})
            for (std::int32_t i = 0; i < g->count(); ++i)
                if (g->neighbor(i, s) != no_pixel) both.link(shift + i, s, shift + g->neighbor(i, s));
    }
    photo_layers layers{graph(both)};
    std::copy(b.layers.column<color_column>().begin(), b.layers.column<color_column>().end(),
              std::copy(a.layers.column<color_column>().begin(), a.layers.column<color_column>().end(),
                        layers.column<color_column>().begin()));
    std::copy(b.layers.column<known_column>().begin(), b.layers.column<known_column>().end(),
              std::copy(a.layers.column<known_column>().begin(), a.layers.column<known_column>().end(),
                        layers.column<known_column>().begin()));
    const buffer<std::int32_t> order = canonical_order(both);
    layers.reorder(order);

    const buffer<float> result = run(network, layers);
    buffer<float> of_a(a.output.size()), of_b(b.output.size());
    buffer<std::size_t> place;  // per pixel of both images: its number among the unknown pixels of its own image
    std::size_t count_a = 0, count_b = 0;
    for (const std::uint8_t k : a.layers.column<known_column>()) place.push_back(k == 0 ? count_a++ : 0);
    for (const std::uint8_t k : b.layers.column<known_column>()) place.push_back(k == 0 ? count_b++ : 0);
    std::size_t next = 0;
    for (const std::int32_t from : order) {
        const std::size_t i = static_cast<std::size_t>(from);
        const bool is_a = from < first.count();
        const std::uint8_t known =
            is_a ? a.layers.column<known_column>()[i] : b.layers.column<known_column>()[i - a.layers.size()];
        if (known != 0) continue;
        for (std::size_t c = 0; c < 3; ++c) (is_a ? of_a : of_b)[3 * place[i] + c] = result[next++];
    }
    CHECK(largest_difference(of_a, a.output) < 1e-4);
    CHECK(largest_difference(of_b, b.output) < 1e-4);
}

TEST_CASE("on random layered images, the network matches the reference implementation") {
    const named_tensors weights = hashed_weights(small);
    const farbrausch network(weights, small);
    std::mt19937 random(60);
    for (int i = 0; i < 150; ++i) {
        const photo_layers layers = random_layers(random, 24);
        const auto expected = reference(weights, small, layers);
        REQUIRE(largest_difference(run(network, layers), rows_of(expected.output, unknown_of(layers))) < 1e-4);
    }
}

TEST_CASE("full-size PartialConv has the paper's 32.85 million weights and 37.97 billion multiplications at 512 x 512") {
    std::size_t weights = 0, biases = 0;
    std::uint64_t multiplications = 0;
    for_each_layer(partial_convolution_architecture(), [&](const std::string&, std::size_t level, std::size_t stride,
                                                           std::size_t k, std::size_t inputs, std::size_t outputs) {
        const std::size_t side = (std::size_t{512} >> level) / stride;
        weights += outputs * inputs * k * k, biases += outputs;
        multiplications += std::uint64_t{side * side} * (outputs * inputs * k * k);
    });
    CHECK(weights == 32'848'849);
    CHECK(biases == 5'507);
    CHECK(multiplications == 37'972'344'832);
}

TEST_CASE("PartialConv matches PyTorch with few and with all channels, even if a level has one pixel or none") {
    const std::filesystem::path weights = folder / "partial_convolution_weights.safetensors";
    const farbrausch few = load_farbrausch(weights);
    CHECK(few.architecture().missing == missing_colors::masked);
    for (const char* const name : {"whole", "cut"}) {
        const golden_case c = read_case(name, "partial_convolution");
        const auto exact = reference(load_safetensors(weights), few.architecture(), c.layers);
        CHECK(largest_relative_difference(rows_of(exact.output, unknown_of(c.layers)), c.output) < 1e-5);
        CHECK(largest_relative_difference(run(few, c.layers), c.output) < 1e-4);
    }
    const inpainting_architecture full = partial_convolution_architecture();
    const golden_case c = read_case("full", "partial_convolution");
    CHECK(largest_relative_difference(run(farbrausch(hashed_weights(full), full), c.layers), c.output) < 1e-5);
}

TEST_CASE("on random layered images, inpainting of masked colors matches the reference implementation") {
    const named_tensors weights = hashed_weights(small_masked);
    const farbrausch network(weights, small_masked);
    std::mt19937 random(68);
    for (int i = 0; i < 100; ++i) {
        const photo_layers layers = random_layers(random, 24);
        const auto expected = reference(weights, small_masked, layers);
        REQUIRE(largest_relative_difference(run(network, layers), rows_of(expected.output, unknown_of(layers))) < 1e-5);
        const buffer<float> all = network.colors(layers, buffer<std::uint8_t>(layers.size(), 1), {}, one_thread);
        REQUIRE(run(network, layers) == rows_of(all, unknown_of(layers)));
    }
}

TEST_CASE("8-bit arithmetic inpaints masked colors approximately like float32") {
    const named_tensors weights = ranged(hashed_weights(small_masked), small_masked);
    const photo_layers layers = smooth_picture();
    const buffer<float> exact = run(farbrausch(hashed_weights(small_masked), small_masked), layers);
    const auto typical_difference = [&](const buffer<float>& values) {
        double sum = 0.0, scale = 0.0;
        for (std::size_t i = 0; i < exact.size(); ++i)
            sum += std::pow(double{values[i]} - double{exact[i]}, 2.0), scale += std::pow(double{exact[i]}, 2.0);
        return std::sqrt(sum / scale);
    };
    CHECK(typical_difference(run(farbrausch(weights, small_masked, arithmetic::int8), layers)) < 0.2);
}

TEST_CASE("values of masked colors have no effect, and a surface whose pixels are all masked becomes black") {
    const farbrausch network(hashed_weights(small_masked), small_masked);
    std::mt19937 random(69);
    photo_layers layers = random_layers(random, 24);
    const buffer<float> before = run(network, layers);
    for (std::size_t i = 0; i < layers.size(); ++i)
        if (layers.column<known_column>()[i] == 0) layers.column<color_column>()[3 * i] ^= 255;
    CHECK(run(network, layers) == before);
    for (std::uint8_t& k : layers.column<known_column>()) k = 0;
    const buffer<float> nothing = run(network, layers);
    CHECK(std::all_of(nothing.begin(), nothing.end(), [](float v) { return v == 0.0F; }));
}

TEST_CASE("a network built from the public operators returns the same colors as farbrausch") {
    const named_tensors weights = hashed_weights(small);
    const std::size_t depth = small.channels.size();
    const auto layer = [&](const std::string& name, std::int32_t kernel_size, activation after) {
        const auto values = [&](const char* kind) -> const buffer<float>& {
            return std::get<buffer<float>>(weights.tensors.at(name + kind).values);
        };
        return convolution_layer(values(".weight"), values(".bias"),
                                 {.kernel_size = kernel_size, .after = after, .is_partial = true});
    };
    std::mt19937 random(67);
    for (int i = 0; i < 50; ++i) {
        const photo_layers layers = random_layers(random, 24);
        const auto expected = reference(weights, small, layers);
        buffer<feature_map> encoded{feature_map(layers.size(), 4)};
        for (std::int32_t p = 0; p < static_cast<std::int32_t>(layers.size()); ++p) {
            for (std::int32_t c = 0; c < 3; ++c)
                encoded[0].at(p)[static_cast<std::size_t>(c)] =
                    static_cast<float>(expected.fill[3 * p + c] - expected.tone[3 * p + c]);
            encoded[0].at(p)[3] = layers.column<known_column>()[p];
        }
        buffer<graph> graphs{layers.topology()};
        buffer<coarsened> next;
        for (std::size_t l = 0; l < depth; ++l) {
            next.push_back(coarsen(graphs[l]));
            graphs.push_back(next[l].topology);
            encoded.push_back(layer("encoder." + std::to_string(l), small.kernels[l], relu)(
                plan_convolution(graphs[l], small.kernels[l], next[l].map), encoded[l]));
        }
        feature_map decoded = encoded[depth];
        for (std::size_t l = depth; l-- > 0;)
            decoded = layer("decoder." + std::to_string(depth - 1 - l), 3, l == 0 ? no_activation : leaky_relu(small.leak))(
                plan_convolution(graphs[l], 3), {upsample(decoded, next[l].map), encoded[l]});
        buffer<double> output;
        for (std::size_t v = 0; v < decoded.values.size(); ++v) output.push_back(expected.fill[v] + double{decoded.values[v]});
        REQUIRE(largest_difference(output, expected.output) < 1e-4);
    }
}

TEST_CASE("requesting fewer pixels does not change the bits of the requested ones") {
    const farbrausch network(hashed_weights(small), small);
    std::mt19937 random(61);
    for (int i = 0; i < 150; ++i) {
        const photo_layers layers = random_layers(random, 40);
        const buffer<float> all = network.colors(layers, buffer<std::uint8_t>(layers.size(), 1), {}, one_thread);
        REQUIRE(run(network, layers) == rows_of(all, unknown_of(layers)));
    }
}

TEST_CASE("inpainting returns the same bits on any number of threads") {
    const farbrausch network(hashed_weights(small), small);
    thread_pool threads(3);
    std::mt19937 random(62);
    for (int i = 0; i < 20; ++i) {
        const photo_layers layers = random_layers(random, 60);
        REQUIRE(run(network, layers) == network.colors(layers, unknown_of(layers), {}, threads));
    }
}

TEST_CASE("an image is inpainted like a single layer, and its known pixels stay unchanged") {
    const farbrausch network = load_farbrausch(folder / "farbrausch_weights.safetensors");
    const golden_case whole = read_case("whole");
    const std::size_t h = static_cast<std::size_t>(whole.layers.topology().height()),
                      w = static_cast<std::size_t>(whole.layers.topology().width());
    image<std::uint8_t> color(h, w, 3), known = image<std::uint8_t>(h, w);
    std::copy(whole.layers.column<color_column>().begin(), whole.layers.column<color_column>().end(), color.begin());
    std::copy(whole.layers.column<known_column>().begin(), whole.layers.column<known_column>().end(), known.begin());
    const image<std::uint8_t> result = network.inpaint(color, known, {}, one_thread);
    std::size_t next = 0;
    for (std::size_t i = 0; i < h * w; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint8_t value = result.data()[3 * i + c];
            if (known.data()[i] != 0) {
                REQUIRE(value == color.data()[3 * i + c]);
            } else {
                const float expected = 255.0F * std::clamp(whole.output[next++], 0.0F, 1.0F);
                REQUIRE(std::abs(static_cast<float>(value) - expected) < 0.6F);
            }
        }
}

TEST_CASE("an image without unknown pixels stays unchanged, and one without known pixels matches the reference implementation") {
    const farbrausch network(hashed_weights(small), small);
    photo_layers layers(make_grid(9, 7));
    std::fill(layers.column<known_column>().begin(), layers.column<known_column>().end(), std::uint8_t{1});
    for (std::uint8_t& c : layers.column<color_column>()) c = 77;
    network.inpaint(layers, {}, one_thread);
    CHECK(std::all_of(layers.column<color_column>().begin(), layers.column<color_column>().end(), [](int c) { return c == 77; }));

    photo_layers none;
    network.inpaint(none, {}, one_thread);

    std::fill(layers.column<known_column>().begin(), layers.column<known_column>().end(), std::uint8_t{0});
    const auto expected = reference(hashed_weights(small), small, layers);
    CHECK(largest_difference(run(network, layers), expected.output) < 1e-4);
}

TEST_CASE(
    "the shipped network's 8-bit colors have a PSNR above 45 dB relative to float32, and are the same on every instruction set") {
    const std::filesystem::path weights = std::filesystem::path(LDI_SOURCE_DIR) / "examples/models/farbrausch.safetensors";
    const photo_layers layers = smooth_picture();
    const buffer<float> exact = run(load_farbrausch(weights), layers);
    const buffer<float> of_bytes = run(load_farbrausch(weights, arithmetic::int8), layers);
    CHECK((run(load_farbrausch(weights, std::nullopt), layers) == of_bytes));
    CHECK(peak_signal_to_noise(of_bytes, exact) > 45.0);
    for (const instruction_set& set : instruction_sets) {
        INFO(set.name);
        if (!is_available(set.id)) continue;
        CHECK((run(decode_farbrausch(read_file(weights), "weights", arithmetic::int8, set.id), layers) == of_bytes));
    }
}

TEST_CASE("with 8-bit arithmetic, requesting fewer pixels does not change the bits of the requested ones") {
    std::mt19937 random(63);
    std::vector<farbrausch> networks;
    for (const inpainting_architecture& a : {small, small_masked})
        networks.emplace_back(ranged(hashed_weights(a), a), a, arithmetic::int8);
    for (const farbrausch& network : networks)
        for (int i = 0; i < 30; ++i) {
            const photo_layers layers = random_layers(random, 40);
            const buffer<float> all = network.colors(layers, buffer<std::uint8_t>(layers.size(), 1), {}, one_thread);
            REQUIRE(run(network, layers) == rows_of(all, unknown_of(layers)));
        }
}

TEST_CASE("8-bit arithmetic requires valid ranges, and the error for a missing range names export.py") {
    named_tensors weights = hashed_weights(small);
    weights.where = "some file";
    const auto construct = [&] { farbrausch(weights, small, arithmetic::int8); };
    CHECK_THROWS_WITH(construct(),
                      Catch::Contains("some file, ") && Catch::Contains("no tensor input.range") && Catch::Contains("export.py"));
    weights = ranged(weights, small);
    CHECK_NOTHROW(construct());
    CHECK_NOTHROW(farbrausch(weights, small));
    for (const auto& ends : {buffer<float>{1.0F, 2.0F}, {-2.0F, -1.0F}, {0.0F, 0.0F}, {0.0F, 1e-40F}}) {
        weights.tensors["decoder.1.range"] = {{2}, ends};
        CHECK_THROWS_WITH(construct(), Catch::Contains("decoder.1.range") && Catch::Contains("a range that contains 0"));
    }
    weights.tensors["decoder.1.range"] = {{1}, buffer<float>{1.0F}};
    CHECK_THROWS_WITH(construct(), Catch::Contains("decoder.1.range") && Catch::Contains("expected float, 2"));
    weights = ranged(hashed_weights(small), small);
    weights.tensors["decoder.2.range"] = {{2}, buffer<float>{0.0F, 1.0F}};
    CHECK_THROWS_WITH(construct(), Catch::Contains("decoder.2.range"));
}

TEST_CASE("inpainting reports progress that never decreases, and stops on request") {
    const farbrausch network(hashed_weights(small), small);
    photo_layers layers(make_grid(20, 20));
    struct state {
        buffer<float> fractions;
        std::size_t stop_after;
    } s{{}, 1000};
    progress_listener watcher;
    watcher.user = &s;
    watcher.on_progress = [](void* user, std::string_view stage, float fraction) {
        CHECK(stage == "color inpainting");
        static_cast<state*>(user)->fractions.push_back(fraction);
    };
    watcher.is_canceled = [](void* user) {
        const state& now = *static_cast<state*>(user);
        return now.fractions.size() >= now.stop_after;
    };
    network.inpaint(layers, watcher, one_thread);
    CHECK(std::is_sorted(s.fractions.begin(), s.fractions.end()));
    CHECK(s.fractions.back() <= 1.0F);
    const std::size_t reports = s.fractions.size();
    for (s.stop_after = 1; s.stop_after <= reports; ++s.stop_after) {
        s.fractions.clear();
        CHECK_THROWS_AS(network.inpaint(layers, watcher, one_thread), error);
        CHECK(s.fractions.size() == s.stop_after);
    }
}

TEST_CASE("unsuitable weights and architectures are refused, and the error states the cause") {
    const named_tensors good = hashed_weights(small);
    const auto complaint = [](const named_tensors& weights, const inpainting_architecture& a) {
        return testing::message_of([&] { farbrausch(weights, a); });
    };
    CHECK(complaint(good, small) == "nothing raised");
    for (const auto& [name, values] : good.tensors) {
        named_tensors weights = good;
        weights.tensors.erase(name);
        CHECK_THAT(complaint(weights, small), Catch::Contains("tensor " + name) && Catch::Contains("no such tensor"));
        weights.tensors[name] = {{1}, buffer<float>{0.0F}};
        CHECK_THAT(complaint(weights, small), Catch::Contains("tensor " + name) && Catch::Contains("found float, 1"));
        weights.tensors[name] = {values.shape, buffer<std::int8_t>(std::get<0>(values.values).size())};
        CHECK_THAT(complaint(weights, small), Catch::Contains("tensor " + name) && Catch::Contains("found int8"));
        weights.tensors[name] = values;
        std::get<0>(weights.tensors[name].values).back() = std::numeric_limits<float>::infinity();
        CHECK_THAT(complaint(weights, small), Catch::Contains("tensor " + name) && Catch::Contains("finite"));
    }
    named_tensors more = good;
    more.tensors["encoder.9.weight"] = {{}, buffer<float>{1.0F}};
    CHECK_THAT(complaint(more, small), Catch::Contains("encoder.9.weight"));

    CHECK_THAT(complaint(good, {{}, {}, 4, 0.2F}), Catch::Contains("channels"));
    CHECK_THAT(complaint(good, {{4, 5, 6}, {7, 5}, 4, 0.2F}), Catch::Contains("kernels"));
    CHECK_THAT(complaint(good, {{4, 5, 6}, {7, 4, 3}, 4, 0.2F}), Catch::Contains("kernels") && Catch::Contains("found 4"));
    CHECK_THAT(complaint(good, {{4, 0, 6}, {7, 5, 3}, 4, 0.2F}), Catch::Contains("channels"));
    CHECK_THAT(complaint(good, {{4, 5, 6}, {7, 5, 3}, -1, 0.2F}), Catch::Contains("growth"));
    CHECK_THAT(complaint(good, {{4, 5, 6}, {7, 5, 3}, 4, -1e-30F}), Catch::Contains("leak") && Catch::Contains("found -1e-30"));
}

TEST_CASE("a moved-from network refuses to inpaint") {
    farbrausch network(hashed_weights(small), small);
    const farbrausch moved = std::move(network);
    const photo_layers layers(make_grid(8, 8));
    const buffer<std::uint8_t> wanted(64, std::uint8_t{1});
    CHECK_NOTHROW(moved.colors(layers, wanted));
    CHECK(testing::raised([&] { network.colors(layers, wanted); }) == error_code::mismatch);  // NOLINT(bugprone-use-after-move)
}

TEST_CASE("inpainting refuses images, masks and flags of requested pixels that do not match in size or channels") {
    const farbrausch network(hashed_weights(small), small);
    const image<std::uint8_t> color(64, 64, 3), known(8, 64, 1, std::uint8_t{1}), narrow(64, 8), gray(64, 64), rgb(64, 64, 3);
    for (const auto* const mask : {&known, &narrow, &rgb})
        CHECK(testing::raised([&] { network.inpaint(color, *mask); }) == error_code::mismatch);
    CHECK(testing::raised([&] { network.inpaint(gray, gray); }) == error_code::mismatch);
    if constexpr (sizeof(std::size_t) > 4) {  // 32-bit systems cannot have such views
        std::uint8_t one = 0;                 // nothing is read from these views
        const std::size_t width = std::size_t{1} << 31;
        const image_view<const std::uint8_t> wide(&one, 1, width, 3), wide_mask(&one, 1, width, 1);
        CHECK(testing::raised([&] { network.inpaint(wide, wide_mask); }) == error_code::too_large);
    }
    const image<std::uint8_t> long_color(1, 65536, 3), long_mask(1, 65536);
    CHECK(testing::raised([&] { network.inpaint(long_color, long_mask); }) == error_code::too_large);
    const photo_layers layers(make_grid(8, 8));
    for (const std::size_t count : {std::size_t{0}, std::size_t{63}, std::size_t{65}}) {
        const buffer<std::uint8_t> wanted(count, std::uint8_t{1});
        CHECK(testing::raised([&] { network.colors(layers, wanted); }) == error_code::mismatch);
    }
}
