// Tests each default by its effect on pixels: no test here reads an options object, so that no default can change unnoticed.
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace {

template <class Value>
ldi::image<float> filled(std::size_t height, std::size_t width, Value value) {
    ldi::image<float> map(height, width);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) map(y, x, 0) = value(static_cast<int>(x), static_cast<int>(y));
    return map;
}

ldi::photo_layer lifted(const ldi::image<float>& disparity) {
    return ldi::lift(ldi::image<std::uint8_t>(disparity.height(), disparity.width(), 3), disparity);
}

/// Background on the left, foreground from column `edge` on.
ldi::image<float> two_sides(std::size_t height, std::size_t width, int edge) {
    return filled(height, width, [edge](int x, int) { return x < edge ? 0.2F : 0.8F; });
}

/// The weighted median by its definition, with tau = 0.05; infinity if the best two samples are too close for a Gaussian
/// with an error of 0.0003 to decide.
float median_by_definition(const ldi::image<float>& map, int x, int y, double sigma) {
    const int width = static_cast<int>(map.width()), height = static_cast<int>(map.height());
    const auto at = [&](int u, int v) {
        return double{map(static_cast<std::size_t>(std::clamp(v, 0, height - 1)),
                          static_cast<std::size_t>(std::clamp(u, 0, width - 1)), 0)};
    };
    std::vector<std::pair<double, double>> samples;  // value, weight
    for (int v = y - 2; v <= y + 2; ++v)
        for (int u = x - 2; u <= x + 2; ++u) {
            if (u < 0 || v < 0 || u >= width || v >= height) continue;
            double max_step = 0.0;
            for (const double other : {at(u - 1, v), at(u + 1, v), at(u, v - 1), at(u, v + 1)})
                max_step = std::max(max_step, std::abs(other - at(u, v)));
            const double difference = at(u, v) - at(x, y);
            if (max_step < 0.05) samples.emplace_back(at(u, v), std::exp(-difference * difference / (2.0 * sigma * sigma)));
        }
    std::sort(samples.begin(), samples.end());
    double all = 0.0, preceding = 0.0, best = 1e9, second = 1e9;
    float result = 0.0F;
    for (const auto& [value, weight] : samples) all += weight;
    for (const auto& [value, weight] : samples) {
        const double imbalance = std::abs(preceding - (all - preceding - weight));
        if (imbalance < best)
            second = best, best = imbalance, result = static_cast<float>(value);
        else
            second = std::min(second, imbalance);
        preceding += weight;
    }
    return second - best < 0.05 ? std::numeric_limits<float>::infinity() : result;
}

/// A depth network's result: a blurred oblique edge, six samples wide along rows.
struct washed_out {
    ldi::image<float> disparity(ldi::image_view<const std::uint8_t>, const ldi::progress_listener&,
                                const ldi::serial_executor&) const {
        return filled(48, 64, [](int x, int y) {
            const float across = static_cast<float>(x) + 0.4F * static_cast<float>(y) - 40.0F;
            return 0.6F + 0.4F * std::clamp(across / 3.0F, -1.0F, 1.0F);
        });
    }
    float quantization_step() const { return 1.0F; }
};

}  // namespace

TEST_CASE("neighbors are linked up to a disparity step of 0.05") {
    const ldi::photo_layer layer = lifted(filled(1, 3, [](int x, int) { return x == 0 ? 0.5F : x == 1 ? 0.549F : 0.6F; }));
    CHECK(layer.topology().right()[0] == 1);
    CHECK(layer.topology().right()[1] == ldi::no_pixel);
}

TEST_CASE("the weighted median's Gaussian has a sigma of 0.2") {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> step(-0.049F, 0.049F);
    std::size_t compared = 0, different = 0, told_apart = 0;
    for (int round = 0; round < 40; ++round) {
        // Neighbors differ by less than tau, so that every sample counts. The values span a range as wide as possible.
        std::vector<float> columns(20, 0.5F), rows(20, 0.0F);
        for (std::size_t i = 1; i < 20; ++i) columns[i] = columns[i - 1] + step(random), rows[i] = rows[i - 1] + step(random);
        const ldi::image<float> map = filled(
            20, 20, [&](int x, int y) { return columns[static_cast<std::size_t>(x)] + rows[static_cast<std::size_t>(y)]; });
        const ldi::image<float> filtered = ldi::weighted_median(map);
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 20; ++x) {
                const float expected = median_by_definition(map, x, y, 0.2), otherwise = median_by_definition(map, x, y, 0.1);
                if (std::isinf(expected)) continue;
                ++compared;
                different += filtered(static_cast<std::size_t>(y), static_cast<std::size_t>(x), 0) != expected ? 1U : 0U;
                told_apart += !std::isinf(otherwise) && otherwise != expected ? 1U : 0U;
            }
    }
    CHECK(compared > 1000);
    CHECK(different == 0);
    CHECK(told_apart > 20);
}

TEST_CASE("components of fewer than 20 pixels with disparities between foreground and background are merged") {
    for (const int pixels : {19, 20}) {
        const ldi::image<float> before = filled(30, 60, [pixels](int x, int y) {
            return y == 10 && x >= 30 && x < 30 + pixels ? 0.5F : y < 10 ? 0.2F : 0.8F;
        });
        ldi::image<float> map = before;
        CHECK(ldi::merge_middle_components(map) == (pixels < 20 ? 1U : 0U));
        CHECK((map == before) == (pixels == 20));
    }
}

