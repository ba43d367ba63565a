#include "tests/support/errors.hpp"
#include "tests/support/hard_maps.hpp"
#include "tests/support/lifted_scene.hpp"
#include "tests/support/surfaces.hpp"
#include "tests/texture/photo_scene.hpp"

#include <ldi/base/memory.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <set>
#include <string_view>

namespace {

using namespace ldi;
using namespace ldi::testing;

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// Positions of the pixels of one chart.
class chart_map {
public:
    chart_map(const graph_view& g, const chart& c) : c_(c), pixels_(at(c.width) * at(c.height), no_pixel) {
        for (std::int32_t pixel : c.pixels) {
            std::int32_t& here = pixels_[index(g.x()[at(pixel)], g.y()[at(pixel)])];
            if (here != no_pixel) folds_ = true;
            here = pixel;
        }
    }
    bool folds() const { return folds_; }
    std::int32_t pixel(std::int32_t x, std::int32_t y) const {
        const bool inside = x >= c_.x && x < c_.x + c_.width && y >= c_.y && y < c_.y + c_.height;
        return inside ? pixels_[index(x, y)] : no_pixel;
    }

private:
    std::size_t index(std::int32_t x, std::int32_t y) const { return at(y - c_.y) * at(c_.width) + at(x - c_.x); }
    const chart& c_;
    buffer<std::int32_t> pixels_;
    bool folds_ = false;
};

std::size_t connected_count(const graph_view& g, const chart_set& set, std::int32_t chart_index) {
    buffer<std::int32_t> open{set.charts[at(chart_index)].pixels.front()};
    std::set<std::int32_t> seen(open.begin(), open.end());
    while (!open.empty()) {
        const std::int32_t pixel = open.back();
        open.pop_back();
        for (side s : all_sides) {
            const std::int32_t next = g.neighbor(pixel, s);
            if (next != no_pixel && set.chart_of[at(next)] == chart_index && seen.insert(next).second) open.push_back(next);
        }
    }
    return seen.size();
}

/// Checks that every pixel is in exactly one chart, that charts are flat and connected, and that their boxes are tight and
/// within the limit.
void check_partition(const graph_view& g, const chart_set& set, const chart_options& options) {
    REQUIRE(set.chart_of.size() == g.size());
    buffer<int> uses(g.size(), 0);
    for (std::size_t c = 0; c < set.charts.size(); ++c) {
        const chart& here = set.charts[c];
        REQUIRE(!here.pixels.empty());
        std::int32_t left = g.width(), right = -1, top = g.height(), bottom = -1;
        bool agree = true;
        for (const std::int32_t pixel : here.pixels) {
            const std::size_t i = at(pixel);
            ++uses[i];
            agree = agree && set.chart_of[i] == static_cast<std::int32_t>(c);
            left = std::min<std::int32_t>(left, g.x()[i]), right = std::max<std::int32_t>(right, g.x()[i]);
            top = std::min<std::int32_t>(top, g.y()[i]), bottom = std::max<std::int32_t>(bottom, g.y()[i]);
        }
        CHECK(agree);
        CHECK(here.x == left);
        CHECK(here.y == top);
        CHECK(here.width == right - left + 1);
        CHECK(here.height == bottom - top + 1);
        CHECK(here.width <= options.max_side);
        CHECK(here.height <= options.max_side);
        CHECK(!chart_map(g, here).folds());
        CHECK(connected_count(g, set, static_cast<std::int32_t>(c)) == here.pixels.size());
    }
    CHECK(std::count(uses.begin(), uses.end(), 1) == static_cast<std::ptrdiff_t>(g.size()));
}

/// Counts pairs of pixels of one chart, in one row or column and within the filter's range, that belong to different surfaces.
std::size_t mixed_surfaces(const graph_view& g, std::span<const float> disparity, const chart_set& set,
                           const chart_options& options, surface_rule rule = {}) {
    const float threshold = 2 * rule.max_step + 1e-6F;
    const auto differ = [&](std::int32_t a, std::int32_t b) { return std::abs(disparity[at(a)] - disparity[at(b)]) > threshold; };
    std::size_t mixed = 0;
    for (const chart& c : set.charts) {
        const chart_map map(g, c);
        for (std::int32_t pixel : c.pixels)
            for (side s : all_sides) {
                std::int32_t surface = pixel;
                bool goes_on = true;
                for (std::int32_t distance = 1; distance <= options.filter_range; ++distance) {
                    const std::int32_t next = goes_on ? g.neighbor(surface, s) : no_pixel;
                    goes_on = next != no_pixel;
                    if (goes_on) surface = next;
                    const std::int32_t there =
                        map.pixel(g.x()[at(pixel)] + distance * step_x(s), g.y()[at(pixel)] + distance * step_y(s));
                    if (there != no_pixel && there != surface && differ(there, pixel) && differ(there, surface)) ++mixed;
                }
            }
    }
    return mixed;
}

void check_charts(const graph_view& g, std::span<const float> disparity, const chart_options& options,
                  surface_rule surface = {}) {
    const chart_set set = make_charts(testing::surfaces_of(g, disparity), surface, options);
    check_partition(g, set, options);
    CHECK(mixed_surfaces(g, disparity, set, options, surface) == 0);
}

/// Counts the allocations of `size` bytes, and forwards all allocations to the system's memory.
struct counted_requests {
    std::size_t size, count = 0;
    memory source{this, &allocate, &release};

