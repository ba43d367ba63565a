#include <ldi/nn/dense/quantized_network.hpp>
#include <tests/support/random_bytes.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace {

using ldi::image;

struct random_source {
    std::mt19937 engine;

    int in(int least, int most) { return std::uniform_int_distribution<int>(least, most)(engine); }
    std::size_t size_in(int least, int most) { return static_cast<std::size_t>(in(least, most)); }
    ldi::quantization quantization() {
        return {static_cast<float>(in(100, 300)) * 1e-4F, static_cast<std::uint8_t>(in(0, 1) == 0 ? 0 : in(100, 150))};
    }
    image<std::uint8_t> picture(std::size_t height, std::size_t width, std::size_t channels) {
        ldi::image<std::uint8_t> result(height, width, channels);
        for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(in(0, 255));
        return result;
    }
};

ldi::convolution_description any_convolution(random_source& random, std::size_t input, std::size_t inputs, std::size_t outputs,
                                             std::size_t kernel, std::size_t stride, bool depthwise) {
    ldi::convolution_description c;
    c.input = input, c.kernel = kernel, c.stride = stride, c.depthwise = depthwise;
    c.weights.resize(outputs * kernel * kernel * (depthwise ? 1 : inputs));
    for (std::uint8_t& weight : c.weights) weight = static_cast<std::uint8_t>(random.in(0, 255));
    c.weight_quantization = {static_cast<float>(random.in(20, 80)) * 1e-4F, static_cast<std::uint8_t>(random.in(120, 135))};
    for (std::size_t o = 0; o < outputs; ++o) c.bias.push_back(random.in(-3000, 3000));
    return c;
}

/// Layers of all kinds in random order, with tensors that later additions read again.
ldi::network_description any_network(random_source& random, std::size_t layers) {
    ldi::network_description network;
    network.input_name = "input";
    network.input_channels = random.size_in(1, 20);
    network.input = random.quantization();
    struct tensor {
        std::size_t channels, level;  // level 1 is half the size of level 0
        ldi::quantization values;
    };
    std::vector<tensor> tensors{{network.input_channels, 0, network.input}};
    while (network.operators.size() < layers) {
        const std::size_t from =
            random.size_in(std::max(0, static_cast<int>(tensors.size()) - 3), static_cast<int>(tensors.size()) - 1);
        const tensor t = tensors[from];
        ldi::operator_description op{"layer " + std::to_string(tensors.size()), random.quantization(), {}};
        tensor made = t;
        switch (random.in(0, 3)) {
            case 0: {
                const std::size_t kernel = 2 * random.size_in(0, 2) + 1, stride = t.level == 0 ? random.size_in(1, 2) : 1;
                made = {random.size_in(1, 20), t.level + stride - 1, {}};
                op.kind = any_convolution(random, from, t.channels, made.channels, kernel, stride, false);
                break;
            }
            case 1: {
                const std::size_t stride = t.level == 0 ? random.size_in(1, 2) : 1;
                made.level += stride - 1;
                op.kind = any_convolution(random, from, t.channels, t.channels, 3, stride, true);
                break;
            }
            case 2: {
                const std::size_t other = random.size_in(0, static_cast<int>(tensors.size()) - 1);
                if (tensors[other].channels != t.channels || tensors[other].level != t.level) continue;
                op.kind = ldi::addition_description{{from, other}};
                break;
            }
            default:
                if (t.level == 0) continue;
                --made.level;
                op.output = t.values;
                op.kind = ldi::nearest_resize_description{from, 2};
        }
        made.values = op.output;
        tensors.push_back(made);
        network.operators.push_back(op);
    }
    network.output = tensors.size() - 1;
    return network;
}

