#include <ldi/io/weight_files.hpp>

#include "tests/support/files.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

using namespace ldi;
using Catch::Contains;
using Catch::StartsWith;
using ldi::testing::message_of;

namespace {

const std::filesystem::path network_folder = std::filesystem::path(LDI_SOURCE_DIR) / "tests/io/files";
const std::filesystem::path inpainting_weights =
    std::filesystem::path(LDI_SOURCE_DIR) / "tests/networks/files/farbrausch_weights.safetensors";

named_tensors tiefenrausch_weights() { return load_safetensors(network_folder / "tiefenrausch_weights.safetensors"); }

template <class Scalar>
buffer<Scalar>& values(named_tensors& file, const std::string& name) {
    return std::get<buffer<Scalar>>(file.tensors.at(name).values);
}

/// Returns the error for the depth network's weights after `change`.
template <class Change>
std::string depth_complaint(Change&& change) {
    named_tensors file = tiefenrausch_weights();
    change(file);
    return message_of([&] { tiefenrausch network(read_quantized_network(file)); });
}

/// Returns the error for the file after a part of its header is replaced by text of the same length.
std::string inpainting_complaint(const std::string& piece, const std::string& other,
                                 const std::filesystem::path& path = inpainting_weights) {
    REQUIRE(piece.size() == other.size());
    std::vector<std::byte> file = read_file(path);
    const testing::byte_string from = testing::bytes_of(piece), to = testing::bytes_of(other);
    const auto at = std::search(file.begin(), file.end(), from.begin(), from.end());
    REQUIRE(at != file.end());
    std::copy(to.begin(), to.end(), at);
    return message_of([&] { decode_farbrausch(file, "weights"); });
}

}  // namespace

TEST_CASE("an exported depth network reproduces its exporter's output bit for bit") {
    const named_tensors example = load_safetensors(network_folder / "tiefenrausch_example.safetensors");
    const buffer<std::size_t>& shape = example.tensors.at("photo").shape;
    image<std::uint8_t> photo(shape[0], shape[1], 3);
    const auto& pixels = tensor_values<std::uint8_t>(example, "photo", shape);
    std::copy(pixels.begin(), pixels.end(), photo.data());
    const auto& expected = tensor_values<std::uint8_t>(example, "levels", {shape[0], shape[1]});
    CHECK(std::set<std::uint8_t>(expected.begin(), expected.end()).size() > 20);

    for (isa target : {isa::scalar, best_isa()}) {
        const tiefenrausch network =
            decode_tiefenrausch(read_file(network_folder / "tiefenrausch_weights.safetensors"), "weights", target);
        serial_executor serial;
        const image<std::uint8_t> found = network.levels(photo, serial);
        REQUIRE(found.size() == expected.size());
        CHECK(std::equal(expected.begin(), expected.end(), found.data()));
    }
}

TEST_CASE("operators have the names from the file, or numbers if it contains no names") {
    const network_description network = read_quantized_network(tiefenrausch_weights());
    CHECK(network.operators.front().name == "full");
    CHECK(network.operators.back().name == "disparity");
    CHECK(network.input_channels == 3);
    CHECK(network.output == network.operators.size());

    named_tensors file = tiefenrausch_weights();
    file.metadata.erase("operator_names");
    CHECK(read_quantized_network(file).operators[3].name == "operator 3");
}

TEST_CASE("load_depth_network() refuses files of other networks, and the error names the network found") {
    CHECK_THAT(message_of([] { load_tiefenrausch_file(network_folder / "tiefenrausch_example.safetensors"); }),
               Contains("tiefenrausch_small") && Contains("example"));
    CHECK_THAT(message_of([] { load_depth_network(inpainting_weights); }),
               Contains(inpainting_weights.string()) && Contains("a depth network") && Contains("found farbrausch"));
}

TEST_CASE("a depth network whose output is neither disparity nor log disparity is refused") {
    std::vector<std::byte> bytes = read_file(network_folder / "tiefenrausch_weights.safetensors");
    const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::size_t at = text.find("\"output\":\"disparity\"");
    REQUIRE(at != std::string::npos);
    bytes[at + 10] = std::byte{'x'};  // "output":"xisparity"
    CHECK_THAT(message_of([&] { decode_tiefenrausch(bytes); }), Contains("log disparity") && Contains("xisparity"));
}