    static void* allocate(void* context, std::size_t bytes, std::size_t alignment) {
        counted_requests& self = *static_cast<counted_requests*>(context);
        self.count += bytes == self.size ? 1U : 0U;
        return ldi::detail::system_memory.allocate(nullptr, bytes, alignment);
    }
    static void release(void*, void* block, std::size_t bytes) { ldi::detail::system_memory.release(nullptr, block, bytes); }
};

/// Layers of a hard_map() of 31 x 2047, with hidden surfaces.
photo_layers layers_of(std::string_view name, std::size_t unit) {
    const photo_layer lifted = lift_disparity(hard_map(name, 31, 2047, unit));
    return expand(lifted, {}, find_discontinuity_curves(lifted, {})).layers;
}

/// Number of times that make_charts() grows charts. Each growth allocates one byte per lattice position, and this function counts
/// the allocations of this size.
///
/// max_area  maximum total area of the charts' bounding boxes, in multiples of the lattice's area
std::size_t growths_of(const photo_layers& layers, std::int64_t max_area) {
    counted_requests counted{layers.topology().position_count()};
    const memory_scope scope(counted.source);
    make_charts(layers, {}, {.max_area = max_area * 31 * 2047});
    return counted.count;
}

}  // namespace

TEST_CASE("charts partition random graphs, are flat, connected and within the size limit, and do not mix surfaces") {
    std::mt19937 random(1);
    for (int i = 0; i < 400; ++i) {
        const random_layers layers = random_graph(random, 48);
        chart_options options;
        options.max_side = 16 + below(random, 40);
        options.filter_range = 1 + below(random, 8);
        check_charts(layers.topology(), layers.disparity, options, {chance(random, 50) ? 0.05F : 0.5F});
    }
}

TEST_CASE("charts of pixels in any order satisfy all constraints") {
    std::mt19937 random(2);
    for (int i = 0; i < 100; ++i) {
        const random_layers layers = shuffled(random_graph(random, 30), random);
        check_charts(layers.topology(), layers.disparity, {});
    }
}

TEST_CASE("charts of scenes with hidden surfaces satisfy the paper's three constraints") {
    std::mt19937 random(3);
    for (int i = 0; i < 12; ++i) {
        const photo_layers layers = random_scene(random, 120, 160);
        chart_options options;
        if (i % 2 == 1) options.max_side = 64;
        check_charts(layers.topology(), layers.column<disparity_column>(), options);
    }
}