/// A dense convolution, then inverted residual blocks as in the depth network: a 1 x 1 convolution, an optional enlargement, a
/// depthwise convolution, a 1 x 1 convolution, and up to two additions, some of them of much earlier tensors.
ldi::network_description network_of_blocks(random_source& random, std::size_t blocks) {
    ldi::network_description network{"input", random.size_in(1, 3), random.quantization(), {}, 0};
    struct tensor {
        std::size_t channels, size;
    };
    std::vector<tensor> tensors{{network.input_channels, 8}};
    const auto add = [&](auto kind, tensor made) {
        ldi::operator_description op{"layer " + std::to_string(tensors.size()), random.quantization(), kind};
        if constexpr (std::is_same_v<decltype(kind), ldi::nearest_resize_description>)
            op.output = network.operators[kind.input - 1].output;
        network.operators.push_back(op);
        tensors.push_back(made);
    };
    const auto add_convolution = [&](std::size_t from, std::size_t outputs, std::size_t kernel, std::size_t stride,
                                     bool depthwise) {
        add(any_convolution(random, from, tensors[from].channels, outputs, kernel, stride, depthwise),
            {outputs, tensors[from].size / stride});
    };
    const auto last = [&] { return tensors.size() - 1; };
    add_convolution(0, random.size_in(4, 20), 3, 1, false);
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t from = random.in(0, 4) == 0 ? 1 : last();
        const bool enlarges = tensors[from].size < 8 && random.in(0, 1) == 0,
                   shrinks = tensors[from].size > 2 && random.in(0, 3) == 0;
        add_convolution(from, random.size_in(4, 40), 1, 1, false);
        if (enlarges) add(ldi::nearest_resize_description{last(), 2}, {tensors.back().channels, tensors.back().size * 2});
        add_convolution(last(), tensors.back().channels, 3, shrinks ? 2 : 1, true);
        const bool keeps_size = !enlarges && !shrinks;
        add_convolution(last(), keeps_size ? tensors[from].channels : random.size_in(4, 20), 1, 1, false);
        if (keeps_size) add(ldi::addition_description{{from, last()}}, tensors.back());
        for (std::size_t other = 1; other < last(); ++other)
            if (tensors[other].channels == tensors.back().channels && tensors[other].size == tensors.back().size &&
                random.in(0, 2) == 0) {
                add(ldi::addition_description{{last(), other}}, tensors.back());
                break;
            }
    }
    network.output = last();
    return network;
}

/// Computes one operator by its definition: sums over coordinates, without packing or tiles.
image<std::uint8_t> reference(const ldi::network_description& network, std::size_t index,
                              const std::vector<image<std::uint8_t>>& tensors) {
    const ldi::operator_description& op = network.operators[index];
    const auto values_of = [&](std::size_t t) { return t == 0 ? network.input : network.operators[t - 1].output; };
    if (const auto* a = std::get_if<ldi::addition_description>(&op.kind)) {
        const auto sum = ldi::make_quantized_addition(values_of(a->inputs[0]), values_of(a->inputs[1]), op.output);
        image<std::uint8_t> result = tensors[a->inputs[0]];
        for (std::size_t i = 0; i < result.size(); ++i)
            result.data()[i] = ldi::add_quantized(result.data()[i], tensors[a->inputs[1]].data()[i], sum);
        return result;
    }
    if (const auto* r = std::get_if<ldi::nearest_resize_description>(&op.kind)) {
        const image<std::uint8_t>& x = tensors[r->input];
        ldi::image<std::uint8_t> result(x.height() * r->factor, x.width() * r->factor, x.channels());
        for (std::size_t y = 0; y < result.height(); ++y)
            for (std::size_t u = 0; u < result.width(); ++u)
                for (std::size_t c = 0; c < x.channels(); ++c) result(y, u, c) = x(y / r->factor, u / r->factor, c);
        return result;
    }
    const auto& c = std::get<ldi::convolution_description>(op.kind);
    const image<std::uint8_t>& x = tensors[c.input];
    const ldi::quantization from = values_of(c.input);
    const auto scale = ldi::make_requantization(from.scale * c.weight_quantization.scale / op.output.scale, op.output.zero_point);
    const std::size_t outputs = c.bias.size(), inputs = c.depthwise ? 1 : x.channels(), margin = c.kernel / 2;
    image<std::uint8_t> result =
        ldi::image<std::uint8_t>((x.height() - 1) / c.stride + 1, (x.width() - 1) / c.stride + 1, outputs);
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t u = 0; u < result.width(); ++u)
            for (std::size_t o = 0; o < outputs; ++o) {
                std::int32_t sum = c.bias[o];
                for (std::size_t ky = 0; ky < c.kernel; ++ky)
                    for (std::size_t kx = 0; kx < c.kernel; ++kx) {
                        const std::size_t at_y = y * c.stride + ky, at_x = u * c.stride + kx;
                        if (at_y < margin || at_y >= x.height() + margin || at_x < margin || at_x >= x.width() + margin) continue;
                        for (std::size_t i = 0; i < inputs; ++i)
                            sum += (x(at_y - margin, at_x - margin, c.depthwise ? o : i) - from.zero_point) *
                                   (c.weights[((o * c.kernel + ky) * c.kernel + kx) * inputs + i] -
                                    c.weight_quantization.zero_point);
                    }
                result(y, u, o) = ldi::requantize(sum, scale);
            }
    return result;
}

struct seen_layer {
    std::string name;
    image<std::uint8_t> tensor;
};

