// Tests that kernels assert their documented limits. A failed assertion is an exception here.
namespace {
struct failed_assertion {};
void check(bool holds) {
    if (!holds) throw failed_assertion();
}
}  // namespace
#define LDI_STANDARD_ONLY  // the limits hold for every instruction set, and portable code alone compiles in a quarter of the time
#undef LDI_ASSERT
#define LDI_ASSERT(condition) check(condition)

#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

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
ldi::conv_u8_weights packed_convolution(const std::vector<std::int8_t>& weights) {
    const std::vector<std::uint8_t> zero_points(weights.size());
    const float scale = 1.0F, bias = 0.0F;
    return ldi::pack_conv_u8(ldi::isa::scalar, weights, zero_points, {&scale, 1}, {&bias, 1}, 1, ldi::no_activation, 0);
}

}  // namespace

TEST_CASE("gemm_u8 packs weights up to its documented limit, and asserts that 32-bit sums do not overflow") {
    constexpr std::int32_t rest = 2147483647 - 510 * 255 * 16000;
    CHECK(packed_product(16000, rest)->bias[0] == rest + 255 * 255 * 16000);
    CHECK_THROWS_AS(packed_product(16000, rest + 1), failed_assertion);
    CHECK_THROWS_AS(packed_product(16000, -rest - 1), failed_assertion);
    CHECK_THROWS_AS(packed_product(1 << 24, 0), failed_assertion);
    CHECK_THROWS_AS(packed_product(1, -2147483647 - 1), failed_assertion);
}

TEST_CASE("depthwise_u8 packs biases below 2^30, and asserts this limit") {
    CHECK(packed_depthwise((1 << 30) - 1)->bias[0] == (1 << 30) - 1 + 9 * 255 * 255);
    CHECK_THROWS_AS(packed_depthwise(1 << 30), failed_assertion);
    CHECK_THROWS_AS(packed_depthwise(-(1 << 30)), failed_assertion);
    CHECK_THROWS_AS(packed_depthwise(-2147483647 - 1), failed_assertion);
}

TEST_CASE("gemm_u8 packs 1 to 7 segments, and asserts this limit") {
    const ldi::buffer<std::uint8_t> weights(7 * 8);
    const auto packed = [&](std::size_t segments) {
        return ldi::pack_gemm_u8(ldi::isa::scalar, weights, 0, ldi::buffer<std::int32_t>{0}, segments, 0, output);
    };
    CHECK(packed(7)->inputs == 8);
    CHECK_THROWS_AS(packed(8), failed_assertion);
    CHECK_THROWS_AS(packed(0), failed_assertion);
}

TEST_CASE("depthwise_u8 repeats pixels 1 to 4 times, and asserts this limit") {
    const ldi::depthwise_u8_weights weights = packed_depthwise(0);
    const std::uint8_t pixel = 0, *const rows[3] = {&pixel, &pixel, &pixel};
    std::uint8_t result[5];
    CHECK_NOTHROW(ldi::depthwise_u8(weights, rows, 1, 4, result));
    CHECK_THROWS_AS(ldi::depthwise_u8(weights, rows, 1, 5, result), failed_assertion);
    CHECK_THROWS_AS(ldi::depthwise_u8(weights, rows, 1, 0, result), failed_assertion);
}

TEST_CASE("conv_u8 packs weights from -63 to 63, and asserts this limit") {
    CHECK(packed_convolution({-63, 63})->inputs == 2);
    CHECK_THROWS_AS(packed_convolution({-64, 0}), failed_assertion);
    CHECK_THROWS_AS(packed_convolution({0, 64}), failed_assertion);
}

TEST_CASE("conv_f32 and conv_u8 assert that there is at least one input") {
    const float bias = 0.0F;
    CHECK_THROWS_AS(ldi::pack_conv_f32(ldi::isa::scalar, {}, {&bias, 1}, 1, ldi::no_activation), failed_assertion);
    CHECK_THROWS_AS(packed_convolution({}), failed_assertion);
}
