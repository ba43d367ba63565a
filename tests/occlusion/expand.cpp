#include <ldi/occlusion/expand.hpp>

#include "examples/scenes/scene.hpp"
#include "tests/support/lifted_scene.hpp"

#include <ldi/core/validate.hpp>
#include <ldi/occlusion/past_frame.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace {

constexpr float threshold = 0.05F, rounding = 1e-6F;

struct label {
    using scalar = std::int32_t;
    static constexpr std::size_t channels = 2;
};

struct mark {
    using scalar = std::int32_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return ldi::zeroed(origin); }
};

ldi::expanded_layers<ldi::color_column, ldi::disparity_column, ldi::known_column, ldi::matte_column> expanded(
    const ldi::photo_layer& lifted, int iterations, std::size_t min_length = 20) {
    ldi::curve_options curve_options;
    curve_options.min_length = min_length, curve_options.max_density = 2.0F;
    const auto curves = ldi::find_discontinuity_curves(lifted, {}, curve_options);
    ldi::expand_options options;
    options.motion = 1.0F;  // so large that the number of iterations limits the growth
    options.iterations = iterations;
    options.max_hidden = 100.0F;
    return ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options);
}

ldi::photo_layers grown(const ldi::photo_layer& lifted, int iterations, std::size_t min_length = 20) {
    return expanded(lifted, iterations, min_length).layers;
}

// Checks the invariants of the graph. Pixels from index `first_new` on were added by the growth; all others are pixels of the
// photo.
void require_sound(const ldi::graph_view& g, std::span<const float> disparity, std::size_t first_new) {
    const auto broken = ldi::validate(g);
    REQUIRE_FALSE(broken);
    ldi::buffer<ldi::buffer<std::size_t>> at(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()));
    for (std::size_t i = 0; i < g.size(); ++i) {
        at[static_cast<std::size_t>(g.y()[i]) * static_cast<std::size_t>(g.width()) + static_cast<std::size_t>(g.x()[i])]
            .push_back(i);
        for (ldi::side s : ldi::all_sides) {
            const std::int32_t n = g.neighbors(s)[i];
            if (n != ldi::no_pixel)
                REQUIRE(std::abs(disparity[static_cast<std::size_t>(n)] - disparity[i]) <= 2.001F * threshold + rounding);
        }
    }
    for (std::size_t position = 0; position < at.size(); ++position) {
        REQUIRE(at[position].front() == position);
        for (std::size_t k = 1; k < at[position].size(); ++k) {
            REQUIRE(at[position][k] >= first_new);
            for (std::size_t l = 0; l < k; ++l)
                REQUIRE(std::abs(disparity[at[position][k]] - disparity[at[position][l]]) > threshold - rounding);
            REQUIRE(disparity[position] > disparity[at[position][k]]);
        }
    }
}

// A front surface lies to the right of a vertical silhouette at column 60. Surfaces grow only from the part of the silhouette
// above row 60, and must stop at a line that starts at (60, 60) and points to the right. Returns the hidden pixels below that
// line.
//
// front(y)  disparity of the front surface in row y
// first(y)  first column of the front surface in row y
template <class Front, class First>
ldi::buffer<std::pair<std::int32_t, std::int32_t>> grown_past_line(Front&& front, First&& first) {
    constexpr std::size_t size = 120;
    ldi::image<float> map(size, size);
    for (std::size_t y = 0; y < size; ++y)
        for (std::size_t x = 0; x < size; ++x) map(y, x) = x >= first(y) ? front(y) : 0.1F;
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    auto curves = ldi::find_discontinuity_curves(lifted, {});
    REQUIRE(curves.size() == 1);
    ldi::buffer<ldi::discontinuity> kept;
    for (const ldi::discontinuity& d : curves[0].sides)
        if (lifted.topology().y()[d.front] < 60) kept.push_back(d);
    curves[0].sides = kept;
    curves[0].constraints = {{60.0F, 60.0F, 0.0F, 1.0F, 1.0F, 0.0F}};
    ldi::expand_options options;
    options.motion = 0.5F;
    const ldi::photo_layers expanded = ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options).layers;
    ldi::buffer<std::pair<std::int32_t, std::int32_t>> past;
    for (std::int32_t i = 0; i < expanded.topology().count(); ++i)
        if (expanded.column<ldi::known_column>()[i] == 0 && expanded.topology().y()[i] >= 60)
            past.push_back({expanded.topology().x()[i], expanded.topology().y()[i]});
    return past;
}

}  // namespace

