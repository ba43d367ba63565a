// Tests kernels/conv_f32.hpp and kernels/conv_u8.hpp.
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>

#include "tests/support/random_bytes.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace {

constexpr float untouched_value = 776.0F;
using floats = ldi::buffer<float>;

floats random_numbers(ldi::testing::random_bytes& random, std::size_t count) {
    floats values(count);
    for (float& v : values) v = static_cast<float>(random.in(-1000, 1000)) / 1000.0F;
    return values;
}

struct convolution {
    using results = std::vector<float>;

    std::size_t rows, inputs, outputs, pixels, stride;
    floats weights, bias;
    floats input;
    floats ratios;
    float slope;

    std::size_t row_values() const { return (pixels == 0 ? 0 : (pixels - 1) * stride) + inputs; }
    std::vector<const float*> starts(std::size_t first_pixel = 0) const {
        std::vector<const float*> result;
        for (std::size_t r = 0; r < rows; ++r) result.push_back(input.data() + r * row_values() + first_pixel * stride);
        return result;
    }
    ldi::conv_f32_weights packed(ldi::isa set) const { return ldi::pack_conv_f32(set, weights, bias, rows, {slope}); }
    results compute(const ldi::conv_f32_weights& with) const {
        results result(pixels * outputs + 1, untouched_value);
        ldi::conv_f32(with, starts().data(), stride, pixels, ratios.empty() ? nullptr : ratios.data(), result.data());
        return result;
    }
    /// Computes the same result in calls with random numbers of pixels.
    results compute_in_pieces(const ldi::conv_f32_weights& with, ldi::testing::random_bytes& random) const {
        results result(pixels * outputs + 1, untouched_value);
        for (std::size_t p = 0; p < pixels;) {
            const std::size_t count = std::min(pixels - p, random.size_in(1, 9));
            ldi::conv_f32(with, starts(p).data(), stride, count, ratios.empty() ? nullptr : ratios.data() + p,
                          result.data() + p * outputs);
            p += count;
        }
        return result;
    }
    bool is_near_definition(const results& result) const {
        for (std::size_t p = 0; p < pixels; ++p)
            for (std::size_t o = 0; o < outputs; ++o) {
                double sum = 0, scale = 0;
                for (std::size_t r = 0; r < rows; ++r)
                    for (std::size_t i = 0; i < inputs; ++i) {
                        const double product = double{starts()[r][p * stride + i]} * double{weights[(o * rows + r) * inputs + i]};
                        sum += product, scale += std::abs(product);
                    }
                const double ratio = ratios.empty() ? 1.0 : double{ratios[p]};
                const double value = sum * ratio + double{bias[o]};
                const double expected = value > 0 ? value : value * double{slope};
                const double difference = std::abs(expected - double{result[p * outputs + o]});
                if (difference > 1e-5 * (scale * ratio + std::abs(double{bias[o]}))) return false;
            }
        return result.back() == untouched_value;  // conv_f32() must not write after the result
    }

    static convolution any(ldi::testing::random_bytes& random, std::size_t rows, std::size_t inputs, std::size_t outputs,
                           std::size_t pixels) {
        const float slopes[] = {1.0F, 0.0F, 0.2F};
        convolution c{rows, inputs, outputs, pixels, random.size_in(1, static_cast<int>(inputs) + 5), {}, {}, {}, {}, 0.0F};
        c.slope = slopes[random.size_in(0, 2)];
        c.weights = random_numbers(random, outputs * rows * inputs), c.bias = random_numbers(random, outputs);
        c.input = random_numbers(random, rows * c.row_values());
        if (random.in(0, 1) == 1) {
            c.ratios = random_numbers(random, pixels);
            for (float& ratio : c.ratios) ratio += 1.5F;
        }
        return c;
    }
};

}  // namespace

TEST_CASE("conv_f32 matches its definition for all sizes around its tiles") {
    ldi::testing::random_bytes random;
    for (const ldi::isa set : ldi::testing::available_isas())
        for (std::size_t outputs : {1U, 3U, 8U, 9U, 16U, 17U, 24U, 25U, 40U, 41U, 48U, 72U})
            for (std::size_t inputs : {1U, 7U, 36U})
                for (std::size_t pixels : {0U, 1U, 2U, 5U, 11U, 12U, 13U, 24U, 31U, 49U}) {
                    const convolution c = convolution::any(random, 1 + outputs % 3, inputs, outputs, pixels);
                    INFO("instruction set " << std::string(to_string(set)) << ", " << outputs << " outputs, " << inputs
                                            << " inputs, " << pixels << " pixels");
                    CHECK(c.is_near_definition(c.compute(c.packed(set))));
                }
}

