#include <ldi/base/executor.hpp>
#include <ldi/nn/ldi/pooling.hpp>

#include "tests/support/random_features.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace ldi;

TEST_CASE("a coarse pixel receives the average or the maximum of the pixels that collapse to it") {
    testing::for_random_graphs(10, 200, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half =
            coarsen(layers.topology(), testing::chance(random, 50) ? orphan_rule::stay : orphan_rule::adopt_nearest);
        const feature_map fine = testing::random_features(random, layers.topology().size(), 3);
        const feature_map average = average_pool(fine, half.map), largest = max_pool(fine, half.map);
        REQUIRE(average.pixels() == half.map.kept().size());
        REQUIRE(largest.pixels() == half.map.kept().size());
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(half.map.kept().size()); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                float sum = 0.0F, most = -10.0F;
                int count = 0;
                for (std::int32_t p = 0; p < static_cast<std::int32_t>(half.map.parent().size()); ++p) {
                    if (half.map.parent()[p] != i) continue;
                    sum += fine.at(p)[c], most = (std::max)(most, fine.at(p)[c]), ++count;
                }
                REQUIRE(count > 0);
                CHECK(average.at(i)[c] == sum / static_cast<float>(count));
                CHECK(largest.at(i)[c] == most);
            }
    });
}

TEST_CASE("on a grid, pooling equals image pooling over 2 x 2 pixels, with smaller blocks at odd borders") {
    std::mt19937 random(11);
    for (const auto& [width, height] : {std::pair{12, 8}, {13, 7}, {1, 5}}) {
        const graph g = make_grid(width, height);
        const coarsened half = coarsen(g);
        const feature_map image = testing::random_features(random, g.size(), 2);
        const feature_map average = average_pool(image, half.map), largest = max_pool(image, half.map);
        const int columns = (width + 1) / 2, rows = (height + 1) / 2;
        REQUIRE(average.pixels() == static_cast<std::size_t>(columns * rows));
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x)
                for (std::size_t c = 0; c < 2; ++c) {
                    float sum = 0.0F, most = -10.0F, count = 0.0F;
                    for (int v = 2 * y; v < (std::min)(2 * y + 2, height); ++v)
                        for (int u = 2 * x; u < (std::min)(2 * x + 2, width); ++u) {
                            sum += image.at(v * width + u)[c], count += 1.0F;
                            most = (std::max)(most, image.at(v * width + u)[c]);
                        }
                    CHECK(average.at(y * columns + x)[c] == sum / count);
                    CHECK(largest.at(y * columns + x)[c] == most);
                }
    }
}

TEST_CASE("pooling does not mix two surfaces separated by a silhouette") {
    testing::sketched_graph g(make_grid(4, 2));
    for (const std::int32_t i : {1, 5}) g.unlink(i, side::left);  // pixels 0 and 4 are a separate surface
    feature_map values(8, 1);
    for (std::int32_t i = 0; i < 8; ++i) values.at(i)[0] = i % 4 == 0 ? 100.0F : 1.0F;
    const coarsened half = coarsen(g);
    const feature_map average = average_pool(values, half.map), largest = max_pool(values, half.map);
    CHECK(average.at(0)[0] == 100.0F);
    CHECK(average.at(1)[0] == 1.0F);
    CHECK(largest.at(1)[0] == 1.0F);
}

TEST_CASE("pooling returns the same bits on any number of threads") {
    std::mt19937 random(12);
    const graph g = make_grid(150, 90);
    const coarsened half = coarsen(g);
    const feature_map fine = testing::random_features(random, g.size(), 5);
    thread_pool three(3);
    CHECK(average_pool(fine, half.map).values == average_pool(fine, half.map, three).values);
    CHECK(max_pool(fine, half.map).values == max_pool(fine, half.map, three).values);
}

TEST_CASE("byte maps are pooled to the rounded average and the largest byte") {
    testing::for_random_graphs(12, 200, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half = coarsen(layers.topology(), orphan_rule::adopt_nearest);
        basic_feature_map<std::uint8_t> fine(layers.topology().size(), 3, 17);
        for (std::uint8_t& value : fine.values) value = static_cast<std::uint8_t>(random());
        const auto average = average_pool(fine, half.map), largest = max_pool(fine, half.map);
        REQUIRE((average.zero == 17 && largest.zero == 17));
        for (std::int32_t i = 0; i < half.map.kept().count(); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                int sum = 0, count = 0, most = 0;
                for (std::int32_t p = 0; p < half.map.parent().count(); ++p)
                    if (half.map.parent()[p] == i) sum += fine.at(p)[c], ++count, most = (std::max)(most, int{fine.at(p)[c]});
                CHECK(average.at(i)[c] == std::floor(static_cast<double>(sum) / count + 0.5));
                CHECK(largest.at(i)[c] == most);
            }
    });
}

TEST_CASE("pooling refuses the level map of a graph whose size differs from the feature map's") {
    const ldi::feature_map fine(16, 1);
    for (const std::int32_t width : {0, 1, 3, 5, 300}) {
        const ldi::coarsened half = ldi::coarsen(ldi::make_grid(width, 4));
        CAPTURE(width);
        CHECK_THROWS_AS(ldi::average_pool(fine, half.map), ldi::error);
        CHECK_THROWS_AS(ldi::max_pool(fine, half.map), ldi::error);
    }
}