TEST_CASE("after every iteration, the graph is valid and every new pixel is hidden behind the photo's pixels") {
    std::mt19937 random(1);
    for (int round = 0; round < 120; ++round) {
        const ldi::photo_layer lifted =
            ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 8 + random() % 50, 8 + random() % 50));
        ldi::curve_options curve_options;
        curve_options.min_length = 1 + random() % 20, curve_options.max_density = 2.0F;
        const auto curves = ldi::find_discontinuity_curves(lifted, {}, curve_options);
        ldi::expand_options options;
        options.motion = 0.01F * static_cast<float>(random() % 100);
        options.iterations = 12;
        options.max_hidden = 100.0F;
        int iterations = 0;
        const ldi::photo_layers expanded =
            ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options, {},
                        [&](const ldi::graph_view& g, std::span<const float> disparity, std::size_t first_new) {
                            ++iterations;
                            require_sound(g, disparity, first_new);
                        })
                .layers;
        REQUIRE(iterations <= 12);
        REQUIRE_FALSE(ldi::validate(expanded));
        REQUIRE_FALSE(ldi::validate_canonical(expanded.topology(), expanded.column<ldi::disparity_column>()));
    }
}

TEST_CASE("the photo's own pixels keep their colors, disparities and links") {
    std::mt19937 random(2);
    for (int round = 0; round < 60; ++round) {
        ldi::photo_layer lifted = ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 40, 30));
        for (std::uint8_t& value : lifted.column<ldi::color_column>()) value = static_cast<std::uint8_t>(random());
        const ldi::photo_layers expanded = grown(lifted, 15, 4);
        const ldi::graph& g = expanded.topology();
        // The photo's pixel is the nearest at its position.
        ldi::buffer<std::int32_t> nearest(lifted.size(), ldi::no_pixel);
        const auto disparity = expanded.column<ldi::disparity_column>();
        for (std::size_t i = 0; i < g.size(); ++i) {
            std::int32_t& n = nearest[static_cast<std::size_t>(g.y()[i] * g.width() + g.x()[i])];
            if (n == ldi::no_pixel || disparity[static_cast<std::size_t>(n)] < disparity[i]) n = static_cast<std::int32_t>(i);
        }
        std::size_t hidden = expanded.size();
        for (std::int32_t p = 0; p < static_cast<std::int32_t>(lifted.size()); ++p) {
            const std::int32_t q = nearest[static_cast<std::size_t>(p)];
            REQUIRE(q != ldi::no_pixel);
            --hidden;
            REQUIRE(disparity[static_cast<std::size_t>(q)] ==
                    lifted.column<ldi::disparity_column>()[static_cast<std::size_t>(p)]);
            REQUIRE(expanded.column<ldi::known_column>()[static_cast<std::size_t>(q)] == 1);
            for (std::size_t c = 0; c < 3; ++c)
                REQUIRE(expanded.at<ldi::color_column>(q)[c] == lifted.at<ldi::color_column>(p)[c]);
            for (ldi::side s : ldi::all_sides) {
                const std::int32_t before = lifted.topology().neighbor(p, s);
                if (before != ldi::no_pixel) REQUIRE(g.neighbor(q, s) == nearest[static_cast<std::size_t>(before)]);
            }
        }
        std::size_t unknown = 0;
        for (std::uint8_t known : expanded.column<ldi::known_column>()) unknown += known == 0 ? 1U : 0U;
        REQUIRE(unknown == hidden);
    }
}

