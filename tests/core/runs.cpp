#include "tests/support/random_graph.hpp"

#include <ldi/core/runs.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>

using namespace ldi;

TEST_CASE("runs contain every pixel exactly once, link their pixels from left to right, and are maximal") {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        graph g = testing::random_graph(random, 40).topology();
        if (round % 2 == 1) {
            const testing::random_layers shuffled = testing::shuffled(testing::random_graph(random, 40), random);
            g = shuffled.topology();
        }
        std::int32_t next = 0;
        for (const pixel_run& r : runs_of(g)) {
            REQUIRE(r.first == next);
            REQUIRE(r.size() >= 1);
            for (std::int32_t i = r.first; i + 1 < r.last; ++i) REQUIRE(g.right()[i] == i + 1);
            if (r.last < static_cast<std::int32_t>(g.size())) REQUIRE(g.right()[r.last - 1] != r.last);
            next = r.last;
        }
        REQUIRE(next == static_cast<std::int32_t>(g.size()));
    }
}

TEST_CASE("every row of an image is one run, and an empty graph has no runs") {
    const graph grid = make_grid(7, 3), empty;
    CHECK(runs_of(grid).size() == 3);
    CHECK(runs_of(empty).empty());
}

TEST_CASE("the last pixel of a run is found from each of its pixels, and up to any limit") {
    for (const std::int32_t width : {1, 15, 16, 17, 33, 100}) {
        const graph grid = make_grid(width, 2);
        for (std::int32_t first = 0; first < 2 * width; ++first)
            for (std::int32_t limit = first; limit < 2 * width; ++limit)
                REQUIRE(last_of_run(grid.right().data(), first, limit) == std::min(limit, first / width * width + width - 1));
    }
}
