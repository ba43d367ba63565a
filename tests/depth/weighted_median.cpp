#include <ldi/depth/weighted_median.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace {

// The paper's definition, one pixel at a time: sorts the samples by value, and finds the sample for which the sums of
// preceding and following weights are closest to equal. Returns every sample that is within rounding of the best.
ldi::buffer<float> best_samples(const ldi::image<float>& map, int y, int x, const ldi::weighted_median_options& options) {
    const int rows = static_cast<int>(map.height()), columns = static_cast<int>(map.width());
    const auto at = [&](int v, int u) { return map(v, u, 0); };
    std::vector<std::pair<float, double>> samples;
    for (int v = std::max(y - 2, 0); v <= std::min(y + 2, rows - 1); ++v)
        for (int u = std::max(x - 2, 0); u <= std::min(x + 2, columns - 1); ++u) {
            bool edge = false;
            for (const auto& [dv, du] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
                if (v + dv >= 0 && u + du >= 0 && v + dv < rows && u + du < columns)
                    edge = edge || std::abs(at(v + dv, u + du) - at(v, u)) > 0.05F;
            const double difference = static_cast<double>(at(v, u)) - static_cast<double>(at(y, x));
            if (!edge) samples.emplace_back(at(v, u), std::exp(-difference * difference / (2.0 * options.sigma * options.sigma)));
        }
    if (samples.empty()) return {at(y, x)};
    std::sort(samples.begin(), samples.end());
    double total = 0, preceding = 0, best = 1e9;
    for (const auto& s : samples) total += s.second;
    std::vector<std::pair<double, float>> imbalances;
    for (const auto& [value, weight] : samples) {
        imbalances.emplace_back(std::abs(preceding - (total - preceding - weight)), value);
        best = std::min(best, imbalances.back().first);
        preceding += weight;
    }
    ldi::buffer<float> values;
    for (const auto& [imbalance, value] : imbalances)
        if (imbalance <= best + 0.01) values.push_back(value);
    return values;
}

ldi::image<float> random_map(std::mt19937& random, std::size_t rows, std::size_t columns, float noise) {
    ldi::image<float> map(rows, columns);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    const float levels[] = {unit(random), unit(random), unit(random)};
    const float slope_x = unit(random) * 0.03F, slope_y = unit(random) * 0.03F, bend = 1.0F + 3.0F * unit(random);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const float fx = static_cast<float>(x), fy = static_cast<float>(y);
            const std::size_t region = static_cast<std::size_t>(fx / bend + fy / 4.0F) % 3;
            map(y, x, 0) = std::clamp(levels[region] + slope_x * fx + slope_y * fy + noise * unit(random), 0.0F, 1.0F);
        }
    return map;
}

}  // namespace

TEST_CASE("the weighted median is the sample whose preceding and following weights are closest to equal") {
    std::mt19937 random(1);
    const ldi::weighted_median_options options;
    for (int round = 0; round < 60; ++round) {
        const std::size_t rows = 1 + random() % 24, columns = 1 + random() % 40;
        const float noise = round % 3 == 0 ? 0.0F : round % 3 == 1 ? 0.01F : 0.12F;
        const ldi::image<float> map = random_map(random, rows, columns, noise);
        const ldi::image<float> filtered = ldi::weighted_median(map, {}, options);
        for (int y = 0; y < static_cast<int>(rows); ++y)
            for (int x = 0; x < static_cast<int>(columns); ++x) {
                const ldi::buffer<float> best = best_samples(map, y, x, options);
                INFO("round " << round << ", pixel " << x << ", " << y);
                REQUIRE(std::find(best.begin(), best.end(), filtered(y, x, 0)) != best.end());
            }
    }
}

TEST_CASE("values farther from the center's value weigh less, even if all values are close to it and on one side of it") {
    // Around (7, 2), 12 samples nearly equal the center. The other 12 differ from it by up to 0.155, all in the same direction.
    for (const float sign : {-1.0F, 1.0F}) {
        ldi::image<float> map(5, 12);
        for (std::size_t y = 0; y < 5; ++y)
            for (std::size_t x = 0; x < 12; ++x) {
                const float t = 0.0499F * (static_cast<float>(x) - 7.0F) + 0.045F * (static_cast<float>(y) - 2.0F);
                map(y, x) = 0.5F + sign * (t > 0.0F ? std::min(t, 0.155F) : 0.02F * t);
            }
        const ldi::buffer<float> best = best_samples(map, 2, 7, {});
        const float filtered = ldi::weighted_median(map)(2, 7);
        CHECK(std::find(best.begin(), best.end(), filtered) != best.end());
        CHECK(filtered != map(2, 7));  // map(2, 7) is the unweighted median
    }
}

TEST_CASE("the weighted median turns an edge blurred over three pixels into a step") {
    ldi::image<float> map(20, 30);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 30; ++x)
            map(y, x, 0) = x < 14 ? 0.2F : x == 14 ? 0.35F : x == 15 ? 0.5F : x == 16 ? 0.65F : 0.8F;
    const ldi::image<float> filtered = ldi::weighted_median(map);
    for (std::size_t y = 0; y < 20; ++y) {
        std::size_t between = 0;
        for (std::size_t x = 0; x < 30; ++x) between += filtered(y, x, 0) > 0.21F && filtered(y, x, 0) < 0.79F ? 1U : 0U;
        CHECK(between <= 1);  // a value in the exact middle is equally near to both sides
    }
}

TEST_CASE("the weighted median is the same on any number of threads") {
    std::mt19937 random(2);
    const ldi::image<float> map = random_map(random, 150, 101, 0.05F);
    const ldi::image<float> serial = ldi::weighted_median(map);
    for (std::size_t count : {2U, 3U, 5U}) {
        ldi::thread_pool threads(count);
        CHECK((ldi::weighted_median(map, {}, {}, threads) == serial));
    }
}
