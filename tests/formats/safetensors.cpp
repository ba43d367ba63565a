#include <ldi/io/weight_files.hpp>
#include <ldi/nn/weights.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/files.hpp"
#include "tests/support/safetensors_file.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace ldi;
using ldi::testing::bytes_of_values;
using ldi::testing::message_of;
using ldi::testing::safetensors_file;

namespace {
named_tensors decode(std::string_view header, const std::vector<std::byte>& data = {}) {
    return decode_safetensors(safetensors_file(header, data), "weights");
}

/// Returns the error for a file with this header and number of bytes of data.
std::string refusal(std::string_view header, std::size_t data_bytes = 0) {
    return message_of([&] { decode(header, std::vector<std::byte>(data_bytes)); });
}

using Catch::Contains;
}  // namespace

TEST_CASE("tensors of every supported type are read with shape, values and metadata") {
    std::vector<std::byte> data = bytes_of_values<float>({1.5F, -2.0F, 0.25F, 3.0F, 4.0F, 5.0F});
    testing::append(data, bytes_of_values<std::uint16_t>({0x3C00, 0xC000, 0x0001, 0x7BFF}));  // 1, -2, the smallest, the largest
    testing::append(data, bytes_of_values<std::uint16_t>({0x3F80, 0xC040}));                  // 1, -3
    testing::append(data, bytes_of_values<std::int32_t>({-7}));
    testing::append(data, bytes_of_values<std::int8_t>({-128, 127}));
    testing::append(data, bytes_of_values<std::uint8_t>({0, 255}));
    const named_tensors file = decode(
        R"({"__metadata__":{"name":"test"},"f32":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]},)"
        R"("f16":{"dtype":"F16","shape":[4],"data_offsets":[24,32]},"bf16":{"dtype":"BF16","shape":[2],"data_offsets":[32,36]},)"
        R"("i32":{"dtype":"I32","shape":[],"data_offsets":[36,40]},"i8":{"dtype":"I8","shape":[2,1],"data_offsets":[40,42]},)"
        R"("u8":{"dtype":"U8","shape":[2],"data_offsets":[42,44]}}   )",
        data);
    CHECK(file.metadata.at("name") == "test");
    CHECK(file.tensors.size() == 6);
    CHECK(tensor_values<float>(file, "f32", {2, 3}) == buffer<float>{1.5F, -2.0F, 0.25F, 3.0F, 4.0F, 5.0F});
    CHECK(tensor_values<float>(file, "f16", {4}) == buffer<float>{1.0F, -2.0F, 0x1p-24F, 65504.0F});
    CHECK(tensor_values<float>(file, "bf16", {2}) == buffer<float>{1.0F, -3.0F});
    CHECK(tensor_values<std::int32_t>(file, "i32", {}) == buffer<std::int32_t>{-7});
    CHECK(tensor_values<std::int8_t>(file, "i8", {2, 1}) == buffer<std::int8_t>{-128, 127});
    CHECK(tensor_values<std::uint8_t>(file, "u8", {2}) == buffer<std::uint8_t>{0, 255});
}

TEST_CASE("all 65,536 half-precision numbers are converted exactly") {
    for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
        const int exponent = static_cast<int>(bits >> 10 & 31), fraction = static_cast<int>(bits & 1023);
        const float magnitude = exponent == 0    ? std::ldexp(static_cast<float>(fraction), -24)
                                : exponent == 31 ? std::numeric_limits<float>::infinity()
                                                 : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
        const float value = detail::safetensors::half_to_float(bits);
        if (exponent == 31 && fraction != 0) {
            REQUIRE(std::isnan(value));
        } else {
            REQUIRE(value == (bits >= 0x8000 ? -magnitude : magnitude));
            REQUIRE(std::signbit(value) == (bits >= 0x8000));
        }
    }
}

TEST_CASE("a file without tensors, and a tensor without values, are valid") {
    CHECK(decode("{}").tensors.empty());
    const named_tensors file = decode(R"({"none":{"dtype":"F32","shape":[0,5],"data_offsets":[0,0]}})");
    CHECK(tensor_values<float>(file, "none", {0, 5}).empty());
}

TEST_CASE("a file that is cut off at any byte is refused") {
    const auto whole = safetensors_file(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})", std::vector<std::byte>(8));
    REQUIRE(decode_safetensors(whole).tensors.size() == 1);
    for (std::size_t size = 0; size < whole.size(); ++size)
        CHECK(testing::raised([&] { decode_safetensors(std::span(whole).first(size)); }) == error_code::invalid_data);
}

