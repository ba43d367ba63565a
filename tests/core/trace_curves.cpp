#include <ldi/core/trace_curves.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace ldi;

namespace {

/// A disparity map of digits: "5" is a disparity of 0.5. Surfaces of different digits are separate.
struct digit_map {
    std::int32_t width, height;
    std::vector<float> disparity;

    explicit digit_map(const std::vector<std::string_view>& lines)
        : width(static_cast<std::int32_t>(lines[0].size())), height(static_cast<std::int32_t>(lines.size())) {
        for (const std::string_view line : lines)
            for (const char digit : line) disparity.push_back(0.1F * static_cast<float>(digit - '0'));
    }
    float at(std::int32_t pixel) const { return disparity[static_cast<std::size_t>(pixel)]; }
    bool is_cut(std::int32_t pixel, side s) const {
        return !surface_rule().same_surface(at(pixel), at(pixel + step_x(s) + step_y(s) * width));
    }
    curve_tracer tracer() const {
        return {width, height, disparity, surface_rule(), [this](std::int32_t pixel, side s) { return is_cut(pixel, s); }};
    }
};

std::vector<traced_curve> curves_of(const curve_tracer& tracer) {
    std::vector<traced_curve> curves;
    tracer.for_each_curve([&](traced_curve t) { curves.push_back(std::move(t)); });
    return curves;
}

/// Number of sides of each curve, negated for closed curves.
std::vector<int> lengths_of(const curve_tracer& tracer) {
    std::vector<int> lengths;
    for (const traced_curve& t : curves_of(tracer)) lengths.push_back(static_cast<int>(t.sides.size()) * (t.is_closed ? -1 : 1));
    return lengths;
}
std::vector<int> lengths_in(const std::vector<std::string_view>& lines) { return lengths_of(digit_map(lines).tracer()); }

/// A flat map of 20 x 20 pixels with two cuts. The first cut runs between columns 9 and 10. The second cut is `branch` sides long
/// and leads to the left. It starts in the middle of the first cut, or `gap` pixels to the left of this point.
curve_tracer branched_cut(std::int32_t branch, std::int32_t gap = 0) {
    static const std::vector<float> flat(400, 0.5F);
    return {20, 20, flat, surface_rule(), [&](std::int32_t pixel, side s) {
                const std::int32_t x = pixel % 20, y = pixel / 20;
                return s == side::right ? x == 9 : y == 9 && x < 10 - gap && x >= 10 - gap - branch;
            }};
}

}  // namespace

TEST_CASE(
    "every side between two surfaces lies on exactly one curve, between the curve's corners, and states which pixel is nearer") {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        const std::size_t columns = 1 + random() % 12;
        const char surfaces = static_cast<char>(2 + random() % 3);
        std::vector<std::string> lines(1 + random() % 12, std::string(columns, '0'));
        for (std::string& line : lines)
            for (char& digit : line) digit = static_cast<char>('0' + testing::below(random, surfaces));
        const digit_map map({lines.begin(), lines.end()});
        curve_tracer tracer = map.tracer();
        tracer.prune_spurs(1000);  // changes nothing, because no curve between surfaces ends inside the photo
        const corner_map& corners = tracer.corners();
        std::vector<int> times(2 * map.disparity.size(), 0);
        std::size_t sides = 0;
        for (const traced_curve& t : curves_of(tracer)) {
            REQUIRE(t.corners.size() == t.sides.size() + 1);
            if (t.is_closed) REQUIRE(t.corners.front() == t.corners.back());
            for (std::size_t i = 0; i < t.sides.size(); ++i) {
                const discontinuity& d = t.sides[i];
                REQUIRE(map.at(d.back) < map.at(d.front));
                REQUIRE(d.front == d.back + step_x(d.toward_front) + step_y(d.toward_front) * map.width);
                // The common side of the two pixels starts at the lower right pixel's upper left corner.
                const std::int32_t second = std::max(d.back, d.front), first = std::min(d.back, d.front);
                const bool is_vertical = step_x(d.toward_front) != 0;
                const std::int32_t start = corners.corner(second % map.width, second / map.width);
                const std::int32_t end = corners.next(start, is_vertical ? side::down : side::right);
                REQUIRE(std::min(t.corners[i], t.corners[i + 1]) == start);
                REQUIRE(std::max(t.corners[i], t.corners[i + 1]) == end);
                ++times[2 * static_cast<std::size_t>(first) + (is_vertical ? 0 : 1)];
                ++sides;
            }
            for (std::size_t i = 0; i < t.corners.size(); ++i) {
                const bool is_end = !t.is_closed && (i == 0 || i + 1 == t.corners.size());
                const int degree = corners.degree(t.corners[i]);
                REQUIRE((is_end ? degree != 2 : degree == 2 || degree == 4));
                if (degree == 1) REQUIRE(corners.on_border(t.corners[i]));
            }
        }
        REQUIRE(sides == corners.side_count());
        for (std::int32_t pixel = 0; pixel < map.width * map.height; ++pixel) {
            const std::size_t i = 2 * static_cast<std::size_t>(pixel);
            REQUIRE(times[i] == (pixel % map.width + 1 < map.width && map.is_cut(pixel, side::right) ? 1 : 0));
            REQUIRE(times[i + 1] == (pixel / map.width + 1 < map.height && map.is_cut(pixel, side::down) ? 1 : 0));
        }
    }
}