TEST_CASE("conv_f32 returns the same bits for any split of the pixels into calls") {
    ldi::testing::random_bytes random;
    for (const ldi::isa set : ldi::testing::available_isas())
        for (int round = 0; round < 150; ++round) {
            const convolution c = convolution::any(random, random.size_in(1, 7), random.size_in(1, 40), random.size_in(1, 90),
                                                   random.size_in(1, 70));
            const auto packed = c.packed(set);
            REQUIRE((c.compute(packed) == c.compute_in_pieces(packed, random)));
        }
}

TEST_CASE("conv_f32 returns the same bits with a ratio of 1 per pixel as without ratios") {
    ldi::testing::random_bytes random;
    for (const ldi::isa set : ldi::testing::available_isas()) {
        convolution c = convolution::any(random, 3, 17, 21, 30);
        c.ratios.clear();
        const auto without = c.compute(c.packed(set));
        c.ratios.assign(30, 1.0F);
        CHECK((c.compute(c.packed(set)) == without));
    }
}

namespace {

struct byte_convolution {
    std::size_t rows, inputs, outputs, pixels, stride;
    ldi::buffer<std::int8_t> weights;
    ldi::buffer<std::uint8_t> zero_points, input;
    floats scales, bias, ratios;
    float slope;
    std::uint8_t result_zero_point;

    std::size_t row_values() const { return (pixels - 1) * stride + inputs; }
    const float* ratios_from(std::size_t pixel) const { return ratios.empty() ? nullptr : ratios.data() + pixel; }
    ldi::conv_u8_weights packed(ldi::isa set) const {
        return ldi::pack_conv_u8(set, weights, zero_points, scales, bias, rows, {slope}, result_zero_point);
    }
    /// Computes the result in calls with at most this many pixels each.
    template <class Result>
    std::vector<Result> compute(ldi::isa set, int max_pixels, ldi::testing::random_bytes& random) const {
        const ldi::conv_u8_weights with = packed(set);
        std::vector<Result> result(pixels * outputs + 1, Result{77});
        for (std::size_t p = 0; p < pixels;) {
            const std::size_t count = std::min(pixels - p, random.size_in(1, max_pixels));
            std::vector<const std::uint8_t*> starts;
            for (std::size_t r = 0; r < rows; ++r) starts.push_back(input.data() + r * row_values() + p * stride);
            ldi::conv_u8(with, starts.data(), stride, count, ratios_from(p), result.data() + p * outputs);
            p += count;
        }
        return result;
    }
    double by_definition(std::size_t p, std::size_t o) const {
        int sum = 0;
        for (std::size_t r = 0; r < rows; ++r)
            for (std::size_t i = 0; i < inputs; ++i)
                sum += (input[r * row_values() + p * stride + i] - zero_points[i]) * weights[(o * rows + r) * inputs + i];
        const double value = sum * double{scales[o]} * (ratios.empty() ? 1.0 : double{ratios[p]}) + double{bias[o]};
        return value > 0 ? value : value * double{slope};
    }

    static byte_convolution any(ldi::testing::random_bytes& random) {
        const float slopes[] = {1.0F, 0.0F, 0.2F};
        byte_convolution c{random.size_in(1, 7),
                           random.size_in(1, 40),
                           random.size_in(1, 90),
                           random.size_in(1, 70),
                           0,
                           {},
                           {},
                           {},
                           {},
                           {},
                           {},
                           slopes[random.in(0, 2)],
                           random.byte()};
        c.stride = random.size_in(1, static_cast<int>(c.inputs) + 5);
        for (const std::int32_t w : random.integers(c.outputs * c.rows * c.inputs, -63, 63))
            c.weights.push_back(static_cast<std::int8_t>(w));
        c.zero_points = random.bytes(c.inputs), c.input = random.bytes(c.rows * c.row_values());
        for (std::size_t o = 0; o < c.outputs; ++o) {
            c.scales.push_back(static_cast<float>(random.in(1, 1000)) / 3e6F);
            c.bias.push_back(static_cast<float>(random.in(-1000, 1000)) / 10.0F);
        }
        if (random.in(0, 1) == 1) c.ratios.resize(c.pixels);
        for (float& ratio : c.ratios) ratio = static_cast<float>(random.in(0, 2000)) / 500.0F;
        return c;
    }
};

}  // namespace

