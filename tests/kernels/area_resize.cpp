#include <ldi/kernels/area_resize.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

namespace {

ldi::buffer<std::uint8_t> resized(const ldi::buffer<std::uint8_t>& image, std::size_t height, std::size_t width,
                                  std::size_t new_height, std::size_t new_width) {
    const std::size_t channels = image.size() / (height * width);
    const ldi::area_weights horizontal = ldi::make_area_weights(width, new_width),
                            vertical = ldi::make_area_weights(height, new_height);
    ldi::buffer<std::uint8_t> result(new_height * new_width * channels);
    ldi::buffer<float> sums;
    for (std::size_t y = 0; y < new_height; ++y)
        ldi::area_resize_row(horizontal, vertical, y, {image.data(), height, width, channels}, sums,
                             result.data() + y * new_width * channels);
    return result;
}

ldi::buffer<std::uint8_t> noise(std::size_t count) {
    std::mt19937 random(5);
    ldi::buffer<std::uint8_t> result(count);
    for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(random() >> 24);
    return result;
}

}  // namespace

TEST_CASE("the weights of every result pixel add up to one, and every source pixel contributes equally") {
    for (std::size_t source : {1U, 2U, 3U, 31U, 384U, 1000U, 4032U})
        for (std::size_t result : {1U, 2U, 3U, 32U, 288U, 384U, 1000U}) {
            const ldi::area_weights made = ldi::make_area_weights(source, result);
            REQUIRE(made.covers.size() == result);
            ldi::buffer<double> shares(source);
            double worst = 0;
            for (const auto& cover : made.covers) {
                double sum = 0;
                for (std::size_t i = 0; i < cover.count; ++i) {
                    const double weight = static_cast<double>(made.weights[cover.weight + i]);
                    CHECK(weight > 0);
                    sum += weight;
                    shares[cover.first + i] += weight;
                }
                worst = std::max(worst, std::abs(sum - 1));
            }
            const double share = static_cast<double>(result) / static_cast<double>(source);
            for (double s : shares) worst = std::max(worst, std::abs(s - share) / std::max(1.0, share));
            CHECK(worst < 1e-5);
        }
}

TEST_CASE("resizing to the same size changes nothing, and a flat image stays flat at any size") {
    const ldi::buffer<std::uint8_t> image = noise(17 * 11 * 3);
    CHECK(resized(image, 17, 11, 17, 11) == image);
    for (std::uint8_t value : {std::uint8_t{0}, std::uint8_t{93}, std::uint8_t{255}})
        CHECK(resized(ldi::buffer<std::uint8_t>(17 * 11, value), 17, 11, 32, 7) == ldi::buffer<std::uint8_t>(32 * 7, value));
}

TEST_CASE("every result pixel is the mean of the area that it covers, up to rounding") {
    const std::size_t height = 37, width = 53, new_height = 12, new_width = 64;
    const ldi::buffer<std::uint8_t> image = noise(height * width), found = resized(image, height, width, new_height, new_width);
    double worst = 0;
    for (std::size_t y = 0; y < new_height; ++y)
        for (std::size_t x = 0; x < new_width; ++x) {
            double sum = 0;
            for (std::size_t v = 0; v < height; ++v)
                for (std::size_t u = 0; u < width; ++u) {
                    const auto overlap = [](double a, double b, double c, double d) {
                        return std::max(0.0, std::min(b, d) - std::max(a, c));
                    };
                    const double step_y = static_cast<double>(height) / new_height,
                                 step_x = static_cast<double>(width) / new_width;
                    const double fy = static_cast<double>(y), fx = static_cast<double>(x), fv = static_cast<double>(v),
                                 fu = static_cast<double>(u);
                    sum += overlap(fy * step_y, (fy + 1) * step_y, fv, fv + 1) / step_y *
                           overlap(fx * step_x, (fx + 1) * step_x, fu, fu + 1) / step_x * image[v * width + u];
                }
            worst = std::max(worst, std::abs(sum - found[y * new_width + x]));
        }
    CHECK(worst < 0.501);
    CHECK(worst > 0.4);
}

TEST_CASE("sums of area_resize have the same bits on every machine, with or without fused multiply-add") {
    const ldi::buffer<std::uint8_t> image = noise(61 * 47 * 3);
    const ldi::area_weights horizontal = ldi::make_area_weights(47, 30), vertical = ldi::make_area_weights(61, 19);
    std::uint32_t checksum = 0;
    for (const ldi::area_weights::cover& rows : vertical.covers) {
        ldi::buffer<float> sums(30 * 3);
        for (std::size_t i = 0; i < rows.count; ++i)
            ldi::add_area_row(horizontal, image.data() + (rows.first + i) * 47 * 3, 3, vertical.weights[rows.weight + i],
                              sums.data());
        for (float sum : sums) {
            std::uint32_t bits = 0;
            std::memcpy(&bits, &sum, sizeof bits);
            checksum = checksum * 16777619U + bits;
        }
    }
    CHECK(checksum == 0xACD0BA5C);
}

TEST_CASE("area_resize rounds ties to the even neighbor") {
    CHECK(resized({0, 1}, 1, 2, 1, 1) == ldi::buffer<std::uint8_t>{0});
    CHECK(resized({1, 2}, 1, 2, 1, 1) == ldi::buffer<std::uint8_t>{2});
    CHECK(resized({254, 255}, 2, 1, 1, 1) == ldi::buffer<std::uint8_t>{254});
}
