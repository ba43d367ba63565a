// Tests that packing asserts the documented limits of weights and biases. A failed assertion is an exception here.
namespace {
struct failed_assertion {};
void check(bool holds) {
    if (!holds) throw failed_assertion();
}
}  // namespace
#define LDI_STANDARD_ONLY  // the limits hold for every instruction set, and portable code alone compiles in a quarter of the time
#undef LDI_ASSERT
#define LDI_ASSERT(condition) check(condition)

#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>

namespace {

const ldi::requantization output = ldi::make_requantization(0x1p-24F, 0);

ldi::gemm_u8_weights packed_product(std::size_t inputs, std::int32_t bias) {
    const ldi::buffer<std::uint8_t> weights(inputs, 0);
    return ldi::pack_gemm_u8(ldi::isa::scalar, weights, 255, ldi::buffer<std::int32_t>{bias}, 1, 255, output);
}
ldi::depthwise_u8_weights packed_depthwise(std::int32_t bias) {
    const ldi::buffer<std::uint8_t> weights(9, 0);
    return ldi::pack_depthwise_u8(ldi::isa::scalar, weights, 255, ldi::buffer<std::int32_t>{bias}, 1, 255, output);
}

}  // namespace

TEST_CASE("gemm_u8 packs weights up to its documented limit, and asserts that 32-bit sums do not overflow") {
    constexpr std::int32_t rest = 2147483647 - 510 * 255 * 16000;
    CHECK(packed_product(16000, rest).bias[0] == rest + 255 * 255 * 16000);
    CHECK_THROWS_AS(packed_product(16000, rest + 1), failed_assertion);
    CHECK_THROWS_AS(packed_product(16000, -rest - 1), failed_assertion);
    CHECK_THROWS_AS(packed_product(1 << 24, 0), failed_assertion);
    CHECK_THROWS_AS(packed_product(1, -2147483647 - 1), failed_assertion);
}

TEST_CASE("depthwise_u8 packs biases below 2^30, and asserts this limit") {
    CHECK(packed_depthwise((1 << 30) - 1).bias[0] == (1 << 30) - 1 + 9 * 255 * 255);
    CHECK_THROWS_AS(packed_depthwise(1 << 30), failed_assertion);
    CHECK_THROWS_AS(packed_depthwise(-(1 << 30)), failed_assertion);
    CHECK_THROWS_AS(packed_depthwise(-2147483647 - 1), failed_assertion);
}