TEST_CASE(
    "conv_u8 matches its definition up to rounding, with the same bits on every instruction set and for any split of the pixels "
    "into calls") {
    ldi::testing::random_bytes random;
    for (int round = 0; round < 200; ++round) {
        const byte_convolution c = byte_convolution::any(random);
        const auto bytes = c.compute<std::uint8_t>(ldi::isa::scalar, 9, random);
        const auto numbers = c.compute<float>(ldi::isa::scalar, 9, random);
        bool near = bytes.back() == 77 && numbers.back() == 77.0F;
        for (std::size_t p = 0; p < c.pixels; ++p)
            for (std::size_t o = 0; o < c.outputs; ++o) {
                const double expected = c.by_definition(p, o), tolerance = 1e-4 * (1.0 + std::abs(expected));
                const double byte = std::clamp(expected + c.result_zero_point, 0.0, 255.0);
                near = near && std::abs(double{numbers[p * c.outputs + o]} - expected) <= tolerance;
                near = near && std::abs(bytes[p * c.outputs + o] - byte) <= 0.5 + tolerance;
            }
        REQUIRE(near);
        for (const ldi::isa set : ldi::testing::available_isas()) {
            INFO("instruction set " << std::string(to_string(set)));
            REQUIRE((c.compute<std::uint8_t>(set, 70, random) == bytes));
            REQUIRE((c.compute<float>(set, 9, random) == numbers));
        }
    }
}

TEST_CASE("conv_f32 turns infinite sums into 0 or infinity, and keeps NaN, on every instruction set") {
    constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    constexpr std::size_t pixels = 30;
    for (const ldi::isa set : ldi::testing::available_isas())
        for (const std::size_t outputs : {1U, 7U, 8U, 24U, 40U}) {
            INFO("instruction set " << std::string(to_string(set)) << ", " << outputs << " outputs");
            const floats weights(outputs, 1.0F), bias(outputs, 0.0F);
            const auto every_result = [&](float input, float slope, auto is_expected) {
                const floats inputs(pixels, input);
                const float* const start = inputs.data();
                floats result(pixels * outputs);
                ldi::conv_f32(ldi::pack_conv_f32(set, weights, bias, 1, {slope}), &start, 1, pixels, nullptr, result.data());
                return std::all_of(result.begin(), result.end(), is_expected);
            };
            const auto is = [](float expected) { return [expected](float v) { return v >= expected && v <= expected; }; };
            CHECK(every_result(-infinity, 0.0F, is(0.0F)));
            CHECK(every_result(-infinity, 0.2F, is(-infinity)));
            CHECK(every_result(-infinity, 1.0F, is(-infinity)));
            for (const float slope : {0.0F, 0.2F, 1.0F}) {
                CHECK(every_result(infinity, slope, is(infinity)));
                CHECK(every_result(nan, slope, [](float v) { return std::isnan(v); }));
            }
        }
}

TEST_CASE("conv_u8 clamps infinite sums to bytes, and turns NaN into 0, on every instruction set") {
    constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    constexpr std::size_t pixels = 30;
    for (const ldi::isa set : ldi::testing::available_isas())
        for (const std::size_t outputs : {1U, 7U, 8U, 24U, 40U}) {
            INFO("instruction set " << std::string(to_string(set)) << ", " << outputs << " outputs");
            const ldi::buffer<std::int8_t> weights(outputs, 1);
            const floats scales(outputs, 1.0F), bias(outputs, 0.0F);
            const auto compute = [&](std::uint8_t input, float ratio, float slope, auto& result) {
                const ldi::buffer<std::uint8_t> inputs(pixels, input), zero_points(1, 10);
                const std::uint8_t* const start = inputs.data();
                const floats ratios(pixels, ratio);
                result.resize(pixels * outputs);
                ldi::conv_u8(ldi::pack_conv_u8(set, weights, zero_points, scales, bias, 1, {slope}, 7), &start, 1, pixels,
                             ratios.data(), result.data());
            };
            const auto every_byte = [&](std::uint8_t input, float ratio, float slope, std::uint8_t expected) {
                ldi::buffer<std::uint8_t> result;
                compute(input, ratio, slope, result);
                return result == ldi::buffer<std::uint8_t>(pixels * outputs, expected);
            };
            CHECK(every_byte(9, infinity, 0.0F, 7));
            CHECK(every_byte(9, infinity, 0.2F, 0));
            CHECK(every_byte(11, infinity, 0.0F, 255));
            CHECK(every_byte(11, infinity, 0.2F, 255));
            for (const float slope : {0.0F, 0.2F, 1.0F}) CHECK(every_byte(11, nan, slope, 0));
            floats result;
            compute(9, infinity, 0.0F, result);
            CHECK(std::all_of(result.begin(), result.end(), [](float v) { return v >= 0.0F && v <= 0.0F; }));
        }
}
