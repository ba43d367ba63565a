#include <ldi/core/canonical_order.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace ldi;

namespace {
/// A copy of a graph's columns. Tests change it to break invariants.
struct own_columns {
    explicit own_columns(const graph& g) : width(g.width()), height(g.height()) {
        coordinates.push_back(g.x().copy()), coordinates.push_back(g.y().copy());
        for (const side s : all_sides) columns.push_back(g.neighbors(s).copy());
    }
    buffer<lattice_coordinate>& x() { return coordinates[0]; }
    buffer<lattice_coordinate>& y() { return coordinates[1]; }
    buffer<std::int32_t>& neighbors(side s) { return columns[static_cast<int>(s)]; }
    std::int32_t neighbor(std::int32_t pixel, side s) { return neighbors(s)[pixel]; }
    std::size_t size() const { return columns[0].size(); }
    operator graph_view() const {
        return graph_view(width, height, coordinates[0], coordinates[1], columns[0], columns[1], columns[2], columns[3]);
    }

    std::int32_t width, height;
    buffer<buffer<lattice_coordinate>> coordinates;
    buffer<buffer<std::int32_t>> columns;
};

/// Damages random graphs with `damage(graph, pixel, side, random)`, and checks that validate() finds the invariant `expected`
/// broken at this pixel. Skips a graph if `damage` returns false.
template <class Damage>
void detects(invariant expected, std::uint32_t seed, Damage&& damage) {
    int broken = 0;
    testing::for_random_graphs(seed, 600, [&](const testing::random_layers& layers, std::mt19937& random) {
        own_columns g(layers.topology());
        if (g.size() == 0) return;
        REQUIRE_FALSE(validate(g).has_value());
        const std::int32_t pixel = testing::below(random, static_cast<std::int32_t>(g.size()));
        if (!damage(g, pixel, testing::random_side(random), random)) return;
        const std::optional<violation> found = validate(g);
        REQUIRE(found.has_value());
        CHECK(found->broken == expected);
        CHECK(found->pixel == pixel);
        ++broken;
    });
    CHECK(broken > 50);
}
}  // namespace

TEST_CASE("validate() finds no violation in sound graphs") {
    const graph empty, grid = make_grid(5, 3);
    CHECK_FALSE(validate(empty).has_value());
    CHECK_FALSE(validate(grid).has_value());
    testing::for_random_graphs(10, 500, [](const testing::random_layers& layers, std::mt19937&) {
        REQUIRE_FALSE(validate(layers.topology()).has_value());
    });
}

TEST_CASE("a position outside the lattice is detected") {
    detects(invariant::inside_lattice, 11, [](own_columns& g, std::int32_t pixel, side s, std::mt19937&) {
        const std::size_t i = static_cast<std::size_t>(pixel);
        switch (s) {
            case side::left: g.x()[i] = max_lattice_side; break;
            case side::right: g.x()[i] = static_cast<lattice_coordinate>(g.width); break;
            case side::up: g.y()[i] = max_lattice_side; break;
            case side::down: g.y()[i] = static_cast<lattice_coordinate>(g.height); break;
        }
        return true;
    });
}

TEST_CASE("a neighbor index out of range is detected") {
    detects(invariant::neighbor_in_range, 12, [](own_columns& g, std::int32_t pixel, side s, std::mt19937& random) {
        g.neighbors(s)[static_cast<std::size_t>(pixel)] =
            testing::chance(random, 50) ? static_cast<std::int32_t>(g.size()) : -2 - testing::below(random, 10);
        return true;
    });
}

TEST_CASE("a one-way link is detected") {
    detects(invariant::mutual_links, 13, [](own_columns& g, std::int32_t pixel, side s, std::mt19937&) {
        const std::int32_t there = g.neighbor(pixel, s);
        if (there == no_pixel) return false;
        g.neighbors(opposite(s))[static_cast<std::size_t>(there)] = no_pixel;
        return true;
    });
    detects(invariant::mutual_links, 14, [](own_columns& g, std::int32_t pixel, side s, std::mt19937& random) {
        if (g.neighbor(pixel, s) != no_pixel) return false;
        g.neighbors(s)[static_cast<std::size_t>(pixel)] = testing::below(random, static_cast<std::int32_t>(g.size()));
        return true;
    });
}