TEST_CASE("behind a step at any angle, the background grows as far as the camera can uncover it, plus a small margin") {
    std::mt19937 random(12);
    for (int round = 0; round < 40; ++round) {
        const float angle = std::uniform_real_distribution<float>(0.0F, 6.2831853F)(random);
        const float step = std::uniform_real_distribution<float>(0.1F, 0.7F)(random), motion = 0.15F;
        const float across = std::cos(angle), down = std::sin(angle);
        // Signed distance of a pixel's center from a straight edge through the photo's middle, positive on the near side.
        const auto in_front = [&](std::int32_t x, std::int32_t y) {
            return (static_cast<float>(x) - 59.5F) * across + (static_cast<float>(y) - 59.5F) * down;
        };
        ldi::image<float> map(120, 120);
        for (std::int32_t y = 0; y < 120; ++y)
            for (std::int32_t x = 0; x < 120; ++x) map(y, x, 0) = in_front(x, y) > 0 ? 0.2F + step : 0.2F;
        const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
        const auto curves = ldi::find_discontinuity_curves(lifted, {});
        ldi::expand_options options;
        options.motion = motion;
        const ldi::photo_layers grown =
            ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options).layers;
        ldi::image<std::uint8_t> has_hidden(120, 120);
        for (std::size_t i = 0; i < grown.size(); ++i)
            if (grown.column<ldi::known_column>()[i] == 0) has_hidden(grown.topology().y()[i], grown.topology().x()[i], 0) = 1;
        const float uncovered = motion * 120 * step;
        for (std::int32_t y = 20; y < 100; ++y)
            for (std::int32_t x = 20; x < 100; ++x) {
                const float distance = in_front(x, y);
                CAPTURE(angle, step, x, y, distance, uncovered);
                if (distance > 0 && distance < uncovered + 2) REQUIRE(has_hidden(y, x, 0) == 1);
                if (distance > uncovered + 4.5F + 0.02F * motion * 120) REQUIRE(has_hidden(y, x, 0) == 0);
            }
    }
}

TEST_CASE(
    "behind a straight edge, the background grows by the sum of the uncovered width, 3.5 pixels, and the parallax of a disparity "
    "of 0.02") {
    for (const auto& [step, expected] : {std::pair{0.1F, 15}, {0.2F, 25}, {0.4F, 45}}) {
        ldi::image<float> map(30, 100);
        for (std::size_t y = 0; y < 30; ++y)
            for (std::size_t x = 0; x < 100; ++x) map(y, x) = x < 40 ? 0.2F : 0.2F + step;
        const auto layers = expanded(ldi::testing::lift_disparity(map), 4096).layers;
        CAPTURE(step);
        CHECK(layers.size() == 30U * (100U + static_cast<std::size_t>(expected)));
    }
}

TEST_CASE("at each side of a curve, a surface grows by the disparities within eight pixels along the curve") {
    // The front comes nearer by 0.3 pixels of parallax per row.
    ldi::image<float> map(41, 100);
    for (std::size_t y = 0; y < 41; ++y)
        for (std::size_t x = 0; x < 100; ++x) map(y, x) = x < 40 ? 0.1F : 0.2F + 0.015F * static_cast<float>(y);
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    const auto curves = ldi::find_discontinuity_curves(lifted, {});
    ldi::expand_options options;
    options.motion = 0.2F;
    const ldi::photo_layers layers = ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options).layers;
    int hidden = 0;
    for (std::int32_t i = 0; i < layers.topology().count(); ++i)
        hidden += layers.topology().y()[i] == 20 && layers.column<ldi::known_column>()[i] == 0 ? 1 : 0;
    CHECK(hidden >= 14);  // 12 if growth depended only on the step in the same row
    CHECK(hidden <= 16);
}

TEST_CASE(
    "expand() returns the camera motion that the layers support, which is smaller if the maximum number of iterations ends "
    "growth early") {
    ldi::image<float> map(40, 60);
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 60; ++x) map(y, x, 0) = x < 30 ? 0.2F : 0.8F;
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    CHECK(expanded(lifted, 4096).motion == 1.0F);
    CHECK(expanded(lifted, 4).motion < 0.2F);
    CHECK(expanded(lifted, 0).motion == 0.0F);
}

TEST_CASE("behind a straight edge, the background grows by one column per iteration") {
    ldi::image<float> map(40, 60);
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 60; ++x) map(y, x, 0) = x < 30 ? 0.2F : 0.8F;
    for (int iterations : {0, 1, 7, 25}) {
        const ldi::photo_layers expanded = grown(ldi::testing::lift_disparity(map), iterations);
        REQUIRE(expanded.size() == 40U * 60U + 40U * static_cast<std::size_t>(iterations));
        for (float d : expanded.column<ldi::disparity_column>()) REQUIRE((d == 0.2F || d == 0.8F));
    }
}

