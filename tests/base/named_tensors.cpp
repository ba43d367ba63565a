#include <ldi/base/named_tensors.hpp>

#include <catch2/catch.hpp>

#include <string_view>

using namespace ldi;

TEST_CASE("shape_text() lists the lengths of a shape, and calls an empty shape a single value") {
    CHECK(shape_text(buffer<std::size_t>{}) == "a single value");
    CHECK(shape_text(buffer<std::size_t>{7}) == "7");
    CHECK(shape_text(buffer<std::size_t>{20, 4, 0, 7}) == "20 x 4 x 0 x 7");
}

TEST_CASE("tensors and metadata are found by a std::string_view, without a copy of the name") {
    named_tensors file;
    file.tensors["bias"] = {{2}, buffer<std::int8_t>{-1, 3}};
    file.metadata["network"] = "farbrausch";
    CHECK(file.tensors.find(std::string_view("bias")) != file.tensors.end());
    CHECK(file.tensors.find(std::string_view("weight")) == file.tensors.end());
    CHECK(file.metadata.find(std::string_view("network"))->second == "farbrausch");
}
