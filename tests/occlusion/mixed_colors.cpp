#include <ldi/occlusion/mixed_colors.hpp>

#include "tests/support/lifted_scene.hpp"

#include <catch2/catch.hpp>

#include <random>

TEST_CASE("the margins on both sides of a silhouette are unknown, all else stays known") {
    ldi::image<float> map(20, 40);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x, 0) = x < 20 ? 0.2F : 0.8F;
    ldi::photo_layer layers = ldi::test::lift_disparity(map);
    ldi::mixed_color_options options;
    options.foreground_margin = 3;
    options.background_margin = 1;
    ldi::unmix_colors(layers, options);
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const std::int32_t x = layers.topology.x[i];
        REQUIRE(layers.column<ldi::known_column>()[i] == (x >= 19 && x < 23 ? 0 : 1));
    }
}

TEST_CASE("a rod thinner than its margins keeps its colors") {
    ldi::image<float> map(20, 40);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x, 0) = x >= 20 && x < 24 ? 0.8F : 0.2F;
    ldi::photo_layer layers = ldi::test::lift_disparity(map);
    ldi::unmix_colors(layers);
    for (std::size_t i = 0; i < layers.size(); ++i)
        if (layers.topology.x[i] >= 20 && layers.topology.x[i] < 24) REQUIRE(layers.column<ldi::known_column>()[i] == 1);
}

TEST_CASE("every unknown pixel can be refilled: links lead from it to a known one within the margin") {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        ldi::photo_layer layers =
            ldi::test::lift_disparity(ldi::test::random_disparity(random, 1 + random() % 40, 1 + random() % 40));
        ldi::mixed_color_options options;
        options.foreground_margin = static_cast<int>(random() % 5);
        options.background_margin = static_cast<int>(random() % 5);
        ldi::unmix_colors(layers, options);
        // Both margins together are at most 8 steps wide where a surface is in front on one side and behind on the other.
        ldi::buffer<std::uint8_t> reached = layers.column<ldi::known_column>();
        for (int step = 0; step < options.foreground_margin + options.background_margin; ++step) {
            const ldi::buffer<std::uint8_t> before = reached;
            for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i)
                for (ldi::side s : ldi::all_sides)
                    if (const std::int32_t n = layers.topology.neighbor(i, s);
                        n != ldi::no_pixel && before[static_cast<std::size_t>(n)] != 0)
                        reached[static_cast<std::size_t>(i)] = 1;
        }
        for (std::uint8_t r : reached) REQUIRE(r == 1);
    }
}
