#include <ldi/depth/step_band.hpp>

#include "tests/support/hard_maps.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>

using namespace ldi;

namespace {

struct curve_pixel {
    std::int32_t x, y;
    float front, back;
};

/// Finds the curve pixels as step_band.hpp defines them, one pixel at a time.
buffer<curve_pixel> curve_pixels(const image<float>& map, const step_band_options& options) {
    const std::int32_t height = static_cast<std::int32_t>(map.height()), width = static_cast<std::int32_t>(map.width());
    const auto is_inside = [&](std::int32_t y, std::int32_t x) { return y >= 0 && x >= 0 && y < height && x < width; };
    buffer<curve_pixel> result;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            bool steps = false;
            float front = map(y, x), back = map(y, x);
            for (std::int32_t v = y - 4; v <= y + 4; ++v)
                for (std::int32_t u = x - 4; u <= x + 4; ++u) {
                    const std::int32_t squared = (u - x) * (u - x) + (v - y) * (v - y);
                    if (!is_inside(v, u) || squared > 20) continue;
                    front = std::max(front, map(v, u)), back = std::min(back, map(v, u));
                    if (squared == 1) steps = steps || std::abs(map(v, u) - map(y, x)) > options.max_step;
                }
            if (steps && front - back >= options.min_step) result.push_back({x, y, front, back});
        }
    return result;
}

void check_band(const image<float>& map, const step_band_options& options = {}) {
    const step_band band = find_step_band(map, options);
    const buffer<curve_pixel> curve = curve_pixels(map, options);
    REQUIRE(band.curve.size() == curve.size());
    REQUIRE(band.curve_pixels.size() == band.region.size());
    REQUIRE(band.squared_distances.size() == band.region.size());
    CHECK(band.region.width() == static_cast<std::int32_t>(map.width()));
    CHECK(band.region.height() == static_cast<std::int32_t>(map.height()));
    std::size_t wrong = 0;
    for (std::int32_t y = 0; y < band.region.height(); ++y)
        for (std::int32_t x = 0; x < band.region.width(); ++x) {
            std::int32_t least = std::numeric_limits<std::int32_t>::max(), nearest = -1;
            for (std::int32_t c = 0; c < curve.count(); ++c) {
                const std::int32_t dx = curve[c].x - x, dy = curve[c].y - y, squared = dx * dx + dy * dy;
                // Prefers the leftmost, then the uppermost, among curve pixels at the same distance.
                if (squared < least || (squared == least && curve[c].x < curve[nearest].x)) least = squared, nearest = c;
            }
            const std::int32_t i = band.region.number(x, y);
            const bool expected = least <= step_region_radius * step_region_radius;
            if ((i != no_pixel) != expected) ++wrong;
            if (i == no_pixel || !expected) continue;
            if (band.squared_distances[i] != least || band.curve_pixels[i] != nearest) ++wrong;
            if (band.sides_of(i).front != curve[nearest].front || band.sides_of(i).back != curve[nearest].back) ++wrong;
            if (band.is_decided(i) != (least <= step_band_radius * step_band_radius)) ++wrong;
        }
    CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("on random maps, the band matches a brute-force search") {
    std::mt19937 random(4);
    for (int round = 0; round < 30; ++round) {
        const std::size_t height = 1 + random() % 60, width = 1 + random() % 80;
        CAPTURE(round, height, width);
        image<float> map(height, width, 1, 0.2F);
        for (std::size_t boxes = random() % 4; boxes-- > 0;) {
            const std::size_t top = random() % height, left = random() % width;
            const float value = static_cast<float>(random() % 100) / 100.0F;
            for (std::size_t y = top; y < std::min(height, top + 1 + random() % 20); ++y)
                for (std::size_t x = left; x < std::min(width, left + 1 + random() % 20); ++x) map(y, x) = value;
        }
        check_band(map);
    }
}

TEST_CASE("on difficult and on very small maps, the band matches a brute-force search") {
    for (const std::string_view name : ldi::testing::hard_maps) {
        CAPTURE(name);
        check_band(ldi::testing::hard_map(name, 24, 32, 1));
        check_band(ldi::testing::hard_map(name, 40, 36, 7));
    }
    for (const auto& [height, width] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 2}, {2, 1}, {1, 60}, {60, 1}}) {
        CAPTURE(height, width);
        check_band(ldi::testing::hard_map("noise", height, width, 1));
        check_band(ldi::testing::hard_map("flat", height, width, 1));
    }
    CHECK(find_step_band(image<float>()).region.count() == 0);
}