TEST_CASE("background that grows from both sides of a bar joins into one surface") {
    ldi::image<float> map(30, 80);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 80; ++x) map(y, x, 0) = x >= 30 && x < 51 ? 0.8F : x < 30 ? 0.2F : 0.23F;
    const ldi::photo_layers expanded = grown(ldi::testing::lift_disparity(map), 50);
    REQUIRE(expanded.size() == 30U * 80U + 30U * 21U);
    const ldi::graph& g = expanded.topology();
    for (std::size_t i = 0; i < g.size(); ++i)  // from the left border, a path leads behind the bar to the right border
        if (g.x()[i] == 0) {
            std::int32_t pixel = static_cast<std::int32_t>(i), steps = 0;
            while (g.neighbor(pixel, ldi::side::right) != ldi::no_pixel) pixel = g.neighbor(pixel, ldi::side::right), ++steps;
            REQUIRE(steps == 79);
        }
}

TEST_CASE("with merging of curves off, surfaces behind both sides of a bar pass each other, and each stays connected") {
    ldi::image<float> map(30, 80);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 80; ++x) map(y, x, 0) = x >= 30 && x < 51 ? 0.8F : 0.2F;
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    const auto curves = ldi::find_discontinuity_curves(lifted);
    const ldi::expand_options options{.motion = 1.0F, .iterations = 21, .merges_curves = false};
    const ldi::photo_layers expanded = ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options).layers;
    REQUIRE(expanded.size() == 30U * 80U + 2U * 30U * 21U);
    const ldi::graph& g = expanded.topology();
    REQUIRE_FALSE(ldi::validate(g));
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (expanded.column<ldi::known_column>()[i] == 0 && g.y()[i] > 0) REQUIRE(g.neighbor(i, ldi::side::up) != ldi::no_pixel);
}

TEST_CASE("growing surfaces join if they meet at similar depth, and pass each other otherwise") {
    std::mt19937 random(26);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    for (int round = 0; round < 60; ++round) {
        const float left = 0.1F + 0.2F * unit(random), step = 0.25F * (unit(random) - 0.5F), slope = 0.0004F * unit(random);
        const std::size_t first = 25 + random() % 10, last = first + 5 + random() % 30;  // columns of a bar
        if (std::abs(std::abs(step) - 2 * threshold) < 0.02F) continue;
        ldi::image<float> map(40, 100);
        for (std::size_t y = 0; y < 40; ++y)
            for (std::size_t x = 0; x < 100; ++x)
                map(y, x, 0) = x >= first && x < last ? 0.9F : left + (x < first ? 0.0F : step) + slope * static_cast<float>(y);
        const ldi::photo_layers expanded = grown(ldi::testing::lift_disparity(map), 80);
        ldi::buffer<std::size_t> behind(map.size(), 0);
        for (std::size_t i = 0; i < expanded.size(); ++i)
            behind[expanded.topology().position_of(static_cast<std::int32_t>(i))] += 1;
        CAPTURE(left, step, slope, first, last);
        for (std::size_t y = 0; y < 40; ++y)
            for (std::size_t x = first; x < last; ++x) REQUIRE(behind[100 * y + x] == (std::abs(step) < 2 * threshold ? 2U : 3U));
    }
}

TEST_CASE("at a curve's free end, a hidden surface ends where it would come within the threshold of the visible surface") {
    for (const std::size_t side : {std::size_t{60}, std::size_t{100}, std::size_t{160}}) {
        ldi::image<float> map(side, side);
        const std::size_t end = 3 * side / 4;
        for (std::size_t y = 0; y < side; ++y)
            for (std::size_t x = 0; x < side; ++x)
                map(y, x) = 0.2F + (y < side / 2 || x >= end ? 0.0F : 0.005F * static_cast<float>(end - x));
        const ldi::photo_layers expanded = grown(ldi::testing::lift_disparity(map), 4096);
        const ldi::graph& g = expanded.topology();
        std::size_t nearest_column = 0;  // column of the hidden pixel nearest to the free end
        for (std::int32_t i = 0; i < g.count(); ++i) {
            if (expanded.column<ldi::known_column>()[i] != 0) continue;
            const std::size_t x = static_cast<std::size_t>(g.x()[i]), y = static_cast<std::size_t>(g.y()[i]);
            CAPTURE(side, x, y);
            REQUIRE(map(y, x) - expanded.column<ldi::disparity_column>()[i] > threshold - rounding);
            nearest_column = std::max(nearest_column, x);
        }
        CAPTURE(side, end);
        REQUIRE(nearest_column + 12 > end);  // a step of 0.005 per pixel reaches the threshold 10 pixels before its end
        REQUIRE(nearest_column + 10 < end + 1);
    }
}