TEST_CASE("curves around a surface inside the photo are closed; every other curve ends at borders or junctions") {
    CHECK(lengths_in({"111", "111"}).empty());
    CHECK(lengths_in({"111", "151", "111"}) == std::vector{-4});
    CHECK(lengths_in({"115", "115", "115"}) == std::vector{3});
    CHECK(lengths_in({"551", "111"}) == std::vector{3});
    CHECK(lengths_in({"115", "335"}) == std::vector{1, 1, 2});                 // a junction of three surfaces
    CHECK(lengths_in({"1111", "1511", "1191", "1111"}) == std::vector{4, 4});  // both curves end where the surfaces touch
}

TEST_CASE("if pixels of two surfaces meet diagonally, curves keep the pixels of the nearer surface connected") {
    CHECK(lengths_in({"1111", "1511", "1151", "1111"}) == std::vector{-8});
    CHECK(lengths_in({"1111", "1151", "1511", "1111"}) == std::vector{-8});
    CHECK(lengths_in({"5555", "5155", "5515", "5555"}) == std::vector{-4, -4});
    CHECK(lengths_in({"5555", "5515", "5155", "5555"}) == std::vector{-4, -4});
    CHECK(lengths_in({"15151", "51515", "15151"}).size() == 8);  // one curve around each background pixel
}

TEST_CASE("a moved-from corner map has no sides, and can be assigned to") {
    corner_map map(3, 2);
    map.add(map.corner(1, 1), side::right);
    corner_map moved = std::move(map);
    CHECK((moved.side_count() == 1 && moved.width() == 3 && moved.has(moved.corner(1, 1), side::right)));
    CHECK((map.side_count() == 0 && map.used().empty()));
    map = moved;
    CHECK((map.side_count() == 1 && map.height() == 2));
}

TEST_CASE("prune_spurs() removes branches with a free end that are shorter than the minimum") {
    for (std::int32_t branch = 1; branch < 10; ++branch)
        for (std::size_t minimum = 0; minimum < 12; ++minimum) {
            curve_tracer tracer = branched_cut(branch);
            tracer.prune_spurs(minimum);
            const bool is_pruned = static_cast<std::size_t>(branch) < minimum;
            CAPTURE(branch, minimum);
            CHECK(lengths_of(tracer).size() == (is_pruned ? 1 : 3));
            CHECK(tracer.corners().side_count() == static_cast<std::size_t>(is_pruned ? 20 : 20 + branch));
        }
}

TEST_CASE("prune_spurs() keeps branches that reach the photo's border, and curves without a junction") {
    for (curve_tracer tracer : {branched_cut(10), branched_cut(3, 2)}) {
        const std::vector<int> before = lengths_of(tracer);
        tracer.prune_spurs(100);
        CHECK(lengths_of(tracer) == before);
    }
}

TEST_CASE("a lattice with 2^31 corners or more is refused before memory is allocated") {
    for (const auto& size : {std::pair{46340, 46340}, {2147483647, 0}, {0, 2147483647}, {2147483647, 2147483647}})
        CHECK(testing::raised([&] { corner_map(size.first, size.second); }) == error_code::too_large);
    CHECK_FALSE(testing::raised([] { corner_map(1000, 0); }));
}

TEST_CASE("a lattice with a negative size, and a wrong number of disparities, are refused") {
    for (const auto& size : {std::pair{-1, 5}, {5, -1}, {-1, -1}, {-2147483647 - 1, 1}})
        CHECK(testing::raised([&] { corner_map(size.first, size.second); }) == error_code::invalid_option);
    const auto trace = [](std::int32_t width, std::int32_t height, std::size_t count) {
        const std::vector<float> disparity(count);
        return testing::raised([&] { curve_tracer(width, height, disparity, {}, [](std::int32_t, side) { return false; }); });
    };
    CHECK_FALSE(trace(4, 3, 12));
    CHECK_FALSE(trace(0, 3, 0));
    for (const std::size_t count : {0U, 11U, 13U}) CHECK(trace(4, 3, count) == error_code::mismatch);
    CHECK(trace(-1, -12, 12) == error_code::invalid_option);
}
