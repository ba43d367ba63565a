#include <ldi/kernels/requantize.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace {

// The definition in exact arithmetic, with two roundings. The first removes the multiplier's 31 fraction bits and rounds
// halves up. The second divides by 2^shift and rounds halves away from zero.
int reference(std::int32_t accumulator, const ldi::requantization& r) {
    const std::int64_t product = std::int64_t{accumulator} * r.multiplier + (std::int64_t{1} << 30);
    std::int64_t high = product / (std::int64_t{1} << 31);
    if (high * (std::int64_t{1} << 31) > product) --high;
    const double rounded = std::round(static_cast<double>(high) / std::exp2(r.shift));
    return static_cast<int>(std::clamp(rounded + r.zero_point, 0.0, 255.0));
}

std::vector<float> scales() {
    std::vector<float> result{
        0x1p-32F, 0x1p-31F, 0x1p-8F, 0x1p-1F, 0.75F, std::nextafter(1.0F, 0.0F), std::nextafter(0x1p-8F, 0.0F)};
    std::mt19937 random(1);
    for (int i = 0; i < 60; ++i)
        result.push_back(std::ldexp(std::uniform_real_distribution<float>(0.5F, 0.9999F)(random),
                                    -std::uniform_int_distribution<int>(0, 20)(random)));
    return result;
}

std::vector<std::int32_t> accumulators(float scale) {
    constexpr std::int32_t least = std::numeric_limits<std::int32_t>::min(), most = std::numeric_limits<std::int32_t>::max();
    std::vector<std::int32_t> result{least, least + 1, -65536, -2, -1, 0, 1, 2, 3, 255, 65535, most - 1, most};
    // Around every tie between two results.
    for (int q = -300; q <= 300; ++q) {
        const double tie = (q + 0.5) / static_cast<double>(scale);
        if (std::abs(tie) > 2e9) continue;
        for (int step = -2; step <= 2; ++step) result.push_back(static_cast<std::int32_t>(std::floor(tie)) + step);
    }
    std::mt19937 random(2);
    for (int i = 0; i < 500; ++i) result.push_back(static_cast<std::int32_t>(random()));
    return result;
}

}  // namespace

TEST_CASE("requantization applies two exact roundings, including near every tie and at the ends of the accumulator's range") {
    int broken = 0;
    for (float scale : scales())
        for (int zero_point : {0, 1, 127, 128, 255}) {
            const ldi::requantization r = ldi::make_requantization(scale, static_cast<std::uint8_t>(zero_point));
            for (std::int32_t a : accumulators(scale)) broken += ldi::requantize(a, r) != reference(a, r);
        }
    CHECK(broken == 0);
}

TEST_CASE("the error of requantization is at most half a step of its first rounding plus half a step of its second") {
    double worst = 0;
    for (float scale : scales()) {
        const ldi::requantization r = ldi::make_requantization(scale, 128);
        const double first_rounding = r.shift == 0 ? 0 : std::exp2(-r.shift - 1);
        for (std::int32_t a : accumulators(scale)) {
            const double real = std::clamp(a * static_cast<double>(scale), -128.0, 127.0);
            worst = std::max(worst, std::abs(ldi::requantize(a, r) - 128 - real) - first_rounding);
        }
    }
    CHECK(worst < 0.5 + 1e-6);
    CHECK(worst > 0.49);
}

TEST_CASE("a requantization multiplier has 24 significant bits, and represents its scale exactly") {
    for (float scale : scales()) {
        const ldi::requantization r = ldi::make_requantization(scale, 0);
        CHECK(r.multiplier >= 1 << 30);
        CHECK(r.multiplier % 128 == 0);
        CHECK((r.shift >= 0 && r.shift <= 31));
        CHECK(std::ldexp(static_cast<double>(r.multiplier), -31 - r.shift) == static_cast<double>(scale));
    }
}

TEST_CASE("requantization accepts scales from 2^-32 up to but not including 1") {
    CHECK(ldi::is_requantization_scale(0x1p-32F));
    CHECK(ldi::is_requantization_scale(std::nextafter(1.0F, 0.0F)));
    CHECK_FALSE(ldi::is_requantization_scale(1.0F));
    CHECK_FALSE(ldi::is_requantization_scale(std::nextafter(0x1p-32F, 0.0F)));
    CHECK_FALSE(ldi::is_requantization_scale(-0.5F));
    CHECK_FALSE(ldi::is_requantization_scale(std::numeric_limits<float>::quiet_NaN()));
}

TEST_CASE("quantized addition rounds the exact weighted sum correctly for all pairs of bytes") {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> scale(0.005F, 0.08F);
    std::uniform_int_distribution<int> zero(0, 255);
    const auto any = [&] { return ldi::quantization{scale(random), static_cast<std::uint8_t>(zero(random))}; };
    for (int i = 0; i < 40; ++i) {
        ldi::quantization a = any(), b = any(), y = any();
        if (i == 0) a.scale = b.scale = y.scale = 0.02F;
        if (i == 1) a.scale = std::nextafter(0x1p8F, 0.0F), y.scale = 1, b.scale = a.scale, a.zero_point = b.zero_point = 0;
        if (i == 2) a.scale = 0x1p-10F, y.scale = 1, b.scale = 0x1p-30F;
        const ldi::quantized_addition sum = ldi::make_quantized_addition(a, b, y);
        CHECK(std::max(sum.a_multiplier, sum.b_multiplier) >= 1 << 21);
        CHECK(std::max(sum.a_multiplier, sum.b_multiplier) <= 1 << 22);
        int broken = 0;
        double worst = 0;
        for (int p = 0; p < 256; ++p)
            for (int q = 0; q < 256; ++q) {
                const int found = ldi::add_quantized(static_cast<std::uint8_t>(p), static_cast<std::uint8_t>(q), sum);
                const std::int64_t exact =
                    std::int64_t{p - a.zero_point} * sum.a_multiplier + std::int64_t{q - b.zero_point} * sum.b_multiplier;
                const double rounded = std::round(static_cast<double>(exact) / std::exp2(sum.shift));
                broken += found != static_cast<int>(std::clamp(rounded + y.zero_point, 0.0, 255.0));
                const double real =
                    ((p - a.zero_point) * static_cast<double>(a.scale) + (q - b.zero_point) * static_cast<double>(b.scale)) /
                    static_cast<double>(y.scale);
                worst = std::max(worst, std::abs(found - std::clamp(real + y.zero_point, 0.0, 255.0)));
            }
        CHECK(broken == 0);
        CHECK(worst < 0.501);
    }
}

TEST_CASE("quantized addition accepts two positive ratios if the larger one is at least 2^-10 and below 2^8") {
    CHECK(ldi::are_addition_ratios(0x1p-10F, 0x1p-20F));
    CHECK(ldi::are_addition_ratios(1.0F, std::nextafter(256.0F, 0.0F)));
    CHECK_FALSE(ldi::are_addition_ratios(1.0F, 256.0F));
    CHECK_FALSE(ldi::are_addition_ratios(0x1p-11F, 0x1p-12F));
    CHECK_FALSE(ldi::are_addition_ratios(0.0F, 1.0F));
    CHECK_FALSE(ldi::are_addition_ratios(1.0F, std::numeric_limits<float>::quiet_NaN()));
    CHECK_FALSE(ldi::are_addition_ratios(std::numeric_limits<float>::quiet_NaN(), 1.0F));
}
