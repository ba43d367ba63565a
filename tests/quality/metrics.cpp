// Tests the measures of bench/quality.
#include <bench/quality/depth_metrics.hpp>
#include <bench/quality/metrics.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>

namespace {

using namespace ldi_quality;

picture uniform(std::size_t height, std::size_t width, std::uint8_t value) { return {height, width, 3, value}; }

picture noise(std::size_t height, std::size_t width, unsigned seed) {
    std::mt19937 random(seed);
    picture result(height, width, 3);
    for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(random() % 256);
    return result;
}

const mask all(20, 30, 1, std::uint8_t{1}), none(20, 30, 1, std::uint8_t{0});

}  // namespace

TEST_CASE("PSNR is 20 log10(255 / difference) for a uniform difference, and counts only the selected pixels") {
    const picture a = uniform(20, 30, 100);
    picture b = uniform(20, 30, 110);
    CHECK(psnr(a, b, all) == Approx(20 * std::log10(25.5)));
    CHECK(psnr(a, a, all) == 60);
    CHECK(psnr(a, b, none) == 60);
    mask left = none;
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 10; ++x) left(y, x, 0) = 1;
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 10; x < 30; ++x) b(y, x, 1) = 255;
    CHECK(psnr(a, b, left) == Approx(20 * std::log10(25.5)));
    CHECK(psnr(a, b, all) < psnr(a, b, left));
    CHECK(share(left) == Approx(1.0 / 3));
}

TEST_CASE("SSIM is 1 for equal pictures, its luminance term for uniform ones, and about 0 for independent noise") {
    const picture a = uniform(20, 30, 100), b = uniform(20, 30, 150);
    const double c1 = 6.5025;
    CHECK(ssim(noise(20, 30, 1), noise(20, 30, 1), all) == Approx(1));
    CHECK(ssim(a, b, all) == Approx((2 * 100 * 150 + c1) / (100 * 100 + 150 * 150 + c1)).epsilon(0.001));
    CHECK(std::abs(ssim(noise(20, 30, 1), noise(20, 30, 2), all)) < 0.1);
    CHECK(ssim(a, b, none) == 1);
}

TEST_CASE("aligned() fits scale and shift to the known pixels only, and only the shift if the estimate is constant") {
    std::mt19937 random(5);
    map estimate(20, 30), truth(20, 30);
    pixel_set known(20, 30, 1, std::uint8_t{1});
    for (std::size_t i = 0; i < estimate.size(); ++i) {
        estimate.data()[i] = std::uniform_real_distribution<double>(0, 1)(random);
        truth.data()[i] = 3 * estimate.data()[i] + 0.25;
    }
    for (std::size_t x = 0; x < 30; ++x) known(7, x, 0) = 0, truth(7, x, 0) = 1e6;
    const map fitted = aligned(estimate, truth, known);
    for (std::size_t i = 0; i < fitted.size(); ++i) REQUIRE(fitted.data()[i] == Approx(3 * estimate.data()[i] + 0.25));

    const map flat = aligned(map(20, 30, 1, 0.7), truth, known);
    double mean = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) mean += known.data()[i] != 0 ? truth.data()[i] / (19.0 * 30) : 0;
    CHECK(flat(3, 3, 0) == Approx(mean));
}

TEST_CASE("edge and boundary agreement is 1 for equal maps and 0 without edges, and wrong_order() is 1 for reversed depth") {
    const pixel_set known(60, 60, 1, std::uint8_t{1});
    map step(60, 60), ramp(60, 60);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 60; ++x) {
            step(y, x, 0) = x >= 20 && x < 40 && y >= 20 && y < 40 ? 2 : 1;
            ramp(y, x, 0) = 1 + static_cast<double>(x) / 59;
        }
    CHECK(edge_agreement(step, step, known) == Approx(1));
    CHECK(boundary_agreement(step, step, known) == Approx(1));
    CHECK(edge_agreement(ramp, step, known) == 0);
    CHECK(boundary_agreement(ramp, step, known) == 0);
    CHECK(std::isnan(edge_agreement(step, ramp, known)));
    CHECK(wrong_order(step, step, known) == 0);
    map reversed = step;
    for (double& value : reversed) value = 3 - value;
    CHECK(wrong_order(reversed, step, known) == 1);
}
