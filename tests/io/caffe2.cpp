#include <ldi/io/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/caffe2_files.hpp>
#include <tests/support/counted_memory.hpp>
#include <tests/support/npy.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <variant>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

using ldi::testing::caffe2_files;
using ldi::testing::octets;

/// Reads, builds and runs the network. Returns the error's text, or an empty text on success. Any exception except ldi::error
/// fails the test.
std::string error_of(const caffe2_files& files) {
    try {
        const ldi::tiefenrausch network(ldi::read_caffe2(files.network, files.weights));
        ldi::serial_executor serial;
        network.levels(ldi::image<std::uint8_t>(32, 32, 3, 100), serial);
    } catch (const ldi::error& e) {
        CHECK_FALSE(e.details().where.empty());
        CHECK_FALSE(e.details().expected.empty());
        CHECK_FALSE(e.details().found.empty());
        return e.what();
    }
    return "";
}

/// Returns the error for the small network after the first occurrence of `from` in one of its files is replaced by `to`, which
/// has the same length.
std::string error_with(const std::string& from, const std::string& to, bool in_weights = false) {
    REQUIRE(from.size() == to.size());
    caffe2_files files = ldi::testing::small_network();
    octets& file = in_weights ? files.weights : files.network;
    const auto at = std::search(file.begin(), file.end(), from.begin(), from.end());
    REQUIRE(at != file.end());
    std::copy(to.begin(), to.end(), at);
    return error_of(files);
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("every property of the small test network is read") {
    const caffe2_files files = ldi::testing::small_network();
    const ldi::network_description network = ldi::read_caffe2(files.network, files.weights);
    CHECK(network.input_name == "color");
    CHECK(network.input_channels == 3);
    CHECK(network.input == ldi::quantization{0.0077F, 128});
    REQUIRE(network.operators.size() == 6);
    CHECK(network.output == 6);
    const auto& first = std::get<ldi::convolution_description>(network.operators[0].kind);
    CHECK(first.input == 0);
    CHECK(first.kernel == 3);
    CHECK(first.stride == 1);
    CHECK_FALSE(first.depthwise);
    CHECK(first.weights.size() == 8 * 9 * 3);
    CHECK(first.weight_quantization == ldi::quantization{0.01F, 127});
    CHECK(first.bias == ldi::buffer<std::int32_t>{-100, -60, -20, 20, 60, 100, 140, 180});
    const auto& half = std::get<ldi::convolution_description>(network.operators[1].kind);
    CHECK(half.depthwise);
    CHECK(half.stride == 2);
    CHECK(std::get<ldi::nearest_resize_description>(network.operators[3].kind).factor == 2);
    CHECK(std::get<ldi::addition_description>(network.operators[4].kind).inputs == std::array<std::size_t, 2>{1, 4});
    CHECK(network.operators[4].name == "sum");
    CHECK(network.operators[4].output == ldi::quantization{0.04F, 3});
    CHECK(error_of(files).empty());
}

TEST_CASE("the published network has 146 convolutions, 39 additions and 5 upsampling operators") {
    const std::string folder = LDI_SHARED_DIR "/tiefenrausch/model/";
    const octets operators = ldi::testing::read_bytes(folder + "tiefenrausch.pb"),
                 weights = ldi::testing::read_bytes(folder + "tiefenrausch_init.pb");
    if (operators.empty()) {
        WARN("skipped: there is no " << folder);
        return;
    }
    const ldi::network_description network = ldi::read_caffe2(operators, weights);
    std::size_t counts[3] = {}, parameters = 0;
    for (const ldi::operator_description& op : network.operators) {
        ++counts[op.kind.index()];
        if (const auto* c = std::get_if<ldi::convolution_description>(&op.kind)) parameters += c->weights.size() + c->bias.size();
    }
    CHECK(counts[0] == 146);
    CHECK(counts[1] == 39);
    CHECK(counts[2] == 5);
    CHECK(parameters == 3550841);
}

TEST_CASE("errors name the operator, what was expected, and what was found") {
    CHECK(contains(error_with("Int8Add", "Int8Sub"), "Int8Sub sum"));
    CHECK(contains(error_with("Int8Conv", "Int8Cone"), "expected an operator of a quantized network, found Int8Cone"));
    CHECK(contains(error_with("\"\x04NHWC", "\"\x04NCHW"), "expected NHWC, found NCHW"));
    CHECK(contains(error_with("half_w", "halb_w"), "expected a tensor of the weight file, found halb_w"));
    CHECK(contains(error_with("half_w", "halb_w", true), "half_w"));
    CHECK(contains(error_with("mixed_b", "mixed_w"), "expected weights that only one operator uses, found mixed_w again"));
    CHECK(contains(error_with("Int8GivenTensorFill", "Int8GivenTensorFall", true), "Int8GivenTensorFall first_w"));
    CHECK(contains(error_with("Y_scale", "Y_skale"), "the argument Y_scale"));
    CHECK(contains(error_with("strides", "strikes"), "the argument strides"));
    CHECK(contains(error_with("result", "rasult"), "Int8Dequantize rasult"));
    CHECK(contains(error_with(std::string("\x0A\x05group\x18\x01", 9), std::string("\x0A\x05group\x18\x02", 9)), "group"));
    CHECK(contains(error_with("pads\x30\x01\x30\x01\x30\x01\x30\x01", "pads\x30\x02\x30\x02\x30\x02\x30\x02"),
                   "pads: expected 1, found 2"));
    CHECK(contains(error_with("pads\x30\x01", "pads\x30\x02"), "pads: expected equal integers, found 2 and 1"));
    CHECK(contains(error_with(std::string("strides\x30\x01\x30\x01", 11), std::string("strides\x30\x03\x30\x03", 11)),
                   "expected 1 or 2, found 3"));
    CHECK(contains(error_with(std::string("shape\x30\x08\x30\x03", 9), std::string("shape\x30\x08\x30\x04", 9), true),
                   "expected 288 values for the shape, found 216"));
}

TEST_CASE("kernels that are not square are refused, and so is an empty list of kernel sizes") {
    const std::string square("shape\x30\x08\x30\x03\x30\x03\x30\x03", 13), oblong("shape\x30\x08\x30\x03\x30\x01\x30\x09", 13);
    CHECK(contains(error_with(square, oblong, true), "kernels: expected a square kernel with the size of the weights, found 3"));
    // Applies the edits of a fuzzer's seed, which turn the list of kernel sizes into field 7. Readers skip this field, so the
    // list is empty.
    const octets edits = ldi::testing::read_bytes(LDI_SOURCE_DIR "/tests/fuzz/corpus/caffe2/no_kernels");
    REQUIRE(edits.size() == 16);
    CHECK(contains(error_of(ldi::testing::damaged(ldi::testing::small_network(), edits.data(), edits.size())),
                   "kernels: expected 2 integers, found 0"));
}

TEST_CASE("empty, truncated, swapped and unrelated files are refused") {
    const caffe2_files sound = ldi::testing::small_network();
    CHECK(contains(error_of({{}, sound.weights}), "network file: expected a Caffe2 network with operators, found 0 bytes"));
    CHECK(contains(error_of({sound.network, {}}), "weight file"));
    CHECK(contains(error_of({sound.weights, sound.network}), "weight file"));
    const std::string text = "this is not a network but a line of text\n";
    CHECK_FALSE(error_of({octets(text.begin(), text.end()), sound.weights}).empty());
    for (std::size_t size = 0; size < sound.network.size(); ++size) {
        octets cut(sound.network.begin(), sound.network.begin() + static_cast<std::ptrdiff_t>(size));
        // The file ends with the external output. Every cut removes this output or an operator.
        CHECK_FALSE(error_of({cut, sound.weights}).empty());
    }
    for (std::size_t size = 0; size < sound.weights.size(); ++size) {
        octets cut(sound.weights.begin(), sound.weights.begin() + static_cast<std::ptrdiff_t>(size));
        CHECK_FALSE(error_of({sound.network, cut}).empty());
    }
}

TEST_CASE("a length of more than 32 bits is refused") {
    const caffe2_files sound = ldi::testing::small_network();
    // Field 2, length delimited, length 2^32 + 1: a reader that keeps only 32 bits reads one byte.
    octets file{0x12, 0x81, 0x80, 0x80, 0x80, 0x10, 0x00};
    file.insert(file.end(), sound.network.begin(), sound.network.end());
    CHECK(contains(error_of({file, sound.weights}), "4294967297 bytes"));
}

TEST_CASE("randomly damaged network files raise an error or load as a network that runs") {
    const caffe2_files sound = ldi::testing::small_network();
    std::mt19937 random(1);
    int refused = 0, accepted = 0;
    for (int i = 0; i < 6000; ++i) {
        ldi::buffer<std::uint8_t> edits(4 * (1 + random() % 3));
        for (std::uint8_t& value : edits) value = static_cast<std::uint8_t>(random() >> 24);
        const bool is_refused = !error_of(ldi::testing::damaged(sound, edits.data(), edits.size())).empty();
        ++(is_refused ? refused : accepted);
    }
    // Some damage only changes a weight, and the network still loads.
    CHECK(refused > 1000);
    CHECK(accepted > 100);
}

TEST_CASE("the small network with any single bit flipped raises an error or runs") {
    const caffe2_files sound = ldi::testing::small_network();
    int refused = 0;
    for (std::size_t at = 0; at < sound.network.size(); ++at)
        for (int bit = 0; bit < 8; ++bit) {
            caffe2_files files = sound;
            files.network[at] = static_cast<std::uint8_t>(files.network[at] ^ (1 << bit));
            refused += !error_of(files).empty();
        }
    CHECK(refused > static_cast<int>(sound.network.size()));
}

TEST_CASE("the published network with random damage raises an error or loads") {
    const std::string folder = LDI_SHARED_DIR "/tiefenrausch/model/";
    const caffe2_files sound{ldi::testing::read_bytes(folder + "tiefenrausch.pb"),
                             ldi::testing::read_bytes(folder + "tiefenrausch_init.pb")};
    if (sound.network.empty()) {
        WARN("skipped: there is no " << folder);
        return;
    }
    std::mt19937 random(2);
    int refused = 0;
    for (int i = 0; i < 24; ++i) {
        caffe2_files files = sound;
        octets& file = i % 2 == 0 ? files.network : files.weights;
        for (int edit = 0; edit < 4; ++edit) file[random() % file.size()] = static_cast<std::uint8_t>(random() >> 24);
        if (i % 8 == 7) file.resize(random() % file.size());
        try {
            const ldi::tiefenrausch network(ldi::read_caffe2(files.network, files.weights));
        } catch (const ldi::error&) {
            ++refused;
        }
    }
    CHECK(refused > 5);
}

TEST_CASE("refusing a file with thousands of nameless operators or arguments needs less memory than the file's size") {
    const auto repeated = [](std::initializer_list<std::uint8_t> message, std::size_t count) {
        octets file;
        for (std::size_t i = 0; i < count; ++i) file.insert(file.end(), message);
        return file;
    };
    const octets arguments = repeated({0x2A, 0}, 50'000);
    octets one_operator = {0x12, 0xA0, 0x8D, 0x06};  // an operator of 100,000 bytes
    one_operator.insert(one_operator.end(), arguments.begin(), arguments.end());
    for (const octets& file : {repeated({0x12, 0}, 50'000), one_operator}) {
        ldi::testing::counted_memory memory;
        const ldi::memory_scope scope(memory.source);
        CHECK_THAT(error_of({file, file}), Catch::Contains("with a name"));
        CHECK(memory.peak < file.size());
    }
}