TEST_CASE("the median is applied twice before the depth map is resampled to the photo, and once after") {
    const ldi::image<std::uint8_t> photo(96, 128, 3);
    ldi::photo3d_options options;  // without stages beyond the paper
    options.sharpen.radius = 0, options.alignment.uncertainty = 0;
    const ldi::photo3d made = ldi::make_photo3d(photo, washed_out{}, ldi::diffusion_inpainter{}, options);
    const auto resampled_after = [&](int passes) {
        ldi::image<float> map = made.estimated;
        for (int i = 0; i < passes; ++i) map = ldi::weighted_median(map);
        return ldi::resample_to_photo(map, photo);
    };
    CHECK((made.resampled == resampled_after(2)));
    CHECK((made.resampled != resampled_after(0)));
    CHECK((made.resampled != resampled_after(1)));
    ldi::image<float> cleaned = ldi::weighted_median(resampled_after(2));
    ldi::merge_middle_components(cleaned, {}, {.min_size = 80});  // 20 samples of the estimate
    CHECK((made.disparity == cleaned));
}

TEST_CASE("curves of fewer than 20 pixel sides are dropped") {
    const auto curves_around = [](int width, int height) {
        return ldi::find_discontinuity_curves(
            lifted(filled(30, 30,
                          [=](int x, int y) { return x >= 10 && y >= 10 && x < 10 + width && y < 10 + height ? 0.8F : 0.2F; })),
            {});
    };
    CHECK(curves_around(4, 5).empty());  // 18 sides
    const auto curves = curves_around(5, 5);
    REQUIRE(curves.size() == 1);
    CHECK(curves[0].sides.size() == 20);
}

TEST_CASE("a curve's direction at its end is that of its last 20 sides, even if they bend") {
    // The foreground lies to the right of an oblique line that becomes vertical near its end. To the left of the line, the
    // midground ends at y = 32.
    const auto line = [](int y) { return 30 + std::min(y, 28) / 3; };
    const ldi::photo_layer layer = lifted(filled(60, 160, [&](int x, int y) {
        return x >= line(y) ? 0.9F : y < 32 ? 0.5F : 0.2F;
    }));
    const auto curves = ldi::find_discontinuity_curves(layer, {});
    REQUIRE(curves.size() == 3);
    ldi::buffer<ldi::growth_constraint> constraints;
    for (const ldi::discontinuity_curve& c : curves)
        for (const ldi::growth_constraint& constraint : c.constraints) constraints.push_back(constraint);
    REQUIRE(constraints.size() == 1);  // the constraint of the midground, at the point where the three surfaces meet
    const ldi::growth_constraint& end = constraints[0];
    CHECK(end.x == 39.0F);
    CHECK(end.y == 32.0F);
    // From its end backward, the curve runs 5 sides up, 1 left, 3 up, 1 left, 3 up, 1 left, 3 up, 1 left, 2 up, to the corner
    // (35, 16).
    const float length = std::hypot(4.0F, 16.0F);
    CHECK(end.outward_x == Approx(4.0F / length));
    CHECK(end.outward_y == Approx(16.0F / length));

    // No hidden pixel of the midground lies beyond the line that starts at the end, perpendicular to the curve there.
    ldi::photo_layer closed = layer;
    ldi::close_spurious_discontinuities(closed, curves);
    const ldi::photo_layers grown = ldi::expand(closed, {}, curves, {.motion = 0.5F}).layers;
    std::size_t beyond = 0, hidden = 0;
    for (std::size_t i = 0; i < grown.size(); ++i) {
        const float x = static_cast<float>(grown.topology().x()[i]) + 0.5F,
                    y = static_cast<float>(grown.topology().y()[i]) + 0.5F;
        if (grown.column<ldi::known_column>()[i] != 0 || grown.column<ldi::disparity_column>()[i] < 0.4F || x < 41.0F) continue;
        ++hidden;
        beyond += 4.0F * (x - end.x) + 16.0F * (y - end.y) > 0.0F ? 1U : 0U;
    }
    CHECK(hidden > 500);
    CHECK(beyond == 0);
}

TEST_CASE("if surfaces look alike, two foreground pixels and one background pixel beside a silhouette are refilled") {
    ldi::photo_layer layer = lifted(two_sides(12, 40, 20));
    ldi::unmix_colors(layer);
    for (std::size_t i = 0; i < layer.size(); ++i) {
        const std::int32_t x = layer.topology().x()[i];
        REQUIRE((layer.column<ldi::known_column>()[i] == 0) == (x >= 19 && x < 22));
    }
}

TEST_CASE("by default, hidden surfaces grow by 8 % of the longer side times the step, plus a margin for pixels and mesh") {
    const ldi::photo_layer layer = lifted(two_sides(30, 160, 40));
    const auto curves = ldi::find_discontinuity_curves(layer, {});
    const auto [grown, motion] = ldi::expand(layer, {}, curves);
    constexpr int columns = 11;  // 0.08 * 160 * (0.6 + 0.02) + 1.5 + 2 = 11.44
    CHECK(grown.size() == 30U * 160U + 30U * columns);
    for (std::size_t i = 0; i < grown.size(); ++i) {
        const bool is_hidden = grown.topology().x()[i] >= 40 && grown.column<ldi::disparity_column>()[i] < 0.5F;
        if (is_hidden) REQUIRE(grown.topology().x()[i] < 40 + columns);
    }
    CHECK(motion == 0.08F);
}

TEST_CASE("charts up to 2048 pixels wide are not cut, and wider ones are") {
    const auto charts_of = [](std::size_t width) {
        const ldi::photo_layer layer = lifted(filled(3, width, [](int, int) { return 0.5F; }));
        return ldi::make_charts(ldi::expand(layer, {}, {}).layers, {}).charts;
    };
    CHECK(charts_of(2048).size() == 1);
    CHECK(charts_of(2049).size() == 2);
}
