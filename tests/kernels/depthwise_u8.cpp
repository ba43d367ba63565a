#include <ldi/kernels/depthwise_u8.hpp>
#include <tests/support/random_bytes.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

namespace {

constexpr std::uint8_t untouched_result = 77;

struct depthwise_case {
    std::size_t channels, width, repeat, stride;
    int missing_row;
    int weight_zero, input_zero;
    ldi::buffer<std::uint8_t> weights, image;
    ldi::buffer<std::int32_t> bias;
    ldi::requantization output;

    ldi::depthwise_u8_weights pack(ldi::isa set) const {
        return ldi::pack_depthwise_u8(set, weights, static_cast<std::uint8_t>(weight_zero), bias, stride,
                                      static_cast<std::uint8_t>(input_zero), output);
    }
    ldi::buffer<std::uint8_t> compute(const ldi::depthwise_u8_weights& packed) const {
        const std::uint8_t* rows[3];
        for (int i = 0; i < 3; ++i)
            rows[i] = i == missing_row ? nullptr : image.data() + static_cast<std::size_t>(i) * width * channels;
        ldi::buffer<std::uint8_t> result(packed->result_width(width, repeat) * channels + 1, untouched_result);
        ldi::depthwise_u8(packed, rows, width, repeat, result.data());
        return result;
    }
    ldi::buffer<std::uint8_t> definition() const {
        ldi::buffer<std::uint8_t> result;
        for (std::size_t x = 0; x < width * repeat; x += stride)
            for (std::size_t c = 0; c < channels; ++c) {
                int sum = bias[c];
                for (std::size_t t = 0; t < 9; ++t) {
                    const std::size_t row = t / 3, column = x + t % 3;
                    if (static_cast<int>(row) == missing_row || column == 0 || column > width * repeat) continue;
                    const std::uint8_t value = image[(row * width + (column - 1) / repeat) * channels + c];
                    sum += (value - input_zero) * (weights[c * 9 + t] - weight_zero);
                }
                result.push_back(ldi::requantize(sum, output));
            }
        result.push_back(untouched_result);  // depthwise_u8() must not write after the result
        return result;
    }
};

depthwise_case any_depthwise_case(ldi::testing::random_bytes& random, std::size_t channels, std::size_t width, std::size_t repeat,
                                  std::size_t stride, int missing_row) {
    depthwise_case made{channels, width, repeat, stride, missing_row, random.in(127, 128), random.in(0, 255), {}, {}, {}, {}};
    made.output = ldi::make_requantization(0.0041F, random.in(0, 1) == 0 ? std::uint8_t{0} : random.byte());
    made.weights = random.bytes(channels * 9);
    made.image = random.bytes(3 * width * channels);
    made.bias = random.integers(channels, -20000, 20000);
    return made;
}

}  // namespace

TEST_CASE("depthwise_u8 matches its definition, with zero padding outside the image") {
    ldi::testing::random_bytes random;
    for (std::size_t channels : {1U, 8U, 15U, 16U, 17U, 40U, 48U})
        for (std::size_t width : {1U, 2U, 3U, 8U, 9U})
            for (std::size_t repeat : {1U, 2U, 3U})
                for (std::size_t stride : {1U, 2U})
                    for (int missing_row : {-1, 0, 2}) {
                        depthwise_case c = any_depthwise_case(random, channels, width, repeat, stride, missing_row);
                        c.weight_zero = random.in(0, 255);
                        CHECK(c.compute(c.pack(ldi::isa::scalar)) == c.definition());
                    }
}

TEST_CASE("depthwise_u8 returns the same bits on every instruction set, for thousands of random shapes") {
    ldi::testing::random_bytes random;
    const std::vector<ldi::isa> sets = ldi::testing::available_isas();
    std::size_t broken = 0, packed_as_asked = 0;
    for (int round = 0; round < 2000; ++round) {
        const std::size_t channels = random.in(0, 1) == 0 ? random.size_in(1, 150) : 8 * random.size_in(1, 16);
        const std::size_t width = round % 50 == 0 ? random.size_in(1, 700) : random.size_in(1, 60);
        const std::size_t repeat = random.in(0, 2) == 0 ? random.size_in(1, 4) : 1;
        depthwise_case c = any_depthwise_case(random, channels, width, repeat, random.size_in(1, 2), random.in(-1, 3));
        if (round % 20 == 0) c.weight_zero = random.in(0, 255);
        const ldi::buffer<std::uint8_t> expected = c.compute(c.pack(ldi::isa::scalar));
        for (ldi::isa set : sets) {
            const ldi::depthwise_u8_weights packed = c.pack(set);
            packed_as_asked += packed->target == ldi::find_kernel(ldi::depthwise_u8_kernels, set).set;
            broken += c.compute(packed) != expected;
        }
    }
    CHECK(broken == 0);
    CHECK(packed_as_asked > sets.size() * 1850);
}

TEST_CASE("depthwise_u8 returns the same bits on every instruction set for extreme weights and inputs") {
    ldi::testing::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 200; ++round) {
        depthwise_case c = any_depthwise_case(random, random.size_in(1, 70), random.size_in(1, 9), random.size_in(1, 2), 1, -1);
        c.weight_zero = round % 4 == 0 ? random.in(0, 255) : random.in(127, 128);
        c.output = ldi::make_requantization(0.0004F, 128);
        for (std::uint8_t& weight : c.weights) weight = random.in(0, 1) == 0 ? 0 : 255;
        for (std::uint8_t& value : c.image) value = random.in(0, 5) == 0 ? random.byte() : 255;
        const ldi::buffer<std::uint8_t> expected = c.compute(c.pack(ldi::isa::scalar));
        for (ldi::isa set : ldi::testing::available_isas()) broken += c.compute(c.pack(set)) != expected;
    }
    CHECK(broken == 0);
}

TEST_CASE("depthwise_u8 of rows without pixels has no pixels and writes nothing") {
    ldi::testing::random_bytes random;
    for (ldi::isa set : ldi::testing::available_isas())
        for (std::size_t stride : {1U, 2U}) {
            const depthwise_case c = any_depthwise_case(random, 20, 0, 2, stride, -1);
            CHECK(c.pack(set)->result_width(0, 2) == 0);
            CHECK(c.compute(c.pack(set)) == ldi::buffer<std::uint8_t>{untouched_result});
        }
}
