#include <ldi/io/weight_files.hpp>
#include <ldi/networks/silhouettes.hpp>

#include "tests/networks/reference_silhouettes.hpp"
#include "tests/support/random_region.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>

#ifndef LDI_SOURCE_DIR
#define LDI_SOURCE_DIR "."
#endif

using namespace ldi;
using ldi::testing::reference_silhouettes;

namespace {

const std::filesystem::path root = LDI_SOURCE_DIR;

/// Weights with which most values are neither 0 nor at the end of their range.
named_tensors random_weights(std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> any(-1.0F, 1.0F);
    named_tensors weights;
    weights.tensors["input.range"] = {{2}, buffer<float>{-128.0F / 127.0F, 1.0F}};
    for (const reference_silhouettes::layer& l : reference_silhouettes::layers()) {
        std::size_t inputs = 0;
        for (const std::string& read : l.reads)
            inputs += std::size_t{read == "input" ? 8U : read == "fine" || read == "fine.up" || read == "half.up" ? 16U : 32U};
        buffer<float> values(l.outputs * inputs * 9), bias(l.outputs);
        for (float& w : values) w = any(random) * 2.0F / std::sqrt(static_cast<float>(9 * inputs));
        for (float& b : bias) b = 0.2F * any(random);
        weights.tensors[l.name + ".weight"] = {{l.outputs, inputs, 3, 3}, std::move(values)};
        weights.tensors[l.name + ".bias"] = {{l.outputs}, std::move(bias)};
        if (l.name != "out") weights.tensors[l.name + ".range"] = {{2}, buffer<float>{0.0F, 1.5F}};
    }
    return weights;
}

struct inputs {
    image<std::uint8_t> marks, values;
    pixel_region region;
    buffer<std::uint8_t> packed;

    inputs(image<std::uint8_t> in_region, image<std::uint8_t> of_pixels)
        : marks(std::move(in_region)), values(std::move(of_pixels)), region(ldi::testing::region_of(marks)) {
        for (std::size_t i = 0; i < marks.size(); ++i)
            if (marks.data()[i] != 0) packed.append(values.data() + 8 * i, values.data() + 8 * i + 8);
    }
};

inputs random_inputs(std::size_t height, std::size_t width, std::uint32_t seed) {
    image<std::uint8_t> values(height, width, 8);
    std::mt19937 random(seed);
    for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(random());
    return {ldi::testing::random_marks(height, width, seed), std::move(values)};
}

template <class Visit>
void for_each_available(Visit&& visit) {
    for (const instruction_set& set : instruction_sets)
        if (is_available(set.id)) visit(set.id);
}

}  // namespace

TEST_CASE("the silhouette network matches integer arithmetic bit for bit on every instruction set") {
    const named_tensors weights = random_weights(3);
    for (const auto& [height, width] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 7}, {19, 1}, {16, 24}, {31, 37}}) {
        for (std::uint32_t seed = 0; seed < (height * width < 100 ? 3 : 1); ++seed) {
            CAPTURE(height, width, seed);
            const inputs in = random_inputs(height, width, seed);
            const image<float> expected = reference_silhouettes(weights)(in.values, in.marks);
            for_each_available([&](isa set) {
                CAPTURE(to_string(set));
                const silhouette_network network(weights, set);
                const buffer<float> found = network.logits(in.region, in.packed, buffer<std::uint8_t>(in.region.size(), 1));
                std::size_t different = 0, next = 0;
                for (std::size_t i = 0; i < in.marks.size(); ++i)
                    for (std::size_t c = 0; in.marks.data()[i] != 0 && c < 2; ++c)
                        different += std::size_t{found[next++] != expected.data()[2 * i + c]};  // exact
                CHECK(different == 0);
            });
        }
    }
}

TEST_CASE("the shipped silhouette network computes the same logits as in training, up to rounding") {
    const silhouette_network network = load_silhouettes(root / "examples/models/silhouettes.safetensors");
    const named_tensors example = load_safetensors(root / "tests/networks/files/silhouettes_example.safetensors");
    const auto& input = std::get<buffer<std::uint8_t>>(example.tensors.at("input").values);
    const auto& logits = std::get<buffer<float>>(example.tensors.at("logits").values);
    const std::size_t height = example.tensors.at("input").shape[1], width = example.tensors.at("input").shape[2];
    const std::size_t pixels = height * width;
    image<std::uint8_t> marks(height, width), values(height, width, 8);
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 8; ++c) {
            values.data()[8 * i + c] = input[c * pixels + i];
            if (input[c * pixels + i] != 128) marks.data()[i] = 1;  // outside the region, all inputs are 0, stored as 128
        }
    const inputs in(std::move(marks), std::move(values));
    const buffer<float> found = network.logits(in.region, in.packed, buffer<std::uint8_t>(in.region.size(), 1));
    // The training computes in floats. It may therefore round a byte of an inner layer differently, which changes logits nearby.
    std::size_t different = 0;
    float largest = 0;
    const auto compare = [&](float ours, float theirs) {
        const float difference = std::abs(ours - theirs);
        different += std::size_t{difference > 1e-4F};
        largest = std::max(largest, difference);
    };
    for (std::size_t i = 0, next = 0; i < pixels; ++i) {
        if (in.marks.data()[i] == 0) continue;
        const float lean = std::clamp((static_cast<float>(input[4 * pixels + i]) - 128.0F) / 127.0F, -0.5F, 0.5F);
        compare(found[next] + 6.0F * lean, logits[i]);
        compare(found[next + 1], logits[pixels + i]);
        next += 2;
    }
    CHECK(different < found.size() / 10);
    CHECK(largest < 0.2F);
}

TEST_CASE("requesting fewer pixels does not change the logits of the requested ones") {
    const silhouette_network network(random_weights(5));
    const inputs in = random_inputs(40, 50, 7);
    const buffer<float> all = network.logits(in.region, in.packed, buffer<std::uint8_t>(in.region.size(), 1));
    buffer<std::uint8_t> wanted(in.region.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = i % 7 < 2 ? 1 : 0;
    thread_pool threads(3);
    const buffer<float> some = network.logits(in.region, in.packed, wanted, threads);
    for (std::size_t i = 0; i < wanted.size(); ++i)
        if (wanted[i] != 0) CHECK((some[2 * i] == all[2 * i] && some[2 * i + 1] == all[2 * i + 1]));
}

TEST_CASE("an empty region has no logits") {
    const silhouette_network network(random_weights(5));
    CHECK(network.logits(pixel_region(), {}, {}).empty());
}

TEST_CASE("weights with missing, additional or non-finite tensors are refused") {
    named_tensors weights = random_weights(1);
    weights.tensors.erase("half.bias");
    CHECK_THROWS_WITH(silhouette_network(weights), Catch::Contains("half.bias"));
    weights = random_weights(1);
    weights.tensors["more"] = {{1}, buffer<float>{1.0F}};
    CHECK_THROWS_WITH(silhouette_network(weights), Catch::Contains("more"));
    weights = random_weights(1);
    std::get<buffer<float>>(weights.tensors["out.weight"].values)[5] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_WITH(silhouette_network(weights), Catch::Contains("finite"));
    CHECK_THROWS_WITH(load_silhouettes(root / "examples/models/farbrausch.safetensors"), Catch::Contains("silhouette network"));
}