TEST_CASE("input sizes in the metadata must be numbers, and multiples of 32 that the network supports") {
    const std::vector<std::byte> bytes = read_file(network_folder / "tiefenrausch_weights.safetensors");
    const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto with_size = [&](const std::string& size) {
        const std::string output = "\"output\":\"disparity\"", added = ",\"details_long_side\":\"" + size + "\"";
        std::string changed = text;
        changed.insert(text.find(output) + output.size(), added);
        changed[0] = static_cast<char>(changed[0] + static_cast<char>(added.size()));  // lowest byte of the header's length
        return changed;
    };
    const auto read = [](const std::string& file) { return decode_tiefenrausch(std::as_bytes(std::span(file))).sizes(); };
    REQUIRE(static_cast<unsigned char>(text[0]) < 200);
    CHECK(read(text).details == 384);
    CHECK(read(with_size("448")).details == 448);
    for (const char* size : {"", "4 8", "-32", "12345"})
        CHECK_THAT(message_of([&] { read(with_size(size)); }), Contains("details_long_side") && Contains("one to four digits"));
    CHECK_THAT(message_of([&] { read(with_size("0")); }), Contains("above 0"));
    for (const char* size : {"33", "9984"}) CHECK_THAT(message_of([&] { read(with_size(size)); }), Contains("multiples of 32"));
}

TEST_CASE("a truncated depth network is refused, and the error names the file") {
    const std::vector<std::byte> whole = read_file(network_folder / "tiefenrausch_weights.safetensors");
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 3)
        CHECK_THAT(message_of([&] { decode_tiefenrausch(std::span(whole).first(size), "cut"); }), StartsWith("cut"));
}

TEST_CASE("the weights in examples/models load, and need at most 4 MB") {
    const std::filesystem::path models = std::filesystem::path(LDI_SOURCE_DIR) / "examples/models";
    const tiefenrausch network = load_depth_network(models / "tiefenrausch_small.safetensors");
    serial_executor serial;
    const image<float> disparity = network.disparity(image<std::uint8_t>(30, 40, 3, std::uint8_t{128}), {}, serial);
    CHECK((network.sizes().details == 448 && network.sizes().layout == 320));  // as in its file
    CHECK(disparity.height() == 320);
    CHECK(disparity.width() == 448);
    CHECK(load_farbrausch(models / "farbrausch.safetensors").architecture().channels.size() == 5);

    std::uintmax_t bytes = 0;
    for (const auto& file : std::filesystem::directory_iterator(models)) bytes += file.file_size();
    CHECK(bytes <= 4'000'000);
}

TEST_CASE("load_depth_network() loads a file, or the published network from a folder") {
    CHECK(load_depth_network(network_folder / "tiefenrausch_weights.safetensors").level_quantization().scale > 0);
    CHECK_THAT(message_of([] { load_depth_network(network_folder); }), Contains("tiefenrausch.pb"));
    CHECK_THAT(message_of([] { load_depth_network(network_folder / "none.safetensors"); }), Contains("none.safetensors"));
}

TEST_CASE("an invalid operator table is refused, and the error names the tensor or operator") {
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors.erase("operators"); }), Contains("tensor operators"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors.erase("scales"); }),
               Contains("tiefenrausch_weights.safetensors, tensor scales"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors.erase("0.weight"); }), Contains("tensor 0.weight"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors.erase("1.bias"); }), Contains("tensor 1.bias"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors["more"] = f.tensors["scales"]; }), Contains("tensor more"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { f.tensors.at("0.weight").shape = {4, 27}; }), Contains("four dimensions"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "operators")[0] = 4; }),
               Contains("row 0, column 0"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "operators")[1] = 1; }),
               Contains("row 0, column 1"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "operators")[1] = -1; }),
               Contains("row 0, column 1"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "operators")[3] = 5; }), Contains("4 x 5 x 5 x 3"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "operators")[4] = 3; }), Contains("stride"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<float>(f, "weight_scales")[0] = 1e9F; }),
               Contains("tiefenrausch_weights.safetensors, full"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<float>(f, "scales")[0] = 0; }),
               Contains("tiefenrausch_weights.safetensors, input"));
    CHECK_THAT(depth_complaint([](named_tensors& f) { values<std::int32_t>(f, "2.bias")[0] = 1 << 30; }),
               Contains("tiefenrausch_weights.safetensors, down1.depthwise") && Contains("1073741824 in output 0"));
}

