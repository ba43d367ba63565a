#include <ldi/kernels/depthwise_u8.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <random>
#include <vector>

TEST_CASE("depthwise_u8 sums the 3 x 3 neighbourhood of each channel; what lies outside the image counts as zero") {
    std::mt19937 random(1);
    std::uniform_int_distribution<int> byte(0, 255), offset(-20000, 20000);
    const auto bytes = [&](std::size_t count) {
        std::vector<std::uint8_t> result(count);
        for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(byte(random));
        return result;
    };
    for (std::size_t channels : {1U, 8U, 15U, 16U, 17U, 40U, 48U})
        for (std::size_t width : {1U, 2U, 3U, 8U, 9U})
            for (std::size_t stride : {1U, 2U})
                for (int missing_row : {-1, 0, 2}) {
                    const std::vector<std::uint8_t> weights = bytes(channels * 9), image = bytes(3 * width * channels);
                    const int weight_zero = byte(random), input_zero = byte(random);
                    std::vector<std::int32_t> bias(channels);
                    for (std::int32_t& value : bias) value = offset(random);
                    const ldi::requantization r = ldi::make_requantization(0.0021F, 127);
                    const ldi::depthwise_u8_weights packed = ldi::pack_depthwise_u8(
                        weights, static_cast<std::uint8_t>(weight_zero), bias, static_cast<std::uint8_t>(input_zero), r);
                    const std::uint8_t* rows[3];
                    for (int i = 0; i < 3; ++i)
                        rows[i] = i == missing_row ? nullptr : image.data() + static_cast<std::size_t>(i) * width * channels;

                    std::vector<std::uint8_t> expected;
                    for (std::size_t x = 0; x < width; x += stride)
                        for (std::size_t c = 0; c < channels; ++c) {
                            int sum = bias[c];
                            for (std::size_t t = 0; t < 9; ++t) {
                                const std::size_t column = x + t % 3;
                                if (rows[t / 3] == nullptr || column == 0 || column > width) continue;
                                sum +=
                                    (rows[t / 3][(column - 1) * channels + c] - input_zero) * (weights[c * 9 + t] - weight_zero);
                            }
                            expected.push_back(ldi::requantize(sum, r));
                        }
                    expected.push_back(77);  // nothing is written behind the result
                    std::vector<std::uint8_t> found(expected.size(), 77);
                    ldi::depthwise_u8(packed, rows, width, stride, found.data());
                    CHECK(found == expected);
                }
}