TEST_CASE("behind a front of any shape, a background of any slope grows to every place that the camera can uncover") {
    std::mt19937 random(24);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    int ends = 0;  // places where the background ends
    for (int round = 0; round < 20; ++round) {
        constexpr std::int32_t size = 160;
        const float motion = 0.1F + 0.15F * unit(random), front = 0.7F + 0.3F * unit(random);
        const float slope_x = 0.8F * (unit(random) - 0.5F), slope_y = 0.8F * (unit(random) - 0.5F);
        const float lobes = 2.0F + std::floor(4.0F * unit(random)), depth = 0.5F * unit(random), turn = 6.28F * unit(random);
        const auto in_front = [&](std::int32_t x, std::int32_t y) {
            const float dx = static_cast<float>(x) - 80.0F, dy = static_cast<float>(y) - 80.0F;
            return std::hypot(dx, dy) < 45.0F * (1.0F - depth * (0.5F + 0.5F * std::sin(lobes * std::atan2(dy, dx) + turn)));
        };
        ldi::image<float> map(size, size);
        std::vector<std::pair<std::int32_t, std::int32_t>> behind;
        for (std::int32_t y = 0; y < size; ++y)
            for (std::int32_t x = 0; x < size; ++x) {
                const float u = static_cast<float>(x) / size - 0.5F, v = static_cast<float>(y) / size - 0.5F;
                map(y, x) = in_front(x, y) ? front : 0.25F + 0.5F * (slope_x * u + slope_y * v);
                if (!in_front(x, y)) behind.emplace_back(x, y);
            }
        const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
        const auto curves = ldi::find_discontinuity_curves(lifted);
        const ldi::photo_layers grown =
            ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), {.motion = motion}).layers;
        const ldi::graph& g = grown.topology();
        ldi::image<float> hidden(size, size, 1, -1.0F);
        for (std::int32_t i = 0; i < g.count(); ++i)
            if (grown.column<ldi::known_column>()[i] == 0) hidden(g.y()[i], g.x()[i]) = grown.column<ldi::disparity_column>()[i];
        for (std::int32_t y = 1; y < size - 1; ++y)
            for (std::int32_t x = 1; x < size - 1; ++x) {
                if (!in_front(x, y) || hidden(y, x) >= 0.0F) continue;
                float beside = front;  // disparity of the farthest hidden pixel beside this place
                for (const ldi::side s : ldi::all_sides)
                    if (const float d = hidden(y + ldi::step_y(s), x + ldi::step_x(s)); d >= 0.0F) beside = std::min(beside, d);
                if (beside == front) continue;
                ++ends;
                float nearest = static_cast<float>(size);
                for (const auto& [u, v] : behind)
                    nearest = std::min(nearest, std::hypot(static_cast<float>(x - u), static_cast<float>(y - v)));
                CAPTURE(round, x, y, beside, nearest);
                REQUIRE(nearest > (front - beside) * motion * size + 2.0F);
            }
    }
    CHECK(ends > 1000);
}

