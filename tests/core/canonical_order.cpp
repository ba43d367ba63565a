#include <ldi/core/canonical_order.hpp>
#include <ldi/core/validate.hpp>

#include "tests/core/broken_view.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <limits>

using namespace ldi;
using ldi::testing::random_layers;

template <class Graph>
concept can_be_reordered = requires(const Graph& g, std::span<const std::int32_t> order) {
    ldi::reordered(g, order);
};
static_assert(can_be_reordered<graph> && !can_be_reordered<graph_view>, "a view may refer to an invalid graph");

namespace {
/// Checks independently whether pixels are in canonical order.
bool stands_in_canonical_order(const random_layers& layers) {
    const graph& g = layers.topology();
    std::size_t run = 0;  // start of the run that contains pixel i - 1
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (g.left()[i] != no_pixel) {
            if (g.left()[i] != static_cast<std::int32_t>(i) - 1) return false;
            continue;
        }
        if (i > 0) {
            const auto key = [&](std::size_t k) { return std::tuple(g.y()[k], g.x()[k], -layers.disparity[k]); };
            if (!(key(run) < key(i))) return false;
        }
        run = i;
    }
    return true;
}
}  // namespace

TEST_CASE("canonical order sorts pixels by scanline, runs by their first x, and runs with the same first x from near to far") {
    testing::sketched_graph g(3, 2);
    const std::int32_t far_right = g.add_pixel(2, 0);
    const std::int32_t below = g.add_pixel(0, 1);
    const std::int32_t near_first = g.add_pixel(0, 0);
    const std::int32_t far_second = g.add_pixel(1, 0);
    const std::int32_t far_first = g.add_pixel(0, 0);
    const std::int32_t near_second = g.add_pixel(1, 0);
    g.link(far_first, side::right, far_second);
    g.link(far_second, side::right, far_right);
    g.link(near_first, side::right, near_second);
    g.link(near_first, side::down, below);
    const buffer<float> disparity{0.1F, 0.8F, 0.9F, 0.1F, 0.1F, 0.9F};
    CHECK(canonical_order(g, disparity) ==
          buffer<std::int32_t>{near_first, near_second, far_first, far_second, far_right, below});

    const buffer<float> swapped{0.9F, 0.8F, 0.1F, 0.9F, 0.9F, 0.1F};
    CHECK(canonical_order(g, swapped) == buffer<std::int32_t>{far_first, far_second, far_right, near_first, near_second, below});
}

TEST_CASE("without disparity, runs that start at the same position keep their order") {
    testing::sketched_graph g(1, 1);
    for (int i = 0; i < 4; ++i) g.add_pixel(0, 0);
    CHECK(canonical_order(g) == buffer<std::int32_t>{0, 1, 2, 3});
}

TEST_CASE("the pixels of an image are in canonical order") {
    const graph grid = make_grid(9, 5);
    CHECK_FALSE(validate_canonical(grid).has_value());
}

TEST_CASE("canonical_order() returns a permutation that matches the definition") {
    testing::for_random_graphs(3, 1500, [](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const buffer<std::int32_t> order = canonical_order(g, layers.disparity);
        buffer<std::int32_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        REQUIRE(sorted.size() == g.size());
        for (std::size_t i = 0; i < sorted.size(); ++i) REQUIRE(sorted[i] == static_cast<std::int32_t>(i));

        const random_layers canonical = testing::reordered(layers, order);
        REQUIRE(stands_in_canonical_order(canonical));
        REQUIRE_FALSE(validate_canonical(canonical.topology(), canonical.disparity).has_value());
    });
}

TEST_CASE("validate_canonical() agrees with the definition on sorted and unsorted graphs") {
    int canonical = 0, not_canonical = 0;
    testing::for_random_graphs(4, 1000, [&](const random_layers& layers, std::mt19937&) {
        const bool expected = stands_in_canonical_order(layers);
        REQUIRE(validate_canonical(layers.topology(), layers.disparity).has_value() == !expected);
        ++(expected ? canonical : not_canonical);
    });
    CHECK(canonical > 300);
    CHECK(not_canonical > 300);
}

