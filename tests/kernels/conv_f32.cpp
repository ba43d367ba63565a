#include <ldi/kernels/conv_f32.hpp>

#include "tests/support/random_bytes.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

namespace {

constexpr float untouched = 777.0F;
using floats = std::vector<float>;

floats random_floats(ldi_test::random_bytes& random, std::size_t count) {
    floats values(count);
    for (float& v : values) v = static_cast<float>(random.in(-1000, 1000)) / 1000.0F;
    return values;
}

struct convolution {
    std::size_t rows, inputs, outputs, pixels, stride;
    floats weights, bias, input, ratios;
    float slope;

    std::size_t row_floats() const { return (pixels == 0 ? 0 : (pixels - 1) * stride) + inputs; }
    std::vector<const float*> starts(std::size_t first_pixel = 0) const {
        std::vector<const float*> result;
        for (std::size_t r = 0; r < rows; ++r) result.push_back(input.data() + r * row_floats() + first_pixel * stride);
        return result;
    }
    ldi::conv_f32_weights pack(ldi::isa set) const { return ldi::pack_conv_f32(set, weights, bias, rows, {slope}); }
    floats compute(const ldi::conv_f32_weights& packed) const {
        floats result(pixels * outputs + 1, untouched);
        ldi::conv_f32(packed, starts().data(), stride, pixels, ratios.empty() ? nullptr : ratios.data(), result.data());
        return result;
    }
    /// The same, in calls for any numbers of pixels.
    floats compute_in_pieces(const ldi::conv_f32_weights& packed, ldi_test::random_bytes& random) const {
        floats result(pixels * outputs + 1, untouched);
        for (std::size_t p = 0; p < pixels;) {
            const std::size_t count = std::min(pixels - p, random.size_in(1, 9));
            ldi::conv_f32(packed, starts(p).data(), stride, count, ratios.empty() ? nullptr : ratios.data() + p,
                          result.data() + p * outputs);
            p += count;
        }
        return result;
    }
    bool is_near_definition(const floats& result) const {
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
                if (std::abs(expected - double{result[p * outputs + o]}) > 1e-5 * (scale * ratio + std::abs(double{bias[o]})))
                    return false;
            }
        return result.back() == untouched;  // nothing is written behind the result
    }
};

convolution any_convolution(ldi_test::random_bytes& random, std::size_t rows, std::size_t inputs, std::size_t outputs,
                            std::size_t pixels) {
    const float slopes[] = {1.0F, 0.0F, 0.2F};
    convolution c{rows, inputs, outputs, pixels, random.size_in(1, static_cast<int>(inputs) + 5), {}, {}, {}, {}, 0.0F};
    c.slope = slopes[random.size_in(0, 2)];
    c.weights = random_floats(random, outputs * rows * inputs), c.bias = random_floats(random, outputs);
    c.input = random_floats(random, rows * c.row_floats());
    if (random.in(0, 1) == 1) {
        c.ratios = random_floats(random, pixels);
        for (float& ratio : c.ratios) ratio += 1.5F;
    }
    return c;
}

}  // namespace

TEST_CASE("conv_f32 is the sum of products, scaled, with bias and activation, for all sizes round its tiles") {
    ldi_test::random_bytes random;
    for (const ldi::isa set : ldi_test::available_isas())
        for (std::size_t outputs : {1U, 3U, 8U, 9U, 16U, 17U, 24U, 25U, 40U, 41U, 48U, 72U})
            for (std::size_t inputs : {1U, 7U, 36U})
                for (std::size_t pixels : {0U, 1U, 2U, 5U, 11U, 12U, 13U, 24U, 31U, 49U}) {
                    const convolution c = any_convolution(random, 1 + outputs % 3, inputs, outputs, pixels);
                    INFO("instruction set " << std::string(to_string(set)) << ", " << outputs << " outputs, " << inputs
                                            << " inputs, " << pixels << " pixels");
                    CHECK(c.is_near_definition(c.compute(c.pack(set))));
                }
}

TEST_CASE("conv_f32 gives a pixel the same bits however the pixels are cut into calls") {
    ldi_test::random_bytes random;
    for (const ldi::isa set : ldi_test::available_isas())
        for (int round = 0; round < 150; ++round) {
            const convolution c = any_convolution(random, random.size_in(1, 7), random.size_in(1, 40), random.size_in(1, 90),
                                                  random.size_in(1, 70));
            const ldi::conv_f32_weights packed = c.pack(set);
            REQUIRE(c.compute(packed) == c.compute_in_pieces(packed, random));
        }
}

TEST_CASE("a ratio of 1 changes no bit") {
    ldi_test::random_bytes random;
    for (const ldi::isa set : ldi_test::available_isas()) {
        convolution c = any_convolution(random, 3, 17, 21, 30);
        c.ratios.clear();
        const floats without = c.compute(c.pack(set));
        c.ratios.assign(30, 1.0F);
        CHECK(c.compute(c.pack(set)) == without);
    }
}
