#include <ldi/nn/upsample.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

using namespace ldi;
using ldi::testing::random_layers;

TEST_CASE("the pixel above is the kept one of the pixel's own group, and coarsening adopts only where there is none") {
    testing::for_random_graphs(50, 1000, [](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology;
        const coarsened coarse = coarsen(g);
        const std::vector<std::int32_t> parents = parents_in_group(g, coarse);
        REQUIRE(parents.size() == g.size());
        for (std::size_t i = 0; i < g.size(); ++i) {
            if (parents[i] == no_pixel) continue;
            const std::size_t corner = static_cast<std::size_t>(coarse.kept[static_cast<std::size_t>(parents[i])]);
            REQUIRE(g.x[corner] == g.x[i] / 2 * 2);
            REQUIRE(g.y[corner] == g.y[i] / 2 * 2);
            REQUIRE(parents[i] == coarse.parent[i]);
        }
        for (const std::int32_t kept : coarse.kept) REQUIRE(parents[static_cast<std::size_t>(kept)] != no_pixel);
    });
}

TEST_CASE("a pixel cut off from its group's corner has nothing above") {
    graph g = make_grid(4, 2);
    g.unlink(3, side::left), g.unlink(3, side::down);
    const coarsened coarse = coarsen(g);
    CHECK(parents_in_group(g, coarse) == std::vector<std::int32_t>{0, 0, 1, no_pixel, 0, 0, 1, 1});
    CHECK(needed_rows(std::vector<std::int32_t>{0, 1, 3}, parents_in_group(g, coarse), 2) == std::vector<std::int32_t>{0});
}