TEST_CASE("canonical order is idempotent, and does not depend on the previous order") {
    testing::for_random_graphs(5, 1000, [](const random_layers& layers, std::mt19937& random) {
        const random_layers once = testing::in_canonical_order(layers);
        const random_layers twice = testing::in_canonical_order(once);
        REQUIRE(once.topology() == twice.topology());
        REQUIRE(once.disparity == twice.disparity);

        const random_layers other_way = testing::in_canonical_order(testing::shuffled(layers, random));
        REQUIRE(once.topology() == other_way.topology());
        REQUIRE(once.disparity == other_way.disparity);
    });
}

TEST_CASE("reordered() keeps every pixel's position and neighbors") {
    testing::for_random_graphs(6, 500, [](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const buffer<std::int32_t> order = testing::random_permutation(random, g.size());
        const graph moved = ldi::reordered(g, order);
        REQUIRE_FALSE(validate(moved).has_value());
        for (std::size_t i = 0; i < g.size(); ++i) {
            const std::size_t old = static_cast<std::size_t>(order[i]);
            REQUIRE(moved.x()[i] == g.x()[old]);
            REQUIRE(moved.y()[i] == g.y()[old]);
            for (const side s : all_sides) {
                const std::int32_t there = moved.neighbors(s)[i];
                REQUIRE((there == no_pixel ? no_pixel : order[static_cast<std::size_t>(there)]) == g.neighbors(s)[old]);
            }
        }
    });
}

TEST_CASE("reordered() refuses an order that is not a permutation of the pixels") {
    const graph g = make_grid(2, 1);
    for (const buffer<std::int32_t>& order : {buffer<std::int32_t>{0}, {0, 0}, {0, 2}, {-1, 0}, {0, 1, 0}})
        CHECK_THROWS_AS(ldi::reordered(g, order), error);
    layered_image<disparity_column> layers(make_grid(2, 1), {0.25F, 0.5F});
    CHECK_THROWS_AS(layers.reorder(buffer<std::int32_t>{1, 1}), error);
    CHECK(layers.column<disparity_column>() == buffer<float>{0.25F, 0.5F});
}

TEST_CASE("reordered() moves each row of a column as a whole") {
    const buffer<int> column{10, 11, 20, 21, 30, 31};
    const buffer<std::int32_t> order{2, 0, 1};
    CHECK(ldi::reordered(column, order, 2) == buffer<int>{30, 31, 10, 11, 20, 21});
    for (const std::int32_t wrong : {-1, 3, 0x7FFFFFFF})
        CHECK_THROWS_AS(ldi::reordered(column, buffer<std::int32_t>{0, wrong}, 2), error);
}

TEST_CASE("canonical_order() refuses an invalid view, and a wrong number of disparities") {
    testing::for_broken_views([](const graph_view& view) {
        CHECK_THAT(testing::message_of([&] { canonical_order(view); }), Catch::StartsWith("canonical_order: "));
    });
    const graph g = make_grid(8, 8);
    const buffer<float> few(16);
    CHECK(testing::raised([&] { canonical_order(g, few); }) == error_code::mismatch);
    CHECK(testing::raised([&] { canonical_order(graph_view(g), few); }) == error_code::mismatch);
    CHECK(canonical_order(g) == canonical_order(graph_view(g)));
}

TEST_CASE("canonical_order() and validate_canonical() refuse NaN, and accept infinite disparities") {
    testing::sketched_graph g(1, 1);
    for (int i = 0; i < 40; ++i) g.add_pixel(0, 0);
    const float infinite = std::numeric_limits<float>::infinity();
    buffer<float> disparity(40, 0.5F);
    disparity[0] = -infinite, disparity[39] = infinite;
    const buffer<std::int32_t> order = canonical_order(graph_view(g), disparity);
    CHECK((order.front() == 39 && order.back() == 0));
    CHECK(validate_canonical(g, disparity)->broken == invariant::canonical_order);
    for (const std::size_t place : {0U, 7U, 39U}) {
        buffer<float> broken = disparity;
        broken[place] = std::numeric_limits<float>::quiet_NaN();
        CHECK(testing::raised([&] { canonical_order(graph_view(g), broken); }) == error_code::invalid_data);
        CHECK(testing::raised([&] { validate_canonical(g, broken); }) == error_code::invalid_data);
    }
}
