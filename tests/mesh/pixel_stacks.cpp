#include <ldi/mesh/detail/pixel_stacks.hpp>

#include <ldi/core/runs.hpp>

#include <catch2/catch.hpp>
#include <tests/support/random_graph.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

TEST_CASE("a stack lists each pixel of its position once, the nearest first") {
    std::size_t deepest = 0, long_runs = 0;
    std::mt19937 random(31);
    for (int round = 0; round < 200; ++round) {
        const ldi::testing::random_layers any = ldi::testing::random_graph(random, round % 2 == 0 ? 14 : 60);
        const ldi::testing::random_layers layers = round % 4 < 2 ? any : ldi::testing::shuffled(any, random);
        const ldi::graph& g = layers.topology();
        ldi::for_each_run(g, [&](ldi::pixel_run r) { long_runs += r.size() > 20 ? 1U : 0U; });
        ldi::buffer<float> disparity(g.size());
        for (float& d : disparity) d = static_cast<float>(random() % 4);  // few values, so that many pixels are equally near
        const ldi::detail::pixel_stacks stacks(g, disparity);
        for (std::int32_t y = 0; y < g.height(); ++y)
            for (std::int32_t x = 0; x < g.width(); ++x) {
                ldi::buffer<std::int32_t> expected, found;
                for (std::int32_t i = 0; i < g.count(); ++i)
                    if (g.x()[i] == x && g.y()[i] == y) expected.push_back(i);
                stacks.for_each(x, y, [&](std::int32_t pixel) { found.push_back(pixel); });
                const auto nearest = std::max_element(expected.begin(), expected.end(), [&](std::int32_t a, std::int32_t b) {
                    return disparity[a] < disparity[b];
                });
                REQUIRE(stacks.nearest(x, y) == (expected.empty() ? ldi::no_pixel : *nearest));
                if (!found.empty()) REQUIRE(found.front() == *nearest);
                std::sort(found.begin(), found.end());
                REQUIRE(std::equal(found.begin(), found.end(), expected.begin(), expected.end()));
                deepest = std::max(deepest, found.size());
            }
    }
    REQUIRE(deepest > 2);
    REQUIRE(long_runs > 100);  // they overlap several blocks
}

TEST_CASE("there are no pixels outside the lattice") {
    const ldi::graph g = ldi::make_grid(4, 3);
    const ldi::buffer<float> disparity(g.size(), 0.5F);
    const ldi::detail::pixel_stacks stacks(g, disparity);
    for (const auto& [x, y] : {std::pair{-1, 0}, {0, -1}, {4, 0}, {0, 3}, {-1, 1}}) {
        CHECK(stacks.nearest(x, y) == ldi::no_pixel);
        stacks.for_each(x, y, [](std::int32_t pixel) { FAIL("pixel " << pixel); });
    }
}