template <class Executor>
std::vector<seen_layer> run_all(const ldi::quantized_network& network, const image<std::uint8_t>& input, Executor& threads) {
    std::vector<seen_layer> seen;
    const image<std::uint8_t> result =
        network.run_observed(input, threads, [&](std::size_t layer, std::string_view name, const image<std::uint8_t>& tensor) {
            CHECK(layer == seen.size());
            seen.push_back({std::string(name), tensor});
        });
    seen.push_back({"result", result});
    return seen;
}

ldi::network_description one_convolution() {
    random_source random{std::mt19937(1)};
    ldi::network_description network{"input", 4, {0.01F, 128}, {}, 1};
    network.operators.push_back({"layer", {0.02F, 0}, any_convolution(random, 0, 4, 6, 3, 1, false)});
    return network;
}

ldi::convolution_description& convolution(ldi::network_description& network) {
    return std::get<ldi::convolution_description>(network.operators[0].kind);
}

template <class Change>
void refuses(ldi::error_code code, Change&& change) {
    ldi::network_description network = one_convolution();
    change(network);
    try {
        const ldi::quantized_network built(network);
        FAIL("the network was accepted");
    } catch (const ldi::error& e) {
        INFO(e.what());
        CHECK(e.code() == code);
        CHECK((e.details().where.find("layer") == 0 || e.details().where.find("input") == 0 || e.details().where == "output"));
    }
}

}  // namespace

TEST_CASE("every layer of a random network matches the reference implementation") {
    random_source random{std::mt19937(7)};
    for (int round = 0; round < 40; ++round) {
        const ldi::network_description description = any_network(random, random.size_in(1, 14));
        const ldi::quantized_network network(description);
        const std::size_t height = 2 * random.size_in(1, 6), width = 2 * random.size_in(1, 40);
        std::vector<image<std::uint8_t>> tensors{random.picture(height, width, description.input_channels)};
        ldi::serial_executor serial;
        const std::vector<seen_layer> seen = run_all(network, tensors[0], serial);
        REQUIRE(seen.size() == description.operators.size() + 1);
        for (std::size_t i = 0; i < description.operators.size(); ++i) {
            tensors.push_back(reference(description, i, tensors));
            CHECK(seen[i].name == description.operators[i].name);
            CHECK((seen[i].tensor == tensors.back()));
        }
        CHECK((seen.back().tensor == tensors.back()));
        const ldi::tensor_size size = network.output_size({height, width});
        CHECK((size.height == tensors.back().height() && size.width == tensors.back().width()));
        CHECK(network.output_channels() == tensors.back().channels());
    }
}

TEST_CASE("results do not depend on the number of threads") {
    random_source random{std::mt19937(8)};
    for (int round = 0; round < 10; ++round) {
        const ldi::network_description description = any_network(random, 12);
        const ldi::quantized_network network(description);
        const image<std::uint8_t> input = random.picture(22, 34, description.input_channels);
        ldi::serial_executor serial;
        const std::vector<seen_layer> expected = run_all(network, input, serial);
        for (std::size_t count : {2U, 3U, 7U}) {
            ldi::thread_pool threads(count);
            const std::vector<seen_layer> found = run_all(network, input, threads);
            REQUIRE(found.size() == expected.size());
            for (std::size_t i = 0; i < found.size(); ++i) CHECK((found[i].tensor == expected[i].tensor));
        }
    }
}

TEST_CASE("fused chains of layers, processed in strips or in place, match the separate layers on every instruction set") {
    random_source random{std::mt19937(10)};
    for (int round = 0; round < 28; ++round) {
        ldi::network_description description =
            round % 4 == 3 ? any_network(random, 12) : network_of_blocks(random, random.size_in(1, 6));
        const image<std::uint8_t> input =
            random.picture(8 * random.size_in(1, 4), 8 * random.size_in(1, 12), description.input_channels);
        std::vector<image<std::uint8_t>> tensors{input};
        for (std::size_t i = 0; i < description.operators.size(); ++i) tensors.push_back(reference(description, i, tensors));
        for (ldi::isa set : ldi::testing::available_isas()) {
            const ldi::quantized_network network(description, set);
            CHECK(network.target() == set);
            for (std::size_t count : {1U, 2U, 3U, 8U}) {
                ldi::thread_pool threads(count);
                CHECK((network.run(input, threads) == tensors.back()));
            }
            ldi::serial_executor serial;
            const std::vector<seen_layer> seen = run_all(network, input, serial);
            for (std::size_t i = 0; i < description.operators.size(); ++i) CHECK((seen[i].tensor == tensors[i + 1]));
        }
    }
}