TEST_CASE("the published network loads from its folder, and the error for a missing folder names it") {
    CHECK_THROWS_WITH(load_tiefenrausch("no/such/folder"), Contains("no/such/folder") && Contains("tiefenrausch.pb"));
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/model";
    if (!std::filesystem::exists(folder)) {
        WARN("skipped: " << folder << " is absent");
        return;
    }
    CHECK(load_tiefenrausch(folder).quantization_step() == Approx(1.0189).epsilon(1e-3));
}

TEST_CASE("an exported network loads with the architecture that its metadata states") {
    const farbrausch network = load_farbrausch(inpainting_weights);
    CHECK(network.architecture().channels == buffer<std::size_t>{6, 8, 10, 12, 14});
    CHECK(network.architecture().kernels == buffer<std::int32_t>{7, 5, 5, 3, 3});
    CHECK(network.architecture().growth == 4);
    CHECK(network.architecture().leak == 0.2F);
}

TEST_CASE("a PartialConv file loads with its own architecture, which the metadata must match") {
    const std::filesystem::path masked = inpainting_weights.parent_path() / "partial_convolution_weights.safetensors";
    const inpainting_architecture a = load_farbrausch(masked).architecture();
    CHECK(a.missing == missing_colors::masked);
    CHECK(a.channels == buffer<std::size_t>{4, 5, 6, 7, 8, 7, 6, 5});
    CHECK(a.kernels == partial_convolution_architecture().kernels);
    CHECK(a.leak == 0.2F);
    CHECK(load_farbrausch(inpainting_weights).architecture().missing == missing_colors::filled);
    CHECK_THAT(inpainting_complaint("blue, masked", "blue, filled", masked), Contains("expected inputs") && Contains("masked"));
    CHECK_THAT(inpainting_complaint("\"name\":\"partial_convolution\"", "\"name\":\"partial-convolution\"", masked),
               Contains("farbrausch or partial_convolution") && Contains("found partial-convolution"));
}

TEST_CASE("a file that does not match the inpainting architecture is refused, and the error names the mismatch") {
    CHECK_THAT(inpainting_complaint("farbrausch\\\"", "farbraus-h\\\""),
               Contains("weights, architecture") && Contains("expected name"));
    CHECK_THAT(inpainting_complaint("\\\"version\\\": 1", "\\\"version\\\": 2"),
               Contains("expected version 1") && Contains("found 2"));
    CHECK_THAT(inpainting_complaint("out,in,height,width", "in,out,height,width"), Contains("layout"));
    CHECK_THAT(inpainting_complaint("leaky_relu 0.2", "leaky_relu 0.3"), Contains("decoder_activation"));
    CHECK_THAT(inpainting_complaint("\\\"growth\\\": 4", "\\\"growth\\\":-4"), Contains("growth"));
    CHECK_THAT(inpainting_complaint("\\\"channels\\\"", "\\\"channel_\\\""), Contains("channels"));
    CHECK_THAT(inpainting_complaint("[6, 8, 10", "[6, 9, 10"),
               Contains("weights, tensor encoder.1.weight") && Contains("expected float, 9 x 6 x 5 x 5"));
    CHECK_THAT(inpainting_complaint("[7, 5, 5", "[7, 3, 5"), Contains("tensor encoder.1.weight"));
    CHECK_THAT(inpainting_complaint("encoder.1.bias", "encoder.1.bia5"),
               Contains("tensor encoder.1.bias") && Contains("no such tensor"));
    CHECK_THAT(inpainting_complaint("\"architecture\"", "\"architec-ure\""),
               Contains("architecture") && Contains("no such entry"));
    CHECK_THAT(inpainting_complaint("\"F16\"", "\"I16\""), Contains("tensor encoder.0.weight") && Contains("I16"));
    CHECK_THAT(inpainting_complaint("\"name\":\"farbrausch\"", "\"name\":\"farb-ausch\""), Contains("found farb-ausch"));
    CHECK_THAT(message_of([] { load_farbrausch("no/such/file"); }), Contains("no/such/file"));

    const std::filesystem::path depth = network_folder / "tiefenrausch_weights.safetensors";
    CHECK_THAT(message_of([&] { load_farbrausch(depth); }),
               Contains(depth.string()) && Contains("an inpainting network") && Contains("found tiefenrausch_small"));
}

TEST_CASE("a truncated inpainting network is refused, and the error names the file") {
    const std::vector<std::byte> whole = read_file(inpainting_weights);
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 3)
        CHECK_THAT(message_of([&] { decode_farbrausch(std::span(whole).first(size), "cut"); }), StartsWith("cut"));
}
