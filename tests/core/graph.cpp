#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <limits>

using namespace ldi;

TEST_CASE("sides are in the paper's order, and up points to smaller y") {
    REQUIRE(std::vector<side>(std::begin(all_sides), std::end(all_sides)) ==
            std::vector<side>{side::up, side::down, side::left, side::right});
    STATIC_REQUIRE((step_x(side::up) == 0 && step_y(side::up) == -1));
    STATIC_REQUIRE((step_x(side::right) == 1 && step_y(side::right) == 0));
    for (const side s : all_sides) {
        CHECK(opposite(opposite(s)) == s);
        CHECK(step_x(opposite(s)) == -step_x(s));
        CHECK(step_y(opposite(s)) == -step_y(s));
        CHECK(std::abs(step_x(s)) + std::abs(step_y(s)) == 1);
    }
}

TEST_CASE("every pixel of a grid is linked to its four neighbors in the image") {
    for (const auto& [width, height] : {std::pair{0, 0}, {0, 5}, {1, 1}, {7, 1}, {1, 7}, {6, 4}}) {
        const graph g = make_grid(width, height);
        REQUIRE(g.size() == static_cast<std::size_t>(width * height));
        REQUIRE_FALSE(validate_canonical(g).has_value());
        for (std::int32_t i = 0; i < width * height; ++i) {
            const std::int32_t x = i % width, y = i / width;
            CHECK(g.x()[static_cast<std::size_t>(i)] == x);
            CHECK(g.y()[static_cast<std::size_t>(i)] == y);
            for (const side s : all_sides) {
                const std::int32_t there_x = x + step_x(s), there_y = y + step_y(s);
                const bool inside = there_x >= 0 && there_x < width && there_y >= 0 && there_y < height;
                CHECK(g.neighbor(i, s) == (inside ? there_y * width + there_x : no_pixel));
            }
        }
    }
}

// Code that makes these changes would break invariants. It must not compile for graph and graph_view.
template <class T>
concept can_add_pixels = requires(T& g) {
    g.add_pixel(0, 0);
};
template <class T>
concept can_link = requires(T& g) {
    g.link(0, side::right, 1);
};
template <class T>
concept can_move_pixels = requires(T& g) {
    g.x()[0] = 1;
};
template <class T>
concept can_redirect_neighbors = requires(T& g) {
    g.neighbors(side::up)[0] = 1;
};
template <class T>
concept can_resize_lattice = requires(T& g) {
    g.width() = 1;
};
template <class T>
concept can_resize = requires(T& g) {
    g.resize(1);
};
template <class Builder>
concept skips_check_by_braces = requires(Builder b) {
    std::move(b).build({});
};
static_assert(!skips_check_by_braces<graph_builder>, "only the tag in namespace detail skips the check");
template <class Builder>
concept is_uninitialized_by_braces = requires {
    Builder(1, 1, 1, {});
};
static_assert(!is_uninitialized_by_braces<graph_builder>);
template <class T>
constexpr bool is_fixed = !can_add_pixels<T> && !can_link<T> && !can_move_pixels<T> && !can_redirect_neighbors<T> &&
                          !can_resize_lattice<T> && !can_resize<T>;
static_assert(can_add_pixels<graph_builder> && can_link<graph_builder>, "the concepts hold for a type that has the functions");
static_assert(is_fixed<graph> && is_fixed<graph_view>);
static_assert(!std::is_convertible_v<graph_builder, graph>);
static_assert(std::is_convertible_v<const graph&, graph_view>);

TEST_CASE("each side has a column of neighbors") {
    const graph g = make_grid(3, 3);
    CHECK(g.neighbors(side::up).data() == g.up().data());
    CHECK(g.neighbors(side::down).data() == g.down().data());
    CHECK(g.neighbors(side::left).data() == g.left().data());
    CHECK(g.neighbors(side::right).data() == g.right().data());
    CHECK(g.neighbor(4, side::up) == 1);
    CHECK(g.neighbor(4, side::down) == 7);
    CHECK(g.neighbor(4, side::left) == 3);
    CHECK(g.neighbor(4, side::right) == 5);
}

TEST_CASE("an added pixel has no links") {
    graph_builder b(make_grid(2, 2));
    REQUIRE(b.add_pixel(1, 1) == 4);
    const graph g = std::move(b).build();
    REQUIRE(g.size() == 5);
    for (const side s : all_sides) CHECK(g.neighbor(4, s) == no_pixel);
    CHECK_FALSE(validate(g).has_value());
}

