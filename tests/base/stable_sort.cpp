#include <ldi/base/stable_sort.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>
#include <utility>

TEST_CASE("stable_sort() returns the same order as std::stable_sort()") {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        ldi::buffer<std::pair<int, int>> values;
        const int count = static_cast<int>(random() % 200), keys = 1 + static_cast<int>(random() % 30);
        for (int i = 0; i < count; ++i) values.emplace_back(static_cast<int>(random() % static_cast<unsigned>(keys)), i);
        ldi::buffer<std::pair<int, int>> expected = values;
        const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
        std::stable_sort(expected.begin(), expected.end(), before);
        ldi::stable_sort(values, before);
        REQUIRE(values == expected);
    }
}
