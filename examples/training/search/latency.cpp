// Measures how long networks of 8-bit operators run on one core, with the library's kernels and random weights.
//
//   latency [ROUNDS] < NETWORKS.json > MILLISECONDS.json
//
// Input: {"name": {"height": H, "width": W, "channels": C, "operators": [[kind, first input, second input, kernel, stride or
// factor, outputs], ...]}, ...}; kinds as in nn/dense/quantized_weights.hpp. Output: {"isa": name, "milliseconds": {"name": time,
// ...}}. Each of the ROUNDS rounds (default 5) measures every network once. A network's result is the minimum of its processor
// times, because interference by other programs can only increase them.

#include <ldi/base/executor.hpp>
#include <ldi/nn/dense/quantized_network.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <random>
#include <string>
#include <vector>

namespace {

constexpr double min_milliseconds = 2;  // minimum processor time of one measurement

struct candidate {
    std::string name;
    ldi::quantized_network network;
    ldi::image<std::uint8_t> input;
    std::vector<std::byte> memory;
    double milliseconds = 0;
};

ldi::convolution_description convolution(const nlohmann::ordered_json& row, std::size_t inputs, std::size_t outputs,
                                         std::mt19937& random) {
    ldi::convolution_description c;
    c.depthwise = row[0] == 1;
    c.input = row[1];
    c.kernel = row[3];
    c.stride = row[4];
    c.weight_quantization = {0.0021F, 128};
    for (std::size_t i = 0; i < outputs * c.kernel * c.kernel * (c.depthwise ? 1 : inputs); ++i)
        c.weights.push_back(static_cast<std::uint8_t>(112 + (random() & 31)));
    c.bias = ldi::buffer<std::int32_t>(outputs);
    return c;
}

ldi::network_description described(const nlohmann::ordered_json& json, std::mt19937& random) {
    ldi::network_description network;
    network.input_name = "input";
    network.input_channels = json["channels"];
    network.input = {1.0F, 128};
    std::vector<std::size_t> channels{network.input_channels};
    for (const nlohmann::ordered_json& row : json["operators"]) {
        const std::size_t first = row[1];
        ldi::operator_description op{"operator " + std::to_string(channels.size()), network.input, {}};
        if (row[0] == 2)
            op.kind = ldi::addition_description{{first, row[2].get<std::size_t>()}};
        else if (row[0] == 3)
            op.kind = ldi::nearest_resize_description{first, row[4]};
        else
            op.kind = convolution(row, channels.at(first), row[5], random);
        channels.push_back(row[0] < 2 ? row[5].get<std::size_t>() : channels.at(first));
        network.operators.push_back(std::move(op));
    }
    network.output = network.operators.size();
    return network;
}

/// Returns the processor time per run in milliseconds, over at least min_milliseconds.
double measure(candidate& c) {
    ldi::serial_executor threads;
    const std::clock_t start = std::clock();
    double passed = 0;
    for (int runs = 1;; ++runs) {
        c.network.run(c.input, threads, {}, c.memory);
        passed = 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        if (passed >= min_milliseconds) return passed / runs;
    }
}

}  // namespace

int main(int count, char** arguments) {
    try {
        const int rounds = count > 1 ? std::max(1, std::atoi(arguments[1])) : 5;
        std::mt19937 random;
        std::vector<candidate> candidates;
        const nlohmann::ordered_json networks = nlohmann::ordered_json::parse(std::cin);
        for (const auto& [name, json] : networks.items()) {
            const ldi::tensor_size size{json["height"], json["width"]};
            candidate c{name, ldi::quantized_network(described(json, random)), {size.height, size.width, json["channels"]}, {}};
            for (std::size_t i = 0; i < c.input.size(); ++i) c.input.data()[i] = static_cast<std::uint8_t>(random() & 255);
            c.memory.resize(c.network.working_bytes(size, 1));
            candidates.push_back(std::move(c));
        }
        for (int round = 0; round < rounds; ++round) {
            for (candidate& c : candidates) {
                const double time = measure(c);
                c.milliseconds = round == 0 ? time : std::min(c.milliseconds, time);
            }
        }
        nlohmann::ordered_json result;
        result["isa"] = ldi::to_string(ldi::best_isa());
        for (const candidate& c : candidates) result["milliseconds"][c.name] = std::round(c.milliseconds * 10000) / 10000;
        std::cout << result.dump(1) << "\n";
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