TEST_CASE("unlink() removes a link in both directions, and link() restores it") {
    std::mt19937 random(1);
    for (int repeat = 0; repeat < 300; ++repeat) {
        const graph before = testing::random_graph(random).topology();
        if (before.size() == 0) continue;
        const std::int32_t pixel = testing::below(random, static_cast<std::int32_t>(before.size()));
        const side s = testing::random_side(random);
        const std::int32_t other = before.neighbor(pixel, s);

        graph_builder b(before);
        b.unlink(pixel, s);
        const graph g = graph_builder(b).build();
        CHECK_FALSE(validate(g).has_value());
        CHECK(g.neighbor(pixel, s) == no_pixel);
        if (other == no_pixel) {
            CHECK(g == before);
            continue;
        }
        CHECK(g.neighbor(other, opposite(s)) == no_pixel);
        b.link(other, opposite(s), pixel);
        CHECK(std::move(b).build() == before);
    }
}

TEST_CASE("build() refuses a graph with a wrong link or position, even in release builds, and leaves the builder unchanged") {
    std::mt19937 random(3);
    std::int32_t refused = 0;
    for (int repeat = 0; repeat < 500; ++repeat) {
        const graph before = testing::random_graph(random).topology();
        if (before.size() == 0) continue;
        const std::int32_t count = before.count(), pixel = testing::below(random, count);
        const side s = testing::random_side(random);
        graph_builder b(before);
        switch (testing::below(random, 3)) {
            case 0: {  // a neighbor out of range, or a link in one direction only
                const std::int32_t other = testing::below(random, count + 8) - 4;
                if (other == before.neighbor(pixel, s) || other == no_pixel) continue;
                b.set_neighbor(pixel, s, other);
                break;
            }
            case 1:
                if (before.neighbor(pixel, s) == no_pixel) continue;
                b.set_neighbor(pixel, s, no_pixel);
                break;
            default: b.set_position(pixel, testing::chance(random, 50) ? -1 : before.width(), before.y()[pixel]);
        }
        const graph_builder kept = b;
        CHECK_THROWS_AS(std::move(b).build(), error);
        CHECK(b.x() == kept.x());
        CHECK(b.neighbors(s) == kept.neighbors(s));
        ++refused;
    }
    CHECK(refused > 200);
}

TEST_CASE("a builder refuses 2^31 pixels before it allocates memory") {
    constexpr std::size_t too_many = std::size_t{1} << 31;
    CHECK_THROWS_AS(graph_builder(1, 1, too_many), error);
    CHECK_THROWS_AS(graph_builder(1, 1, too_many, unset), error);
    CHECK_THROWS_AS(graph_builder(1, 1, 2 * too_many, unset), error);
}

TEST_CASE("can_link() and unlink() accept positions and neighbors out of range, which the unchecked setters allow") {
    graph_builder b(2, 1, 2);
    b.set_position(1, std::numeric_limits<std::int32_t>::max(), 0);
    b.set_position(0, std::numeric_limits<std::int32_t>::min(), 0);
    CHECK_FALSE(b.can_link(1, side::right, 0));
    b.set_position(0, 0, 0);
    CHECK_FALSE(b.can_link(1, side::right, 0));
    CHECK_FALSE(b.can_link(0, side::right, 1));
    b.set_neighbor(0, side::right, 1'000'000);
    b.unlink(0, side::right);
    CHECK(b.neighbor(0, side::right) == no_pixel);
}

TEST_CASE("the tests' random graphs are sound, and include islands, helices and five layers or more") {
    std::size_t max_layers = 0, empty = 0, islands = 0, helices = 0;
    std::int32_t graphs = 0;
    testing::for_random_graphs(2, 2000, [&](const testing::random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        ++graphs;
        REQUIRE_FALSE(validate(g).has_value());
        if (graphs % 2 == 1) REQUIRE_FALSE(validate_canonical(g, layers.disparity).has_value());
        if (g.size() == 0) ++empty;
        buffer<std::size_t> layers_at(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()), 0);
        for (std::size_t i = 0; i < g.size(); ++i) {
            max_layers = std::max(max_layers, ++layers_at[static_cast<std::size_t>(g.y()[i] * g.width() + g.x()[i])]);
            bool linked = false;
            for (const side s : all_sides) linked = linked || g.neighbors(s)[i] != no_pixel;
            if (!linked) ++islands;
            // The path right, down, left, up ends on a different layer from the one where it started.
            std::int32_t at = static_cast<std::int32_t>(i);
            for (const side s : {side::right, side::down, side::left, side::up})
                if (at != no_pixel) at = g.neighbor(at, s);
            if (at != no_pixel && at != static_cast<std::int32_t>(i)) ++helices;
        }
    });
    CHECK(max_layers >= 5);
    CHECK(empty > 0);
    CHECK(islands > 1000);
    CHECK(helices > 200);
}

