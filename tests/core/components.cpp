#include <ldi/core/components.hpp>

#include "tests/core/broken_view.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

using namespace ldi;

namespace {
/// Floods from each pixel that has no label yet.
components flooded(const graph_view& g) {
    components result;
    result.label.assign(g.size(), -1);
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (result.label[i] != -1) continue;
        const std::int32_t label = static_cast<std::int32_t>(result.size.size());
        result.size.push_back(0);
        buffer<std::int32_t> open{static_cast<std::int32_t>(i)};
        result.label[i] = label;
        while (!open.empty()) {
            const std::int32_t at = open.back();
            open.pop_back();
            ++result.size.back();
            for (const side s : all_sides) {
                const std::int32_t n = g.neighbor(at, s);
                if (n == no_pixel || result.label[static_cast<std::size_t>(n)] != -1) continue;
                result.label[static_cast<std::size_t>(n)] = label;
                open.push_back(n);
            }
        }
    }
    return result;
}
}  // namespace

TEST_CASE("an empty graph has no components, and an image has one") {
    const graph empty, grid = make_grid(5, 4);
    CHECK(connected_components(empty).count() == 0);
    const components whole = connected_components(grid);
    CHECK(whole.size == buffer<std::int32_t>{20});
    CHECK(whole.label == buffer<std::int32_t>(20, 0));
}

TEST_CASE("components are numbered in the order of their first pixels") {
    testing::sketched_graph g(make_grid(3, 2));
    for (const std::int32_t i : {0, 3}) g.unlink(i, side::right);
    g.unlink(2, side::down);
    g.unlink(1, side::down);
    const components found = connected_components(g);
    CHECK(found.label == buffer<std::int32_t>{0, 1, 1, 0, 2, 2});
    CHECK(found.size == buffer<std::int32_t>{2, 2, 2});
}

TEST_CASE("layers at the same position belong to one component only if links join them") {
    testing::sketched_graph g(make_grid(2, 1));
    const std::int32_t behind = g.add_pixel(0, 0);
    CHECK(connected_components(g).label == buffer<std::int32_t>{0, 0, 1});
    g.unlink(0, side::right);
    g.link(behind, side::right, 1);
    CHECK(connected_components(g).label == buffer<std::int32_t>{0, 1, 1});
}

TEST_CASE("a comb whose teeth join only at the bottom is one component") {
    testing::sketched_graph g(make_grid(31, 20));
    for (std::int32_t y = 0; y < 19; ++y)
        for (std::int32_t x = 0; x < 30; ++x) g.unlink(y * 31 + x, side::right);
    CHECK(connected_components(g).size == buffer<std::int32_t>{31 * 20});
}

TEST_CASE("connected_components() matches a flood fill on random graphs with pixels in any order") {
    std::size_t most = 0;
    testing::for_random_graphs(30, 4000, [&](const testing::random_layers& layers, std::mt19937&) {
        const components found = connected_components(layers.topology()), expected = flooded(layers.topology());
        REQUIRE(found.label == expected.label);
        REQUIRE(found.size == expected.size);
        most = std::max(most, found.count());
    });
    CHECK(most > 50);
}

TEST_CASE("connected_components() refuses an invalid view") {
    testing::for_broken_views([](const graph_view& view) {
        CHECK_THAT(testing::message_of([&] { connected_components(view); }), Catch::StartsWith("connected_components: "));
    });
}
