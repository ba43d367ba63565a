#include <ldi/occlusion/detail/front_lookup.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

TEST_CASE("a search in tiles finds the same uncovered positions as a search among all fronts") {
    std::mt19937 random(5);
    const auto number = [&](float from, float to) { return std::uniform_real_distribution<float>(from, to)(random); };
    for (const std::int32_t range : {0, 1, 12, 100})
        for (const auto& [width, height] : {std::pair<std::int32_t, std::int32_t>{1, 1}, {8, 9}, {57, 40}}) {
            constexpr float pixels_per_disparity = 30.0F, margin = 2.0F;
            ldi::detail::front_lookup lookup(width, height, pixels_per_disparity, margin, range);
            std::vector<ldi::detail::front_place> fronts;
            for (int i = 0; i < 12; ++i) {
                const float angle = number(0.0F, 6.3F);
                const auto below = [&](std::int32_t count) { return std::uniform_int_distribution(0, count - 1)(random); };
                const std::int32_t x = below(width), y = below(height);
                fronts.push_back({x, y, std::cos(angle), std::sin(angle), number(0.0F, 1.0F)});
                lookup.add(fronts.back());
            }
            lookup.sort();
            for (std::int32_t y = 0; y < height; ++y)
                for (std::int32_t x = 0; x < width; ++x) {
                    const float disparity = number(0.0F, 1.0F);
                    const bool expected = std::any_of(fronts.begin(), fronts.end(), [&](const ldi::detail::front_place& f) {
                        const std::int32_t dx = x - f.x, dy = y - f.y;
                        const float ahead = static_cast<float>(dx) * f.toward_x + static_cast<float>(dy) * f.toward_y;
                        return std::max(std::abs(dx), std::abs(dy)) <= range && ahead >= -1.0F &&
                               std::hypot(static_cast<float>(dx), static_cast<float>(dy)) <=
                                   (f.disparity - disparity) * pixels_per_disparity + margin;
                    });
                    CAPTURE(range, width, height, x, y);
                    REQUIRE(lookup.uncovers(x, y, disparity) == expected);
                }
        }
}