TEST_CASE("positions are numbered row by row, without overflow on large lattices") {
    const graph g = make_grid(7, 5);
    CHECK(g.count() == 35);
    CHECK(g.position_count() == 35);
    for (std::int32_t i = 0; i < g.count(); ++i) {
        CHECK(g.position_of(i) == static_cast<std::size_t>(i));
        CHECK(g.position(g.x()[i], g.y()[i]) == static_cast<std::size_t>(i));
    }
    const graph large = graph_builder(max_lattice_side, max_lattice_side).build();
    CHECK(large.position_count() == 4294836225U);
    CHECK(large.position(65534, 65534) == 4294836224U);
}

TEST_CASE("a graph view refers to the caller's memory without a copy, and algorithms accept it like a graph") {
    testing::for_random_graphs(3, 200, [](const testing::random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const buffer<lattice_coordinate> x = g.x().copy(), y = g.y().copy();  // the caller's own arrays
        const buffer<std::int32_t> up = g.up().copy(), down = g.down().copy(), left = g.left().copy(), right = g.right().copy();
        const graph_view view(g.width(), g.height(), x, y, up, down, left, right);
        CHECK(view.x().data() == x.data());
        CHECK(view.left().data() == left.data());
        CHECK(view == g);
        CHECK(canonical_order(view) == canonical_order(g));
        CHECK_FALSE(validate(view).has_value());
    });
}

TEST_CASE("columns of different lengths are refused") {
    const buffer<lattice_coordinate> at(1), two_at(2);
    const buffer<std::int32_t> one(1, no_pixel), two(2, no_pixel);
    CHECK_NOTHROW(graph_view(1, 1, at, at, one, one, one, one));
    CHECK_THROWS_AS(graph_view(1, 1, at, at, one, one, one, two), error);
    CHECK_THROWS_AS(graph_view(1, 1, at, two_at, one, one, one, one), error);
}

TEST_CASE("lattices have at most 65,535 columns and rows") {
    for (const auto& [width, height] : {std::pair{max_lattice_side, 1}, {1, max_lattice_side}, {0, 0}})
        CHECK_NOTHROW(graph_builder(width, height));
    for (const auto& [width, height] : {std::pair{max_lattice_side + 1, 1}, {1, max_lattice_side + 1}, {INT32_MAX, INT32_MAX}}) {
        CHECK(testing::raised([&, w = width, h = height] { graph_builder(w, h); }) == error_code::too_large);
        CHECK(testing::raised([&, w = width, h = height] { graph_view(w, h, {}, {}, {}, {}, {}, {}); }) == error_code::too_large);
    }
    CHECK(testing::raised([] { graph_builder(-1, 1); }) == error_code::invalid_option);
    CHECK(testing::raised([] { make_grid(1, 65536); }) == error_code::too_large);
}

TEST_CASE("positions outside the lattice stay outside, however large or negative they are") {
    for (const std::int32_t at : {-1, -65536, INT32_MIN, 65535, 65536, 1 << 24, INT32_MAX}) {
        for (const std::int32_t side : {1, 8, max_lattice_side}) {
            graph_builder b(side, side, 1);
            b.set_position(0, at, 0);
            CHECK(testing::raised([&] { static_cast<void>(std::move(b).build()); }) == error_code::mismatch);
            graph_builder c(side, side, 1);
            c.set_position(0, 0, at);
            CHECK(testing::raised([&] { static_cast<void>(std::move(c).build()); }) == error_code::mismatch);
        }
    }
}

TEST_CASE("a moved-from graph has no pixels and no lattice") {
    graph g = make_grid(3, 4);
    graph moved = std::move(g);
    CHECK((g.width() == 0 && g.height() == 0 && g.size() == 0 && moved == make_grid(3, 4)));
    g = std::move(moved);
    CHECK((moved.width() == 0 && moved.height() == 0 && moved.size() == 0 && g == make_grid(3, 4)));
    g = make_grid(2, 2);
    CHECK(g == make_grid(2, 2));
}