TEST_CASE("at a T-junction, the midground stops at its curve's constraint, and the background grows behind both other surfaces") {
    const std::int32_t width = 192, height = 256;
    const ldi::scenes::scene scene = ldi::scenes::t_junction(width, height);
    const ldi::scenes::picture picture = ldi::scenes::render(scene, ldi::scenes::picture_options{1, 0.5});
    const ldi::photo_layers expanded = grown(ldi::testing::lift_disparity(picture.disparity), 50);
    const ldi::graph& g = expanded.topology();
    std::set<std::pair<int, int>> background_at, midground_at;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const float disparity = expanded.column<ldi::disparity_column>()[i];
        bool is_true_surface = false;
        for (const ldi::scenes::surface& s :
             ldi::scenes::surfaces_at(scene, static_cast<double>(g.x()[i]) + 0.5, static_cast<double>(g.y()[i]) + 0.5))
            is_true_surface = is_true_surface || std::abs(s.disparity - disparity) < 0.01F;
        INFO("pixel at " << g.x()[i] << ", " << g.y()[i] << " with disparity " << disparity);
        REQUIRE(is_true_surface);
        if (disparity < 0.25F) background_at.emplace(g.x()[i], g.y()[i]);
        if (disparity > 0.25F && disparity < 0.75F) midground_at.emplace(g.x()[i], g.y()[i]);
    }
    // The foreground's edge is at 0.4 of the width, the midground's at 0.55 of the height.
    const int edge = static_cast<int>(std::lround(0.4 * width)), top = static_cast<int>(std::lround(0.55 * height));
    for (int x = edge - 48; x < edge; ++x) {
        for (int y = 0; y < top; ++y) REQUIRE(background_at.count({x, y}) == 1);
        for (int y = top + 3; y < height; ++y) REQUIRE(midground_at.count({x, y}) == 1);  // up to the constraint's thickness
    }
    for (int x = edge; x < width; ++x)
        for (int y = top; y < top + 48; ++y) REQUIRE(background_at.count({x, y}) == 1);
    for (int y = top; y < top + 20; ++y)  // behind both other surfaces
        for (int x = edge - 20; x < edge; ++x) REQUIRE(background_at.count({x, y}) == 1);
}

TEST_CASE("in a custom column, a new pixel gets the value of new_pixel() or, without this rule, that of its surface") {
    ldi::image<float> map(30, 30);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 30; ++x) map(y, x, 0) = x < 15 ? 0.2F : 0.8F;
    ldi::buffer<std::int32_t> numbers(2 * 900), marks(900, 7);
    for (std::int32_t i = 0; i < 900; ++i) numbers[2 * i] = i + 1, numbers[2 * i + 1] = -i - 1;
    const auto own = ldi::testing::lift_disparity(map).with<label>(numbers).with<mark>(marks);
    const auto curves = ldi::find_discontinuity_curves(own, {});
    const auto expanded = ldi::expand(own, {}, std::span<const ldi::discontinuity_curve>(curves)).layers;
    REQUIRE(expanded.size() > 900);
    std::set<std::int32_t> seen;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(expanded.size()); ++i) {
        const auto [first, second] = std::pair{expanded.at<label>(i)[0], expanded.at<label>(i)[1]};
        REQUIRE(first == -second);
        const std::int32_t x = expanded.topology().x()[i], y = expanded.topology().y()[i];
        if (expanded.at<mark>(i)[0] == 7) {  // a pixel of the photo
            REQUIRE(first - 1 == y * 30 + x);
            REQUIRE(seen.insert(first).second);
        } else {
            REQUIRE(expanded.at<mark>(i)[0] == 0);
            REQUIRE((first - 1) % 30 < 15);  // grown from the far surface
            REQUIRE(x >= 15);
            REQUIRE(expanded.column<ldi::disparity_column>()[i] == 0.2F);
        }
    }
    CHECK(seen.size() == 900);
}

TEST_CASE("surfaces do not grow past the constraint line at the end of a silhouette, at any angle") {
    constexpr std::size_t size = 120;
    for (float angle = 0.05F; angle < 6.28F; angle += 0.26F) {
        const float along_x = std::cos(angle), along_y = std::sin(angle);
        ldi::image<float> map(size, size);
        for (std::size_t y = 0; y < size; ++y)
            for (std::size_t x = 0; x < size; ++x) {
                const float dx = static_cast<float>(x) - 59.5F, dy = static_cast<float>(y) - 59.5F;
                map(y, x) = dy * along_x - dx * along_y > 0.0F ? 0.9F : 0.1F;
            }
        const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
        auto curves = ldi::find_discontinuity_curves(lifted, {});
        REQUIRE(curves.size() == 1);
        // Keeps the part of the silhouette that leads up to the middle; the line at its end starts there.
        const auto outward_at = [&](float x, float y) { return (x - 60.0F) * along_x + (y - 60.0F) * along_y; };
        ldi::buffer<ldi::discontinuity> kept;
        for (const ldi::discontinuity& d : curves[0].sides)
            if (outward_at(static_cast<float>(lifted.topology().x()[d.back]) + 0.5F,
                           static_cast<float>(lifted.topology().y()[d.back]) + 0.5F) < 0)
                kept.push_back(d);
        curves[0].sides = kept;
        curves[0].constraints = {{60.0F, 60.0F, along_x, along_y, -along_y, along_x}};
        ldi::expand_options options;
        options.motion = 0.25F;
        const ldi::photo_layers expanded =
            ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options).layers;
        std::size_t hidden = 0, past = 0;
        for (std::int32_t i = 0; i < expanded.topology().count(); ++i) {
            if (expanded.column<ldi::known_column>()[i] != 0) continue;
            ++hidden;
            const float x = static_cast<float>(expanded.topology().x()[i]) + 0.5F,
                        y = static_cast<float>(expanded.topology().y()[i]) + 0.5F;
            past += outward_at(x, y) > 0.0F ? 1U : 0U;
        }
        CAPTURE(angle, kept.size());
        CHECK(hidden > 50 * 20);
        CHECK(past == 0);
    }
}

