#include <ldi/charts/chart_pixels.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

using namespace ldi;

TEST_CASE("a chart's pixels are those added, ascending, and its runs are as long as possible") {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        chart_pixels pixels;
        std::vector<std::int32_t> expected;
        std::int32_t next = 0;
        for (std::size_t adds = random() % 20; adds > 0; --adds) {
            const std::int32_t first = next + static_cast<std::int32_t>(random() % 3),
                               count = 1 + static_cast<std::int32_t>(random() % 4);
            if (count == 1)
                pixels.push_back(first);
            else
                pixels.add_run(first, count);
            next = first + count;
            for (std::int32_t p = first; p < next; ++p) expected.push_back(p);
        }
        REQUIRE(pixels.size() == expected.size());
        REQUIRE(pixels.empty() == expected.empty());
        REQUIRE(std::equal(pixels.begin(), pixels.end(), expected.begin(), expected.end()));
        if (!expected.empty()) REQUIRE((pixels.front() == expected.front() && pixels.back() == expected.back()));
        std::int32_t end = -1;
        for (const chart_pixels::run& r : pixels.runs()) {
            REQUIRE((r.first > end && r.count > 0));
            end = r.first + r.count;
        }
        chart_pixels one_by_one;
        for (const std::int32_t pixel : expected) one_by_one.push_back(pixel);
        REQUIRE(one_by_one == pixels);
    }
}

TEST_CASE("a moved-from list of pixels is empty") {
    chart_pixels pixels;
    pixels.add_run(3, 4);
    const chart_pixels other = std::move(pixels);
    CHECK(other.size() == 4);
    CHECK((pixels.empty() && pixels.size() == 0 && pixels.runs().empty()));  // NOLINT(bugprone-use-after-move)
}

TEST_CASE("a chart's pixels refuse pixels out of order, negative ones, empty runs, and indices of 2^31 - 1 or more") {
    constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
    chart_pixels pixels;
    const auto refuses = [&](std::int32_t first, std::int32_t count) {
        const chart_pixels before = pixels;
        CHECK(testing::raised([&] { pixels.add_run(first, count); }) == error_code::mismatch);
        CHECK(pixels == before);
    };
    refuses(-1, 1), refuses(std::numeric_limits<std::int32_t>::min(), most), refuses(0, 0), refuses(0, -1);
    pixels.add_run(5, 3);
    refuses(7, 1), refuses(5, 1), refuses(0, 1), refuses(8, 0), refuses(8, most), refuses(most, 1), refuses(9, most - 8);
    pixels.add_run(9, most - 9);
    CHECK(pixels.back() == most - 1);
    CHECK(pixels.size() == 3 + static_cast<std::size_t>(most - 9));
    refuses(most, 1);
}