TEST_CASE("a run stays within the memory that the caller provides") {
    random_source random{std::mt19937(11)};
    for (int round = 0; round < 20; ++round) {
        const ldi::network_description description = network_of_blocks(random, 5);
        const ldi::quantized_network network(description);
        const image<std::uint8_t> input = random.picture(24, 40, description.input_channels);
        for (std::size_t count : {1U, 3U}) {
            ldi::thread_pool threads(count);
            const std::size_t bytes = network.working_bytes({24, 40}, count), guard = 64;
            std::vector<std::byte> memory(bytes + 2 * guard, std::byte{0x5A});
            const image<std::uint8_t> found = network.run(input, threads, {}, std::span<std::byte>(memory).subspan(guard, bytes));
            CHECK((found == network.run(input, threads)));
            bool untouched = true;
            for (std::size_t i = 0; i < guard; ++i)
                untouched = untouched && memory[i] == std::byte{0x5A} && memory[memory.size() - 1 - i] == std::byte{0x5A};
            CHECK(untouched);
        }
    }
}

TEST_CASE("progress rises to 1") {
    random_source random{std::mt19937(12)};
    const ldi::network_description description = network_of_blocks(random, 3);
    ldi::serial_executor serial;
    ldi::buffer<float> seen;
    ldi::quantized_network(description).run(random.picture(8, 8, description.input_channels), serial, [&](float fraction) {
        seen.push_back(fraction);
    });
    CHECK(std::is_sorted(seen.begin(), seen.end()));
    CHECK(seen.back() == 1.0F);
}

TEST_CASE("any tensor can be the result, including the input") {
    random_source random{std::mt19937(9)};
    ldi::network_description description = any_network(random, 6);
    const image<std::uint8_t> input = random.picture(8, 8, description.input_channels);
    ldi::serial_executor serial;
    const std::vector<seen_layer> all = run_all(ldi::quantized_network(description), input, serial);
    for (std::size_t output = 0; output <= 6; ++output) {
        description.output = output;
        CHECK((ldi::quantized_network(description).run(input, serial) == (output == 0 ? input : all[output - 1].tensor)));
    }
}

TEST_CASE("a callback stops a run by throwing an exception") {
    const ldi::quantized_network network(one_convolution());
    ldi::serial_executor serial;
    random_source random{std::mt19937(1)};
    CHECK_THROWS_AS(network.run(random.picture(4, 4, 4), serial, [](float) { throw 7; }), int);
    CHECK_THROWS_AS(network.run_observed(random.picture(4, 4, 4), serial, [](auto&&...) { throw 7; }), int);
}

TEST_CASE("invalid network descriptions are refused, and the error names the tensor") {
    using ldi::error_code;
    refuses(error_code::mismatch, [](auto& n) { convolution(n).weights.pop_back(); });
    refuses(error_code::mismatch, [](auto& n) { convolution(n).bias.pop_back(); });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).bias.clear(); });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).kernel = 2; });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).kernel = ~std::size_t{0}; });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).stride = 0; });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).stride = 3; });
    refuses(error_code::mismatch, [](auto& n) { convolution(n).depthwise = true; });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).depthwise = true, convolution(n).kernel = 1; });
    refuses(error_code::invalid_data, [](auto& n) { convolution(n).input = 1; });
    refuses(error_code::invalid_data, [](auto& n) { n.output = 2; });
    refuses(error_code::unsupported, [](auto& n) { n.input_channels = 0; });
    refuses(error_code::unsupported, [](auto& n) { n.operators[0].output.scale = 1e-6F; });
    refuses(error_code::unsupported, [](auto& n) { convolution(n).bias[0] = std::numeric_limits<std::int32_t>::min(); });
    for (float scale : {0.0F, -1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), 1e-42F}) {
        refuses(error_code::invalid_data, [&](auto& n) { n.input.scale = scale; });
        refuses(error_code::invalid_data, [&](auto& n) { n.operators[0].output.scale = scale; });
        refuses(error_code::invalid_data, [&](auto& n) { convolution(n).weight_quantization.scale = scale; });
    }
    refuses(error_code::mismatch, [](auto& n) {
        n.operators.push_back({"layer 2", {0.02F, 0}, ldi::addition_description{{0, 1}}});
    });
    refuses(error_code::invalid_data, [](auto& n) {
        n.operators.push_back({"layer 2", {0.02F, 0}, ldi::addition_description{{1, 2}}});
    });
    refuses(error_code::unsupported, [](auto& n) {
        n.operators.push_back({"layer 2", {1e-5F, 0}, ldi::addition_description{{1, 1}}});
    });
    refuses(error_code::unsupported, [](auto& n) {
        n.operators.push_back({"layer 2", {0.02F, 0}, ldi::nearest_resize_description{1, 0}});
    });
    refuses(error_code::unsupported, [](auto& n) {
        n.operators.push_back({"layer 2", {0.02F, 0}, ldi::nearest_resize_description{1, 5}});
    });
    refuses(error_code::mismatch, [](auto& n) {
        n.operators.push_back({"layer 2", {0.02F, 1}, ldi::nearest_resize_description{1, 2}});
    });
    refuses(error_code::unsupported, [](auto& n) {
        for (int i = 0; i < 1024; ++i) n.operators.push_back({"sum", {0.02F, 0}, ldi::addition_description{{1, 1}}});
    });
}

