// Random layered graphs and random partitions of them into charts: folds, slits, holes, pinches and charts of one pixel.
#pragma once

#include <ldi/charts/charts.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/validate.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace ldi::testing {

struct charted_graph {
    ldi::graph topology;
    ldi::buffer<float> disparity;
    ldi::chart_set charts;
};

/// Layers of random pixels over each other, linked within a layer and, in some places, between layers.
inline ldi::graph random_linked_layers(std::mt19937& random, std::int32_t max_side) {
    const auto below = [&](std::int32_t n) { return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(n)); };
    const std::int32_t width = 1 + below(max_side), height = 1 + below(max_side);
    ldi::graph_builder g(width, height);
    const std::int32_t layers = 1 + below(3);
    const std::int32_t density = 40 + below(61), linked = 70 + below(31), folded = below(40);
    ldi::buffer<ldi::buffer<std::int32_t>> at(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()));
    for (std::int32_t layer = 0; layer < layers; ++layer)
        for (std::int32_t y = 0; y < g.height(); ++y)
            for (std::int32_t x = 0; x < g.width(); ++x)
                if (below(100) < density || at.size() == 1)
                    at[static_cast<std::size_t>(y * g.width() + x)].push_back(g.add_pixel(x, y));
    for (std::int32_t pass = 0; pass < 2; ++pass)
        for (std::int32_t y = 0; y < g.height(); ++y)
            for (std::int32_t x = 0; x < g.width(); ++x)
                for (ldi::side s : {ldi::side::right, ldi::side::down}) {
                    const std::int32_t u = x + ldi::step_x(s), v = y + ldi::step_y(s);
                    if (u >= g.width() || v >= g.height()) continue;
                    const auto& here = at[static_cast<std::size_t>(y * g.width() + x)];
                    const auto& there = at[static_cast<std::size_t>(v * g.width() + u)];
                    for (std::size_t i = 0; i < here.size(); ++i)
                        for (std::size_t j = 0; j < there.size(); ++j) {
                            if (g.neighbor(here[i], s) != ldi::no_pixel) continue;
                            if (g.neighbor(there[j], ldi::opposite(s)) != ldi::no_pixel) continue;
                            if (pass == 0 ? i == j && below(100) < linked : below(100) < folded) g.link(here[i], s, there[j]);
                        }
                }
    const ldi::graph made = std::move(g).build();
    return ldi::reordered(made, ldi::canonical_order(made));
}

/// Connected charts of random size with at most one pixel per position.
inline ldi::chart_set random_partition(const ldi::graph_view& g, std::mt19937& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    ldi::chart_set result;
    result.chart_of.assign(g.size(), ldi::no_pixel);
    const std::size_t max_size = 1 + below(random() % 4 == 0 ? 3 : g.size() + 1);
    for (std::size_t seed = 0; seed < g.size(); ++seed) {
        if (result.chart_of[seed] != ldi::no_pixel) continue;
        const std::int32_t index = static_cast<std::int32_t>(result.charts.size());
        ldi::chart chart;
        std::set<std::pair<std::int32_t, std::int32_t>> taken;
        ldi::buffer<std::int32_t> front{static_cast<std::int32_t>(seed)}, pixels;
        while (!front.empty() && pixels.size() < max_size) {
            std::swap(front[below(front.size())], front.back());
            const std::int32_t pixel = front.back();
            front.pop_back();
            const std::size_t i = static_cast<std::size_t>(pixel);
            if (result.chart_of[i] != ldi::no_pixel || !taken.insert({g.x()[i], g.y()[i]}).second) continue;
            result.chart_of[i] = index;
            pixels.push_back(pixel);
            for (ldi::side s : ldi::all_sides)
                if (g.neighbor(pixel, s) != ldi::no_pixel) front.push_back(g.neighbor(pixel, s));
        }
        std::sort(pixels.begin(), pixels.end());
        for (const std::int32_t pixel : pixels) chart.pixels.push_back(pixel);
        std::int32_t right = 0, bottom = 0;
        chart.x = g.width(), chart.y = g.height();
        for (std::int32_t pixel : chart.pixels) {
            const std::size_t i = static_cast<std::size_t>(pixel);
            chart.x = std::min<std::int32_t>(chart.x, g.x()[i]), right = std::max(right, g.x()[i] + 1);
            chart.y = std::min<std::int32_t>(chart.y, g.y()[i]), bottom = std::max(bottom, g.y()[i] + 1);
        }
        chart.width = right - chart.x, chart.height = bottom - chart.y;
        result.charts.push_back(std::move(chart));
    }
    return result;
}

/// Smooth disparity, or noise.
inline ldi::buffer<float> random_disparity(const ldi::graph_view& g, std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
    const float noise = random() % 3 == 0 ? 1.0F : random() % 2 == 0 ? 0.0F : 0.02F;
    const float a = uniform(random) * 0.05F, b = uniform(random) * 0.05F, c = uniform(random);
    ldi::buffer<float> disparity;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const float x = static_cast<float>(g.x()[i]), y = static_cast<float>(g.y()[i]);
        disparity.push_back(std::clamp(c * 0.5F + a * x + b * y + noise * (uniform(random) - 0.5F), 0.0F, 1.0F));
    }
    return disparity;
}

inline charted_graph random_charts(std::uint32_t seed, std::int32_t max_side) {
    std::mt19937 random(seed);
    charted_graph result;
    result.topology = random_linked_layers(random, max_side);
    REQUIRE_FALSE(ldi::validate_canonical(result.topology));
    result.charts = random_partition(result.topology, random);
    result.disparity = random_disparity(result.topology, random);
    return result;
}

}  // namespace ldi::testing