TEST_CASE("charts of real photos satisfy the paper's three constraints") {
    for (const char* name : {"mb_cones", "iphone_a"}) {
        const std::optional<photo_layers> layers = shared_photo(name);
        if (!layers) {
            std::printf("skipped: no %s in %s/rgbd\n", name, LDI_SHARED_DIR);
            continue;
        }
        INFO(name);
        check_charts(layers->topology(), layers->column<disparity_column>(), {});
    }
}

TEST_CASE("the paper's third constraint keeps charts from mixing surfaces at a depth step that fades out") {
    image<float> map(120, 120);
    for (std::size_t y = 0; y < 120; ++y)
        for (std::size_t x = 0; x < 120; ++x)
            map(y, x) = 0.2F + (x < 60 ? 0.0F : 0.6F * std::max(0.0F, 1 - static_cast<float>(y) / 80));
    const photo_layers layers = with_hidden_surfaces(lift(image<std::uint8_t>(120, 120, 3), map));
    const auto disparity = layers.column<disparity_column>();
    const auto mixed = [&](surface_rule rule) {
        return mixed_surfaces(layers.topology(), disparity, make_charts(layers, rule), {});
    };
    CHECK(mixed({.max_step = 2.0F}) > 0);
    CHECK(mixed({}) == 0);
}

TEST_CASE("a flat image is one chart, or an even grid of charts if it exceeds the size limit") {
    const graph g = make_grid(100, 70);
    const buffer<float> disparity(g.size(), 0.5F);
    CHECK(make_charts(testing::surfaces_of(g, disparity), {}).charts.size() == 1);
    chart_options options;
    options.max_side = max_chart_box;
    CHECK(make_charts(testing::surfaces_of(g, disparity), {}, options).charts.size() == 1);
    options.max_side = 40;
    const chart_set set = make_charts(testing::surfaces_of(g, disparity), {}, options);
    CHECK(set.charts.size() == 6);
    for (const chart& c : set.charts) {
        CHECK(c.width >= 32);
        CHECK(c.width <= 34);
        CHECK(c.height == 35);
    }
}

TEST_CASE("a chart size limit below 16 or above 8192 is refused") {
    const graph g = make_grid(4, 4);
    const buffer<float> disparity(g.size(), 0.5F);
    for (const std::int32_t side : {-1, 0, 15, 8193, std::numeric_limits<std::int32_t>::max()}) {
        CAPTURE(side);
        CHECK(testing::raised([&] { make_charts(testing::surfaces_of(g, disparity), {}, {.max_side = side}); }) ==
              error_code::invalid_option);
    }
    for (const std::int32_t side : {16, 8192})
        CHECK_NOTHROW(make_charts(testing::surfaces_of(g, disparity), {}, {.max_side = side}));
}

TEST_CASE("charts of disparities that are not finite are refused") {
    const graph g = make_grid(4, 4);
    for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        buffer<float> disparity(g.size(), 0.5F);
        disparity[7] = wrong;
        CHECK_THROWS_AS(make_charts(testing::surfaces_of(g, disparity), {}), error);
    }
}

TEST_CASE("a disc and the wall behind it become one chart each") {
    image<float> disparity(60, 60, 1, 0.2F);
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 60; ++x)
            if (std::hypot(static_cast<double>(x) - 30, static_cast<double>(y) - 30) < 12) disparity(y, x, 0) = 0.7F;
    const photo_layers layers = ldi::testing::lifted_layers(disparity);
    const chart_set set = make_charts(layers, {});
    REQUIRE(set.charts.size() == 2);
    CHECK(set.charts[0].width == 60);
    CHECK(set.charts[1].width < 25);
}

