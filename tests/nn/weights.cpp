#include <ldi/nn/weights.hpp>

#include <catch2/catch.hpp>

#include <array>

using namespace ldi;

TEST_CASE("a tensor is found by name, type and shape, and the error for a mismatch names the tensor") {
    named_tensors weights;
    weights.tensors["a"] = {{2, 1}, buffer<float>{1.0F, 2.0F}};
    weights.tensors["b"] = {{}, buffer<std::int8_t>{3}};
    CHECK(tensor_values<float>(weights, "a", {2, 1}) == buffer<float>{1.0F, 2.0F});
    CHECK(tensor_values<std::int8_t>(weights, "b", {}) == buffer<std::int8_t>{3});
    CHECK_THROWS_WITH(tensor_values<float>(weights, "c", {2}),
                      Catch::Contains("tensor c") && Catch::Contains("float, 2") && Catch::Contains("no such tensor"));
    CHECK_THROWS_WITH(tensor_values<float>(weights, "a", {2}),
                      Catch::Contains("tensor a") && Catch::Contains("found float, 2 x 1"));
    weights.tensors["few"] = {{2, 3}, buffer<float>{1.0F, 2.0F}};
    CHECK_THROWS_WITH(tensor_values<float>(weights, "few", {2, 3}),
                      Catch::Contains("tensor few: expected 6 values, found 2 (mismatch)"));
    CHECK_THROWS_WITH(tensor_values<std::uint8_t>(weights, "b", {}),
                      Catch::Contains("expected uint8, a single value") && Catch::Contains("found int8, a single value"));
}

TEST_CASE("an unexpected tensor is refused, and the error names the tensor") {
    named_tensors weights;
    weights.tensors["a"] = {{}, buffer<float>{1.0F}};
    weights.tensors["b"] = {{}, buffer<float>{1.0F}};
    check_no_others(weights, std::array{"a", "b", "c"});
    CHECK_THROWS_WITH(check_no_others(weights, std::array{"a"}), Catch::Contains("tensor b"));
}
