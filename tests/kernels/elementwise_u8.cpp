#include <ldi/kernels/elementwise_u8.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

TEST_CASE("add_u8 adds value by value") {
    const ldi::quantized_addition sum = ldi::make_quantized_addition({0.02F, 128}, {0.03F, 5}, {0.04F, 100});
    std::vector<std::uint8_t> a, b, expected;
    for (int i = 0; i < 1000; ++i) {
        a.push_back(static_cast<std::uint8_t>(i * 7));
        b.push_back(static_cast<std::uint8_t>(i * 13 + 4));
        expected.push_back(ldi::add_quantized(a.back(), b.back(), sum));
    }
    std::vector<std::uint8_t> found(a.size());
    ldi::add_u8(sum, a.data(), b.data(), a.size(), found.data());
    CHECK(found == expected);
    CHECK(ldi::add_quantized(128, 5, sum) == 100);  // zero plus zero is zero
}

TEST_CASE("repeat_pixels_u8 repeats whole pixels") {
    const std::vector<std::uint8_t> row{1, 2, 3, 4};
    std::vector<std::uint8_t> found(12);
    ldi::repeat_pixels_u8(row.data(), 2, 2, 3, found.data());
    CHECK(found == std::vector<std::uint8_t>{1, 2, 1, 2, 1, 2, 3, 4, 3, 4, 3, 4});
}