TEST_CASE("a surface stops at the constraint line at a curve's end even if it grows farther elsewhere along the curve") {
    // The surface grows by 16 pixels near the curve's end, and by 40 at distances above `distance` from it.
    for (const float distance : {0.0F, 8.0F, 16.0F, 24.0F, 32.0F, 40.0F}) {
        const auto past = grown_past_line(
            [&](std::size_t y) { return std::clamp(0.3F + 0.045F * (60.0F - distance - static_cast<float>(y)), 0.3F, 0.7F); },
            [](std::size_t) { return std::size_t{60}; });
        CAPTURE(distance);
        CHECK(past.empty());
    }
}

TEST_CASE(
    "the constraint line at a curve's end stops a surface that starts up to two pixels beside the end, but not four pixels") {
    for (const auto& [beside, is_stopped] : {std::pair<std::size_t, bool>{0, true}, {1, true}, {2, true}, {4, false}}) {
        const auto past =
            grown_past_line([](std::size_t) { return 0.7F; },
                            [offset = beside](std::size_t y) { return y >= 40 && y < 70 ? 60 - offset : std::size_t{60}; });
        CAPTURE(beside);
        CHECK(past.empty() == is_stopped);
    }
}

TEST_CASE("expand() can be canceled and refuses options and disparities outside their range") {
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(ldi::image<float>(5, 5, 1, 0.5F));
    ldi::progress_listener watcher;
    watcher.is_canceled = [](void*) { return true; };
    CHECK_THROWS_AS(ldi::expand(lifted, {}, {}, {}, watcher), ldi::error);
    ldi::expand_options options;
    options.iterations = -1;
    CHECK_THROWS_AS(ldi::expand(lifted, {}, {}, options), ldi::error);
    for (const float disparity : {1.5F, -1.5F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        ldi::photo_layer changed = lifted;
        changed.column<ldi::disparity_column>()[7] = disparity;
        CHECK_THROWS_AS(ldi::expand(changed, {}, {}), ldi::error);
        ldi::photo_layers layers = ldi::expand(lifted, {}, {}).layers;
        layers.column<ldi::disparity_column>()[7] = disparity;
        if (!std::isfinite(disparity)) CHECK_THROWS_AS(ldi::grow_past_frame(layers, ldi::photo_facts()), ldi::error);
        CHECK(layers.size() == 25);
    }
    for (const float max_hidden : {-1.0F, std::numeric_limits<float>::quiet_NaN()}) {
        options = {};
        options.max_hidden = max_hidden;
        CHECK_THROWS_AS(ldi::expand(lifted, {}, {}, options), ldi::error);
    }
    for (const float motion : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()}) {
        options = {};
        options.motion = motion;
        CHECK_THROWS_AS(ldi::expand(lifted, {}, {}, options), ldi::error);
    }
}

