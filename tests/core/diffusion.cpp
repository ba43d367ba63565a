// Diffusion fills unknown cells with the smoothest interpolation of known values.
#include <ldi/core/diffusion.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

using namespace ldi;

namespace {

/// A row of unknown cells between two known values.
diffusion<1> row_between(std::int32_t cells, float left, float right) {
    diffusion<1> d;
    for (std::int32_t x = 0; x < cells; ++x) {
        const std::int32_t cell = d.add_cell(x, 0);
        if (x > 0) d.link_left(cell, cell - 1);
    }
    d.add_known_neighbor(1, &left), d.add_known_neighbor(cells, &right);
    return d;
}

}  // namespace

TEST_CASE("between two known values, diffusion converges to a linear ramp") {
    for (const std::int32_t cells : {1, 2, 9, 100}) {
        diffusion<1> d = row_between(cells, 0.0F, 100.0F);
        d.solve(20000);
        for (std::int32_t i = 1; i <= cells; ++i) {
            CAPTURE(cells, i);
            CHECK(d.value(i)[0] == Approx(100.0 * i / (cells + 1)).margin(0.1));
        }
    }
}

// If known neighbors had weight 1 on coarser levels, the error would be 4 percent. If all rounds visited the cells in
// the same order, the two halves would differ by 1 percent.
TEST_CASE("four rounds fill a straight gap with a ramp that is within 1 percent of the line, and symmetric within 0.6 percent") {
    for (const std::int32_t width : {4, 8, 16, 32}) {
        diffusion<1> d;
        const float low = 0.0F, high = 100.0F;
        for (std::int32_t i = 0; i < width * width; ++i) {
            const std::int32_t x = i % width, cell = d.add_cell(x, i / width);
            if (x > 0) d.link_left(cell, cell - 1);
            if (i >= width) d.link_up(cell, cell - width);
            if (x == 0) d.add_known_neighbor(cell, &low);
            if (x == width - 1) d.add_known_neighbor(cell, &high);
        }
        d.solve(4);
        for (std::int32_t i = 0; i < width * width; ++i) {
            const std::int32_t x = i % width, mirrored = i - x + width - 1 - x;
            CAPTURE(width, x, i / width);
            CHECK(d.value(1 + i)[0] == Approx(100.0 * (x + 1) / (width + 1)).margin(1.0));
            CHECK(d.value(1 + i)[0] + d.value(1 + mirrored)[0] == Approx(100.0).margin(0.6));
        }
    }
}

TEST_CASE("a second call of solve() changes nothing unless a known neighbor was added") {
    diffusion<1> d = row_between(9, 0.0F, 100.0F);
    const auto values = [&] {
        std::vector<float> result;
        for (std::int32_t i = 1; i <= 9; ++i) result.push_back(d.value(i)[0]);
        return result;
    };
    d.solve(20);
    const std::vector<float> once = values();
    d.solve(20);
    CHECK(values() == once);
    const float high = 1000.0F;
    d.add_known_neighbor(5, &high);
    d.solve(20);
    CHECK(d.value(5)[0] > 300.0F);
}

TEST_CASE("a cell without links and known neighbors gets the mean of all known values") {
    diffusion<1> d = row_between(4, 20.0F, 40.0F);
    const std::int32_t alone = d.add_cell(9, 9);
    for (int time = 0; time < 3; ++time) {
        d.solve(4);
        CHECK(d.value(alone)[0] == Approx(30.0));
    }
    diffusion<1> nothing;
    nothing.add_cell(0, 0);
    nothing.solve(4);
    CHECK(nothing.value(1)[0] == 0.0F);
}

TEST_CASE("on random graphs, diffused values stay within the range of the known ones") {
    testing::for_random_graphs(50, 400, [](const testing::random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        diffusion<1> d;
        for (int round = 0; round < 2; ++round) {
            d.start();
            float least = 1e9F, most = -1e9F;
            const std::vector<std::int32_t> order = [&] {
                const buffer<std::int32_t> canonical = canonical_order(g, layers.disparity);
                return std::vector<std::int32_t>(canonical.begin(), canonical.end());
            }();
            std::vector<std::int32_t> cell_of(g.size());
            for (const std::int32_t i : order) cell_of[static_cast<std::size_t>(i)] = d.add_cell(g.x()[i], g.y()[i]);
            for (const std::int32_t i : order) {
                const std::int32_t cell = cell_of[static_cast<std::size_t>(i)];
                if (const std::int32_t left = g.left()[i]; left != no_pixel)
                    d.link_left(cell, cell_of[static_cast<std::size_t>(left)]);
                if (const std::int32_t up = g.up()[i]; up != no_pixel) d.link_up(cell, cell_of[static_cast<std::size_t>(up)]);
                if (!testing::chance(random, 10)) continue;
                const float value = static_cast<float>(testing::below(random, 256));
                d.add_known_neighbor(cell, &value);
                least = (std::min)(least, value), most = (std::max)(most, value);
            }
            if (least > most) continue;
            d.solve(3);
            for (const std::int32_t cell : cell_of) {
                REQUIRE(d.value(cell)[0] >= least - 0.01F);
                REQUIRE(d.value(cell)[0] <= most + 0.01F);
            }
        }
    });
}