TEST_CASE("hidden surfaces do not divide the visible surface around the end of a step") {
    image<float> map(120, 120);
    for (std::size_t y = 0; y < 120; ++y)
        for (std::size_t x = 0; x < 120; ++x)
            map(y, x) = 0.2F + (x < 60 ? 0.0F : 0.09F * std::max(0.0F, 1 - static_cast<float>(y) / 80));
    const photo_layers layers = with_hidden_surfaces(lift(image<std::uint8_t>(120, 120, 3), map));
    const graph& g = layers.topology();
    REQUIRE(g.size() > g.position_count());
    const chart_set set = make_charts(layers, {});
    const auto disparity = layers.column<disparity_column>();
    std::size_t elsewhere = 0;  // visible pixels that are not in the chart of pixel 0
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (disparity[i] == map.data()[g.position_of(i)] && set.chart_of[i] != set.chart_of[0]) ++elsewhere;
    CAPTURE(set.charts.size());
    CHECK(elsewhere == 0);
}

TEST_CASE("a helix that overlaps itself is cut into flat charts") {
    std::mt19937 random(4);
    testing::random_pieces builder(random, 20, 20);
    builder.add_helix(10, 10, 8, 3);
    const graph g = builder.result();
    buffer<float> disparity;
    for (std::size_t i = 0; i < g.size(); ++i) disparity.push_back(1.0F - 0.3F * static_cast<float>(i / 256));
    const chart_set set = make_charts(testing::surfaces_of(g, disparity), {});
    check_partition(g, set, {});
    CHECK(set.charts.size() >= 3);
}

TEST_CASE("rings are divided into smaller charts if the total area of the charts' bounding boxes exceeds the maximum") {
    const photo_layer layer = testing::lift_disparity(testing::hard_map("rings", 300, 400, 12));
    const auto area = [](const chart_set& set) {
        std::int64_t sum = 0;
        for (const chart& c : set.charts) sum += std::int64_t{c.width} * c.height;
        return sum;
    };
    chart_options options;
    const chart_set large = make_charts(layer, {}, options);
    CHECK(large.charts.size() == 13);  // one per ring
    CHECK(area(large) > 4 * 300 * 400);
    options.max_area = area(large);
    CHECK(make_charts(layer, {}, options).chart_of == large.chart_of);
    options.max_area = 2 * 300 * 400;
    const chart_set small = make_charts(layer, {}, options);
    CHECK(area(small) <= options.max_area);
    check_partition(layer.topology(), small, options);
    options.max_area = 1;  // no charts can meet this limit
    const chart_set smallest = make_charts(layer, {}, options);
    options.max_side = 64;
    check_partition(layer.topology(), smallest, options);
}

TEST_CASE("on difficult maps, charts are grown at most three times, and exactly twice if no chart size meets the area limit") {
    CHECK(growths_of(layers_of("ramp", 1), 4) == 1);
    for (const std::string_view name : hard_maps)
        for (const std::size_t unit : {1U, 6U, 30U}) {
            CAPTURE(name, unit);
            const photo_layers layers = layers_of(name, unit);
            CHECK(growths_of(layers, 4) <= 3);  // 4 is the default for a photo of 12 megapixels
            CHECK(growths_of(layers, 2) <= 3);
            CHECK(growths_of(layers, 0) == 2);
        }
}

TEST_CASE("an empty graph has no charts") {
    const graph g = graph_builder(8, 8).build();
    CHECK(make_charts(testing::surfaces_of(g, {}), {}).charts.empty());
    CHECK(make_charts(testing::surfaces(), {}).charts.empty());
}

TEST_CASE("options outside their range are refused") {
    const graph g = make_grid(4, 4);
    const buffer<float> disparity(g.size(), 0.5F);
    CHECK_THROWS_AS(make_charts(testing::surfaces_of(g, disparity), {}, {15, 4}), error);
    CHECK_THROWS_AS(make_charts(testing::surfaces_of(g, disparity), {}, {2048, 0}), error);
    CHECK_THROWS_AS(make_charts(testing::surfaces_of(g, disparity), {}, {2048, 9}), error);
}
