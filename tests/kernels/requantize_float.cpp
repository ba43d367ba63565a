#include <ldi/kernels/requantize_float.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>

namespace {

/// Counts how many of 24 random requantizations have a form that `find` returns. Scales are between 2^-exponents and 1. Compares
/// each form with the integer form on all accumulators within and slightly beyond the clamping limits, and on 2000 random
/// accumulators.
template <class Find>
int count_exact_forms(Find find, int exponents) {
    std::mt19937 random(4);
    int found = 0;
    for (int round = 0; round < 24; ++round) {
        const float scale = std::ldexp(std::uniform_real_distribution<float>(0.5F, 0.9999F)(random), -(round % exponents));
        const ldi::requantization r =
            ldi::make_requantization(scale, static_cast<std::uint8_t>(round % 3 == 0 ? 0 : random() >> 24));
        const auto form = find(r);
        if (!form.has_value()) continue;
        ++found;
        int broken = 0;
        const int most = static_cast<int>(270 / scale);
        for (int a = -most; a <= most; ++a) broken += (*form)(a) != ldi::requantize(a, r);
        for (int i = 0; i < 2000; ++i) {
            const auto a = static_cast<std::int32_t>(random());
            broken += (*form)(a) != ldi::requantize(a, r);
        }
        CHECK(broken == 0);
    }
    return found;
}

}  // namespace

TEST_CASE("a float form of requantization, fused or not, matches the integer form on every tested accumulator") {
    CHECK(count_exact_forms(ldi::find_float_requantization, 9) >= 20);
    CHECK(count_exact_forms(ldi::find_unfused_requantization, 9) >= 20);
}

TEST_CASE("nearly all scales from 0.5 to 1 have a float form of requantization") {
    CHECK(count_exact_forms(ldi::find_float_requantization, 1) >= 22);
    CHECK(count_exact_forms(ldi::find_unfused_requantization, 1) >= 22);
}

TEST_CASE("checkpoints are the accumulators directly before and after each step of the integer form's output") {
    const ldi::requantization r = ldi::make_requantization(0.013F, 100);
    const ldi::buffer<std::int32_t> points = ldi::detail::requantization_checkpoints(r);
    std::size_t steps = 0;
    for (std::size_t i = 2; i < points.size(); i += 2) {
        CHECK(points[i + 1] == points[i] + 1);
        CHECK(ldi::requantize(points[i], r) + 1 == ldi::requantize(points[i + 1], r));
        ++steps;
    }
    CHECK(steps == 255);
}

TEST_CASE("a requantization has no float form if float has too few bits for its scale") {
    const ldi::requantization fine = ldi::make_requantization(0x1.fffffep-20F, 128);
    CHECK_FALSE(ldi::find_float_requantization(fine).has_value());
    CHECK_FALSE(ldi::find_unfused_requantization(fine).has_value());
}