TEST_CASE("calls of a moved-from network raise an error") {
    ldi::quantized_network network(one_convolution());
    const ldi::quantized_network moved = std::move(network);
    CHECK(moved.input_channels() > 0);
    ldi::serial_executor serial;
    const image<std::uint8_t> input(4, 4, moved.input_channels(), std::uint8_t{0});
    const auto refused = [](auto&& call) { return ldi::testing::raised(call) == ldi::error_code::mismatch; };
    CHECK(refused([&] { network.run(input, serial); }));  // NOLINT(bugprone-use-after-move)
    CHECK(refused([&] { network.output_size({4, 4}); }));
    CHECK(refused([&] { network.working_bytes({4, 4}, 1); }));
    CHECK(refused([&] { network.input_channels(); }));
    CHECK(refused([&] { network.output_channels(); }));
    CHECK(refused([&] { network.input_quantization(); }));
    CHECK(refused([&] { network.output_quantization(); }));
}

TEST_CASE("depthwise biases of 2^30 and more are refused, and a bias of 2^30 - 1 saturates the result") {
    constexpr std::int32_t limit = 1 << 30;
    random_source random{std::mt19937(5)};
    ldi::network_description network{"input", 4, {0.01F, 128}, {}, 1};
    network.operators.push_back({"layer", {0.02F, 0}, any_convolution(random, 0, 4, 4, 3, 1, true)});
    ldi::serial_executor serial;
    for (const std::size_t output : {std::size_t{0}, std::size_t{3}})
        for (const int sign : {-1, 1}) {
            ldi::network_description changed = network;
            std::int32_t& bias = convolution(changed).bias[output];
            for (const std::int32_t refused : {limit, limit + 1, std::numeric_limits<std::int32_t>::max()}) {
                bias = sign * refused;
                CHECK(ldi::testing::raised([&] { ldi::quantized_network built(changed); }) == ldi::error_code::unsupported);
            }
            bias = sign * (limit - 1);
            const image<std::uint8_t> result = ldi::quantized_network(changed).run(random.picture(4, 4, 4), serial);
            CHECK(result(1, 1, output) == (sign < 0 ? 0 : 255));
        }
}

TEST_CASE("inputs that a network cannot process are refused before memory is allocated") {
    random_source random{std::mt19937(2)};
    ldi::network_description description = one_convolution();
    description.operators.push_back({"half", {0.02F, 0}, any_convolution(random, 1, 6, 4, 3, 2, false)});
    description.operators.push_back({"whole", {0.02F, 0}, ldi::nearest_resize_description{2, 2}});
    description.operators.push_back({"sum", {0.04F, 0}, ldi::addition_description{{0, 3}}});
    description.output = 4;
    const ldi::quantized_network network(description);
    ldi::serial_executor serial;
    CHECK(network.run(random.picture(4, 6, 4), serial).size() == 4 * 6 * 4);

    CHECK(ldi::testing::raised([&] { network.run(random.picture(4, 5, 4), serial); }) == ldi::error_code::mismatch);
    CHECK(ldi::testing::raised([&] { network.run(random.picture(4, 6, 3), serial); }) == ldi::error_code::mismatch);
    CHECK(ldi::testing::raised([&] { network.run(ldi::image<std::uint8_t>(0, 6, 4), serial); }) == ldi::error_code::invalid_data);
    CHECK(ldi::testing::raised([&] { network.output_size({20000, 20000}); }) == ldi::error_code::too_large);
    CHECK(ldi::testing::raised([&] { network.output_size({~std::size_t{0}, ~std::size_t{0}}); }) == ldi::error_code::too_large);

    for (int i = 0; i < 40; ++i)
        description.operators.push_back({"larger", {0.04F, 0}, ldi::nearest_resize_description{description.operators.size(), 4}});
    description.output = description.operators.size();
    const ldi::quantized_network huge(description);
    CHECK(ldi::testing::raised([&] { huge.output_size({2, 2}); }) == ldi::error_code::too_large);
}