TEST_CASE("errors state the damage and name the damaged tensor") {
    const std::string good = R"("a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]})";
    CHECK(refusal("{" + good + "}", 2) == "nothing raised");
    CHECK_THAT(refusal("{" + good + "}", 3), Contains("weights") && Contains("3 bytes of data") && Contains("found 2"));
    CHECK_THAT(refusal("{" + good + "," + good + "}", 2), Contains("a twice"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","dtype":"U8","shape":[2],"data_offsets":[0,2]}})", 2), Contains("dtype twice"));
    CHECK_THAT(refusal("[]"), Contains("JSON object"));
    CHECK_THAT(refusal("{"), Contains("JSON object"));
    CHECK_THAT(refusal(""), Contains("JSON object"));
    CHECK_THAT(refusal(R"({"a":[[[[[[]]]]]]})"), Contains("deeper nesting"));
    CHECK_THAT(refusal(R"({"a":3})"), Contains("tensor a") && Contains("dtype"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"F64","shape":[1],"data_offsets":[0,8]}})", 8), Contains("tensor a") && Contains("F64"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[3],"data_offsets":[0,2]}})", 2),
               Contains("tensor a") && Contains("3 bytes for 3 of U8") && Contains("found 2"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[-1],"data_offsets":[0,2]}})", 2),
               Contains("tensor a") && Contains("shape"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[1.5],"data_offsets":[0,2]}})", 2),
               Contains("tensor a") && Contains("shape"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[1,1,1,1,1,1,1,1,1],"data_offsets":[0,1]}})", 1),
               Contains("tensor a") && Contains("shape"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,0]}})"),
               Contains("tensor a") && Contains("too large"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[2,4]}})", 2),
               Contains("tensor a") && Contains("2 to 4"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[2,0]}})", 2),
               Contains("tensor a") && Contains("2 to 0"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0]}})", 2),
               Contains("tensor a") && Contains("data_offsets"));
    CHECK_THAT(refusal(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2],"more":1}})", 2), Contains("tensor a"));
    CHECK_THAT(
        refusal(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},"b":{"dtype":"U8","shape":[2],"data_offsets":[1,3]}})",
                3),
        Contains("tensor b") && Contains("from byte 2,"));
    CHECK_THAT(
        refusal(R"({"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]},"b":{"dtype":"U8","shape":[1],"data_offsets":[2,3]}})",
                3),
        Contains("tensor b") && Contains("from byte 1,"));
    CHECK_THAT(refusal(R"({"__metadata__":{"name":3}})"), Contains("metadata") && Contains("name"));
    CHECK_THAT(refusal(R"({"__metadata__":3})"), Contains("metadata"));
    CHECK_THAT(refusal(R"({"\u0001\u00e9":3})"), Contains("tensor ???"));
}

TEST_CASE("a header that is longer than the file or than the limit is refused") {
    std::vector<std::byte> file = safetensors_file("{}");
    file[6] = std::byte{1};
    CHECK(testing::raised([&] { decode_safetensors(file); }) == error_code::invalid_data);
    const std::vector<std::byte> long_one = safetensors_file(std::string(detail::safetensors::max_header_bytes, ' ') + "{}");
    CHECK(testing::raised([&] { decode_safetensors(long_one); }) == error_code::too_large);
}

TEST_CASE("the error for a file of another format names the format") {
    const auto error_for = [](std::string_view text) {
        const std::vector<std::byte> file = testing::bytes_of(text);
        return message_of([&] { decode_safetensors(file); });
    };
    CHECK_THAT(error_for(std::string_view("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16)),
               Contains("expected a safetensors file, found a PNG file"));
    CHECK_THAT(error_for("some lines of text"), Contains("a safetensors file, found 18 bytes of an unknown format"));
}

TEST_CASE("load_safetensors() reads a file by its path, and its errors name the path") {
    CHECK(testing::raised([] { load_safetensors("no/such.safetensors"); }) == error_code::file_access);
    const testing::scratch_folder folder;
    write_file(folder / "a.safetensors", safetensors_file(R"({"__metadata__":{"x":"y"}})"));
    CHECK(load_safetensors(folder / "a.safetensors").metadata.at("x") == "y");
    write_file(folder / "b.safetensors", safetensors_file("{"));
    CHECK_THAT(message_of([&] { load_safetensors(folder / "b.safetensors"); }), Contains("b.safetensors"));
}

TEST_CASE("files with random damage raise an error or are decoded") {
    std::mt19937 random(5);
    const auto whole = safetensors_file(R"({"__metadata__":{"name":"x"},"a":{"dtype":"F16","shape":[2,2],"data_offsets":[0,8]},)"
                                        R"("b":{"dtype":"I8","shape":[3],"data_offsets":[8,11]}})",
                                        std::vector<std::byte>(11));
    int refused = 0;
    for (int i = 0; i < 3000; ++i)
        if (testing::raised([&] { decode_safetensors(testing::damaged_copy(whole, random)); })) ++refused;
    CHECK(refused > 1000);
    CHECK(refused < 3000);
}

TEST_CASE("the number of allocations grows linearly with the number of tensors") {
    const auto allocations = [](int count) {
        std::string header = "{";
        for (int i = 0; i < count; ++i)
            header +=
                (i == 0 ? "\"" : ",\"") + std::to_string(10'000 + i) + R"(":{"dtype":"F32","shape":[0],"data_offsets":[0,0]})";
        ldi::testing::counted_memory memory;
        const memory_scope scope(memory.source);
        CHECK(decode(header + "}").tensors.size() == static_cast<std::size_t>(count));
        return memory.calls;
    };
    const std::size_t few = allocations(500), many = allocations(4000);
    CHECK(many < 9 * few);
    CHECK(many < 30 * 4000);
}