TEST_CASE("two pixels that link to the same side of one neighbor are detected") {
    graph_builder b(make_grid(2, 2));
    const std::int32_t rival = b.add_pixel(0, 0);
    own_columns g(std::move(b).build());
    g.neighbors(side::right)[rival] = 1;
    const std::optional<violation> found = validate(g);
    REQUIRE(found.has_value());
    CHECK(found->broken == invariant::mutual_links);
    CHECK(found->pixel == rival);
}

TEST_CASE("a mutual link between pixels that are not adjacent is detected") {
    int broken = 0;
    testing::for_random_graphs(15, 1000, [&](const testing::random_layers& layers, std::mt19937& random) {
        own_columns g(layers.topology());
        if (g.size() == 0) return;
        const std::int32_t a = testing::below(random, static_cast<std::int32_t>(g.size()));
        const std::int32_t b = testing::below(random, static_cast<std::int32_t>(g.size()));
        const side s = testing::random_side(random);
        const std::size_t i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
        const bool side_by_side = g.x()[j] == g.x()[i] + step_x(s) && g.y()[j] == g.y()[i] + step_y(s);
        if (side_by_side || g.neighbor(a, s) != no_pixel || g.neighbor(b, opposite(s)) != no_pixel) return;
        g.neighbors(s)[a] = b, g.neighbors(opposite(s))[b] = a;
        const std::optional<violation> found = validate(g);
        REQUIRE(found.has_value());
        CHECK(found->broken == invariant::one_step_away);
        CHECK(found->pixel == std::min(a, b));
        ++broken;
    });
    CHECK(broken > 100);
}

TEST_CASE("validate_canonical() reports the first pixel that is out of canonical order") {
    const graph g = make_grid(4, 4);
    buffer<std::int32_t> order = canonical_order(g);
    std::swap(order[6], order[9]);
    const graph swapped = ldi::reordered(g, order);
    CHECK_FALSE(validate(swapped).has_value());
    const std::optional<violation> found = validate_canonical(swapped);
    REQUIRE(found.has_value());
    CHECK(found->broken == invariant::canonical_order);
    CHECK(found->pixel == 6);
}

TEST_CASE("every invariant has a unique name") {
    std::vector<std::string_view> names;
    for (const invariant i : {invariant::inside_lattice, invariant::neighbor_in_range, invariant::mutual_links,
                              invariant::one_step_away, invariant::canonical_order, invariant::disparity_in_range})
        names.push_back(to_string(i));
    std::sort(names.begin(), names.end());
    CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
    CHECK(std::find(names.begin(), names.end(), "unknown invariant") == names.end());
}

TEST_CASE("a disparity that is NaN or outside -1 to 1 is detected") {
    photo_layers layers(make_grid(4, 3));
    CHECK_FALSE(validate(layers));
    layers.column<disparity_column>()[5] = 1.5F;
    REQUIRE(validate(layers));
    CHECK(validate(layers)->broken == invariant::disparity_in_range);
    CHECK(validate(layers)->pixel == 5);
    layers.column<disparity_column>()[5] = std::nanf("");
    CHECK(validate(layers)->broken == invariant::disparity_in_range);
    layers.column<disparity_column>()[5] = 1.0F;
    CHECK_FALSE(validate(layers));
}

TEST_CASE("disparities that are not finite are refused, wherever they are") {
    buffer<float> disparity(40, 0.5F);
    check_disparities(disparity, "test");
    for (std::size_t i = 0; i < disparity.size(); ++i)
        for (const float wrong : {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                                  std::numeric_limits<float>::quiet_NaN()}) {
            disparity[i] = wrong;
            CHECK(testing::raised([&] { check_disparities(disparity, "test"); }) == error_code::invalid_data);
            disparity[i] = std::numeric_limits<float>::max();
            check_disparities(disparity, "test");
        }
}
