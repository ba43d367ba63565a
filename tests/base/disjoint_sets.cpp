#include <ldi/base/disjoint_sets.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

using ldi::disjoint_sets;

TEST_CASE("every integer starts in a set of its own") {
    disjoint_sets sets(4);
    CHECK(sets.add() == 4);
    REQUIRE(sets.size() == 5);
    for (std::int32_t i = 0; i < 5; ++i) CHECK(sets.find(i) == i);
    ldi::buffer<std::int32_t> labels;
    CHECK(sets.number(labels) == 5);
    CHECK(labels == ldi::buffer<std::int32_t>{0, 1, 2, 3, 4});
}

TEST_CASE("a merged set is represented by its smallest member, in any order of merging") {
    std::mt19937 random(40);
    for (int repeat = 0; repeat < 500; ++repeat) {
        const std::int32_t count = 1 + ldi::testing::below(random, 40);
        disjoint_sets sets(static_cast<std::size_t>(count));
        // the smallest member of each integer's set, by brute force
        ldi::buffer<std::int32_t> smallest(static_cast<std::size_t>(count));
        std::iota(smallest.begin(), smallest.end(), 0);
        for (std::int32_t merges = ldi::testing::below(random, 60); merges > 0; --merges) {
            const std::int32_t a = ldi::testing::below(random, count), b = ldi::testing::below(random, count);
            const std::int32_t of_a = smallest[static_cast<std::size_t>(a)], of_b = smallest[static_cast<std::size_t>(b)];
            REQUIRE(sets.merge(a, b) == std::min(of_a, of_b));
            for (std::int32_t& s : smallest)
                if (s == of_a || s == of_b) s = std::min(of_a, of_b);
        }
        ldi::buffer<std::int32_t> labels;
        const std::int32_t sets_left = sets.number(labels);
        std::int32_t next = 0;
        for (std::int32_t i = 0; i < count; ++i) {
            const std::int32_t first = smallest[static_cast<std::size_t>(i)];
            REQUIRE(sets.find(i) == first);
            if (first == i)
                REQUIRE(labels[static_cast<std::size_t>(i)] == next++);
            else
                REQUIRE(labels[static_cast<std::size_t>(i)] == labels[static_cast<std::size_t>(first)]);
        }
        REQUIRE(sets_left == next);
    }
}
