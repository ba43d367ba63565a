#include <ldi/kernels/gemm_u8.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <random>
#include <vector>

TEST_CASE("gemm_u8 is the requantised product with both zero points taken off, for all sizes around its tiles") {
    std::mt19937 random(1);
    std::uniform_int_distribution<int> byte(0, 255), offset(-20000, 20000);
    const auto bytes = [&](std::size_t count) {
        std::vector<std::uint8_t> result(count);
        for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(byte(random));
        return result;
    };
    for (std::size_t outputs : {1U, 7U, 8U, 9U, 24U})
        for (std::size_t inputs : {1U, 3U, 8U, 27U, 100U})
            for (std::size_t rows : {0U, 1U, 3U, 4U, 5U, 13U}) {
                const std::vector<std::uint8_t> weights = bytes(outputs * inputs), input = bytes(rows * inputs);
                const int weight_zero = byte(random), input_zero = byte(random);
                std::vector<std::int32_t> bias(outputs);
                for (std::int32_t& value : bias) value = offset(random);
                const ldi::requantization r = ldi::make_requantization(0.0021F, 128);
                const ldi::gemm_u8_weights packed = ldi::pack_gemm_u8(weights, static_cast<std::uint8_t>(weight_zero), bias,
                                                                      static_cast<std::uint8_t>(input_zero), r);
                std::vector<std::uint8_t> expected, found(rows * outputs + 1, 77);
                for (std::size_t p = 0; p < rows; ++p)
                    for (std::size_t o = 0; o < outputs; ++o) {
                        int sum = bias[o];
                        for (std::size_t i = 0; i < inputs; ++i)
                            sum += (input[p * inputs + i] - input_zero) * (weights[o * inputs + i] - weight_zero);
                        expected.push_back(ldi::requantize(sum, r));
                    }
                expected.push_back(77);  // nothing is written behind the result
                ldi::gemm_u8(packed, input.data(), rows, found.data());
                CHECK(found == expected);
            }
}

TEST_CASE("gemm_u8 does not overflow at the limit that packing documents") {
    const std::size_t inputs = 16000;  // 510 * 255 * 16000 < 2^31
    const std::vector<std::uint8_t> weights(inputs, 0), input(inputs, 0);
    const std::vector<std::int32_t> bias{60000000};
    const ldi::requantization r = ldi::make_requantization(0x1p-24F, 0);
    std::uint8_t found = 0;
    ldi::gemm_u8(ldi::pack_gemm_u8(weights, 255, bias, 255, r), input.data(), 1, &found);
    CHECK(found == ldi::requantize(255 * 255 * 16000 + 60000000, r));
    CHECK(found == 66);
}