TEST_CASE("growth ends at the maximum number of hidden pixels, and the result states the motion that they support") {
    ldi::image<float> map(120, 160, 1, 0.1F);
    for (std::size_t y = 0; y < 120; ++y)
        for (std::size_t x = 0; x < 160; ++x) map(y, x, 0) = 0.1F + 0.1F * static_cast<float>(x / 20);  // a staircase
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    const auto curves = ldi::find_discontinuity_curves(lifted, {});
    const auto expanded = [&](float max_hidden) {
        ldi::expand_options options;
        options.motion = 0.5F, options.max_hidden = max_hidden;
        auto result = ldi::expand(lifted, {}, std::span<const ldi::discontinuity_curve>(curves), options);
        const double hidden = static_cast<double>(result.layers.size()) / static_cast<double>(lifted.size()) - 1;
        return std::pair(hidden, result.motion);
    };
    const auto [all, whole_motion] = expanded(100.0F);
    CHECK(all > 0.3);
    CHECK(whole_motion == 0.5F);
    CHECK(expanded(static_cast<float>(all) + 0.01F) == std::pair(all, 0.5F));
    const auto [half, less_motion] = expanded(static_cast<float>(all) / 2);
    CHECK(half >= all / 2);
    CHECK(half < all / 2 + 0.1);  // 0.1: pixels of the last iteration
    CHECK(less_motion > 0.0F);
    CHECK(less_motion < 0.5F);
    CHECK(expanded(0.0F) == std::pair(0.0, 0.0F));
}

TEST_CASE("expand() refuses curves whose front is the farther pixel, and constraints outside the lattice or without directions") {
    ldi::image<float> map(20, 20);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 20; ++x) map(y, x) = x < 10 ? 0.1F : 0.9F;
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    const auto curves = ldi::find_discontinuity_curves(lifted, {});
    REQUIRE(curves.size() == 1);
    const auto expand = [&](const ldi::photo_layer& layer, const ldi::discontinuity_curve& curve) {
        return ldi::expand(layer, {}, std::span(&curve, 1));
    };
    CHECK_NOTHROW(expand(lifted, curves[0]));

    ldi::discontinuity_curve nowhere = curves[0];
    nowhere.sides[0] = {nowhere.sides[0].back, nowhere.sides[0].back, static_cast<ldi::side>(200)};
    CHECK_THROWS_AS(expand(lifted, nowhere), ldi::error);

    ldi::photo_layer inverted = lifted;
    for (float& d : inverted.column<ldi::disparity_column>()) d = 1.0F - d;
    CHECK_THROWS_AS(expand(inverted, curves[0]), ldi::error);

    for (const float outside : {0.0F, -5.0F, 20.0F, 1e9F, std::nanf("")}) {
        ldi::discontinuity_curve curve = curves[0];
        curve.constraints = {{outside, 10.0F, 1.0F, 0.0F, 0.0F, 1.0F}};
        CHECK_THROWS_AS(expand(lifted, curve), ldi::error);
        curve.constraints = {{10.0F, outside, 1.0F, 0.0F, 0.0F, 1.0F}};
        CHECK_THROWS_AS(expand(lifted, curve), ldi::error);
    }
    for (const float length : {0.5F, 2.0F, INFINITY, std::nanf("")}) {
        ldi::discontinuity_curve curve = curves[0];
        curve.constraints = {{10.0F, 10.0F, length, 0.0F, 0.0F, 1.0F}};
        CHECK_THROWS_AS(expand(lifted, curve), ldi::error);
        curve.constraints = {{10.0F, 10.0F, 1.0F, 0.0F, 0.0F, length}};
        CHECK_THROWS_AS(expand(lifted, curve), ldi::error);
    }
}

TEST_CASE("expand() refuses a surface rule that joins the two sides of a curve") {
    ldi::image<float> map(20, 20);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 20; ++x) map(y, x) = x < 10 ? 0.1F : 0.4F;
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(map);
    const auto curves = ldi::find_discontinuity_curves(lifted, {});
    CHECK_NOTHROW(ldi::expand(lifted, {0.29F}, curves));
    CHECK_THROWS_AS(ldi::expand(lifted, {0.9F}, curves), ldi::error);
}

TEST_CASE("expand() refuses disparities outside [-1, 1] and surface rules outside [0.001, 1]") {
    const ldi::photo_layer lifted = ldi::testing::lift_disparity(ldi::image<float>(8, 8));
    for (const float wild : {std::numeric_limits<float>::infinity(), std::nanf(""), 1.5F, -1.5F}) {
        ldi::photo_layer layer = lifted;
        layer.column<ldi::disparity_column>()[9] = wild;
        CHECK_THROWS_AS(ldi::expand(layer, {}, {}), ldi::error);
    }
    for (const float step : {0.0F, std::nanf(""), 1e30F}) CHECK_THROWS_AS(ldi::expand(lifted, {step}, {}), ldi::error);
    CHECK_NOTHROW(ldi::expand(lifted, {}, {}));
}
