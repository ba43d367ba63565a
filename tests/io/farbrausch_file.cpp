#include <ldi/io/farbrausch_file.hpp>

#include "tests/support/files.hpp"

#include <catch2/catch.hpp>

#include <span>
#include <vector>

using namespace ldi;

namespace {
const std::filesystem::path weights =
    std::filesystem::path(LDI_SOURCE_DIR) / "tests/networks/files/farbrausch_weights.safetensors";

/// Returns the error for the file after a part of its header is replaced by text of the same length.
std::string complaint(const std::string& piece, const std::string& other, const std::filesystem::path& path = weights) {
    REQUIRE(piece.size() == other.size());
    std::vector<std::byte> file = read_file(path);
    const testing::byte_string from = testing::bytes_of(piece), to = testing::bytes_of(other);
    const auto at = std::search(file.begin(), file.end(), from.begin(), from.end());
    REQUIRE(at != file.end());
    std::copy(to.begin(), to.end(), at);
    return testing::message_of([&] { decode_farbrausch(file, "weights"); });
}

using Catch::Contains;
}  // namespace

TEST_CASE("an exported network loads with the architecture of its metadata") {
    const farbrausch network = load_farbrausch(weights);
    CHECK(network.architecture().channels == buffer<std::size_t>{6, 8, 10, 12, 14});
    CHECK(network.architecture().kernels == buffer<std::int32_t>{7, 5, 5, 3, 3});
    CHECK(network.architecture().growth == 4);
    CHECK(network.architecture().leak == 0.2F);
}

TEST_CASE("a PartialConv file loads with its own architecture, which the metadata must match") {
    const std::filesystem::path masked = weights.parent_path() / "partial_convolution_weights.safetensors";
    const inpainting_architecture a = load_farbrausch(masked).architecture();
    CHECK(a.missing == missing_colors::masked);
    CHECK(a.channels == buffer<std::size_t>{4, 5, 6, 7, 8, 7, 6, 5});
    CHECK(a.kernels == partial_convolution_architecture().kernels);
    CHECK(a.leak == 0.2F);
    CHECK(load_farbrausch(weights).architecture().missing == missing_colors::filled);
    CHECK_THAT(complaint("blue, masked", "blue, filled", masked), Contains("expected inputs") && Contains("masked"));
    CHECK_THAT(complaint("\"name\":\"partial_convolution\"", "\"name\":\"partial-convolution\"", masked),
               Contains("farbrausch or partial_convolution") && Contains("found partial-convolution"));
}

TEST_CASE("a file that does not match the inpainting architecture is refused, and the error names the mismatch") {
    CHECK_THAT(complaint("farbrausch\\\"", "farbraus-h\\\""), Contains("weights, architecture") && Contains("expected name"));
    CHECK_THAT(complaint("\\\"version\\\": 1", "\\\"version\\\": 2"), Contains("expected version 1") && Contains("found 2"));
    CHECK_THAT(complaint("out,in,height,width", "in,out,height,width"), Contains("layout"));
    CHECK_THAT(complaint("leaky_relu 0.2", "leaky_relu 0.3"), Contains("decoder_activation"));
    CHECK_THAT(complaint("\\\"growth\\\": 4", "\\\"growth\\\":-4"), Contains("growth"));
    CHECK_THAT(complaint("\\\"channels\\\"", "\\\"channel_\\\""), Contains("channels"));
    CHECK_THAT(complaint("[6, 8, 10", "[6, 9, 10"),
               Contains("weights, tensor encoder.1.weight") && Contains("expected float, 9 x 6 x 5 x 5"));
    CHECK_THAT(complaint("[7, 5, 5", "[7, 3, 5"), Contains("tensor encoder.1.weight"));
    CHECK_THAT(complaint("encoder.1.bias", "encoder.1.bia5"), Contains("tensor encoder.1.bias") && Contains("no such tensor"));
    CHECK_THAT(complaint("\"architecture\"", "\"architec-ure\""), Contains("architecture") && Contains("none"));
    CHECK_THAT(complaint("\"F16\"", "\"I16\""), Contains("tensor encoder.0.weight") && Contains("I16"));
    CHECK_THAT(complaint("\"name\":\"farbrausch\"", "\"name\":\"farb-ausch\""), Contains("found farb-ausch"));
    CHECK_THAT(testing::message_of([] { load_farbrausch("no/such/file"); }), Contains("no/such/file"));

    const std::filesystem::path depth = std::filesystem::path(LDI_SOURCE_DIR) / "tests/io/files/tiefenrausch_weights.safetensors";
    CHECK_THAT(testing::message_of([&] { load_farbrausch(depth); }),
               Contains(depth.string()) && Contains("an inpainting network") && Contains("found tiefenrausch_small"));
}

TEST_CASE("a truncated inpainting network is refused, and the error names the file") {
    const std::vector<std::byte> whole = read_file(weights);
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 3)
        CHECK_THAT(testing::message_of([&] { decode_farbrausch(std::span(whole).first(size), "cut"); }),
                   Catch::StartsWith("cut"));
}
