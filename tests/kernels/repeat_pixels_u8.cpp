#include <ldi/kernels/repeat_pixels_u8.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

TEST_CASE("repeat_pixels_u8 repeats whole pixels") {
    const std::vector<std::uint8_t> row{1, 2, 3, 4};
    std::vector<std::uint8_t> found(12);
    ldi::repeat_pixels_u8(row.data(), 2, 2, 3, found.data());
    CHECK(found == std::vector<std::uint8_t>{1, 2, 1, 2, 1, 2, 3, 4, 3, 4, 3, 4});
}
