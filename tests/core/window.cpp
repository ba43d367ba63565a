#include <ldi/core/window.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <tuple>

using namespace ldi;
using ldi::testing::random_layers;

TEST_CASE("gather_window() refuses kernel sizes that are even or out of range") {
    const graph g = make_grid(40, 40);
    for (const std::int32_t kernel_size : {-1, 0, 2, 16, 17, 31}) {
        buffer<std::int32_t> result(1024, 0);
        CHECK(testing::raised([&] { gather_window(g, 820, kernel_size, result); }) == error_code::invalid_option);
    }
}

namespace {
using window = buffer<std::int32_t>;
constexpr std::int32_t none = no_pixel;

window window_of(const graph_view& g, std::int32_t pixel, std::int32_t kernel_size) {
    window result(static_cast<std::size_t>(kernel_size * kernel_size), 12345);
    gather_window(g, pixel, kernel_size, result);
    return result;
}

/// Computes the window by another method, in rounds. In each round, elements of the previous round claim the free elements
/// beside them. If several claim one element, the element that was itself claimed first wins. Claims by one element are ordered
/// by side.
window window_by_rounds(const graph_view& g, std::int32_t pixel, std::int32_t kernel_size) {
    struct claim {
        std::int32_t element, pixel, rank;
    };
    window result(static_cast<std::size_t>(kernel_size * kernel_size), none);
    std::vector<claim> last_round{{kernel_size * kernel_size / 2, pixel, 0}};
    std::int32_t rank = 0;
    while (!last_round.empty()) {
        for (const claim& c : last_round) result[static_cast<std::size_t>(c.element)] = c.pixel;
        std::vector<std::tuple<std::int32_t, int, std::int32_t, std::int32_t>> wins;  // rank, side, element, pixel
        for (std::int32_t element = 0; element < kernel_size * kernel_size; ++element) {
            if (result[static_cast<std::size_t>(element)] != none) continue;
            std::tuple<std::int32_t, int, std::int32_t, std::int32_t> best{1 << 30, 0, 0, 0};
            for (const claim& c : last_round)
                for (int s = 0; s < 4; ++s) {
                    const side to = all_sides[s];
                    const std::int32_t column = c.element % kernel_size + step_x(to), row = c.element / kernel_size + step_y(to);
                    const std::int32_t found = g.neighbor(c.pixel, to);
                    if (column == element % kernel_size && row == element / kernel_size && found != none)
                        best = std::min(best, {c.rank, s, element, found});
                }
            if (std::get<0>(best) != 1 << 30) wins.push_back(best);
        }
        std::sort(wins.begin(), wins.end());
        last_round.clear();
        for (const auto& win : wins) last_round.push_back({std::get<2>(win), std::get<3>(win), ++rank});
    }
    return result;
}
}  // namespace

TEST_CASE("a pixel's window in an image is the square around this pixel, and is empty beyond the border") {
    const graph g = make_grid(5, 4);
    CHECK(window_of(g, 7, 1) == window{7});
    CHECK(window_of(g, 7, 3) == window{1, 2, 3, 6, 7, 8, 11, 12, 13});
    CHECK(window_of(g, 0, 3) == window{none, none, none, none, 0, 1, none, 5, 6});
    CHECK(window_of(g, 19, 3) == window{13, 14, none, 18, 19, none, none, none, none});
    for (const std::int32_t kernel_size : {1, 3, 5, 7, 9, 11, 13, 15})
        for (std::int32_t i = 0; i < 20; ++i) {
            window expected;
            for (std::int32_t row = 0; row < kernel_size; ++row)
                for (std::int32_t column = 0; column < kernel_size; ++column) {
                    const std::int32_t x = i % 5 + column - kernel_size / 2, y = i / 5 + row - kernel_size / 2;
                    expected.push_back(x >= 0 && x < 5 && y >= 0 && y < 4 ? y * 5 + x : none);
                }
            CHECK(window_of(g, i, kernel_size) == expected);
        }
}

TEST_CASE("exploration goes around a silhouette, and leaves out unreachable pixels (the paper's 5 x 5 example)") {
    // A wall to the right of the center's column, in all rows but the last. The two pixels in the top right corner are
    // unreachable.
    //
    //      0  1  2 | 3  4
    //               --- --
    //      5  6  7 | 8  9
    //     10 11 12 |13 14
    //     15 16 17 |18 19
    //     20 21 22  23 24
    testing::sketched_graph g(make_grid(5, 5));
    for (const std::int32_t i : {2, 7, 12, 17}) g.unlink(i, side::right);
    for (const std::int32_t i : {3, 4}) g.unlink(i, side::down);
    CHECK(window_of(g, 12, 5) ==
          window{0, 1, 2, none, none, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24});
    // The path around the wall leads through the bottom row, which is outside a 3 x 3 kernel.
    CHECK(window_of(g, 12, 3) == window{6, 7, none, 11, 12, none, 16, 17, none});
}

TEST_CASE("exploration prefers a path that starts up or down to an equally long path that starts left or right") {
    // Each diagonal neighbor of the center has two layers: one is linked to the pixel above or below the center, the other to the
    // pixel left or right of it.
    testing::sketched_graph g(3, 3);
    const std::int32_t center = g.add_pixel(1, 1);
    const std::int32_t up = g.add_pixel(1, 0), down = g.add_pixel(1, 2), left = g.add_pixel(0, 1), right = g.add_pixel(2, 1);
    const std::int32_t up_left = g.add_pixel(0, 0), up_right = g.add_pixel(2, 0);
    const std::int32_t down_left = g.add_pixel(0, 2), down_right = g.add_pixel(2, 2);
    const std::int32_t left_up = g.add_pixel(0, 0), left_down = g.add_pixel(0, 2);
    const std::int32_t right_up = g.add_pixel(2, 0), right_down = g.add_pixel(2, 2);
    g.link(center, side::up, up), g.link(center, side::down, down), g.link(center, side::left, left);
    g.link(center, side::right, right);
    g.link(up, side::left, up_left), g.link(up, side::right, up_right);
    g.link(down, side::left, down_left), g.link(down, side::right, down_right);
    g.link(left, side::up, left_up), g.link(left, side::down, left_down);
    g.link(right, side::up, right_up), g.link(right, side::down, right_down);
    CHECK(window_of(g, center, 3) == window{up_left, up, up_right, left, center, right, down_left, down, down_right});

    g.unlink(up, side::left), g.unlink(down, side::right);
    CHECK(window_of(g, center, 3) == window{left_up, up, up_right, left, center, right, down_left, down, right_down});

    SECTION("window membership is not symmetric") {
        g.link(up, side::left, up_left);
        const window of_center = window_of(g, center, 3), of_left_up = window_of(g, left_up, 3);
        CHECK(std::find(of_center.begin(), of_center.end(), left_up) == of_center.end());
        CHECK(std::find(of_left_up.begin(), of_left_up.end(), center) != of_left_up.end());
    }
}

TEST_CASE("a shorter path wins over a longer one that starts in an earlier direction") {
    // Two layers at (2, 1). The path to the first has two steps: right, up. The path to the second has four: up, up, right, down.
    testing::sketched_graph g(3, 4);
    const std::int32_t center = g.add_pixel(1, 2), right = g.add_pixel(2, 2), short_way = g.add_pixel(2, 1);
    const std::int32_t up = g.add_pixel(1, 1), up_up = g.add_pixel(1, 0), over = g.add_pixel(2, 0), long_way = g.add_pixel(2, 1);
    g.link(center, side::right, right), g.link(right, side::up, short_way);
    g.link(center, side::up, up), g.link(up, side::up, up_up), g.link(up_up, side::right, over),
        g.link(over, side::down, long_way);
    const window full = window_of(g, center, 5);
    CHECK(full[1 * 5 + 3] == short_way);
    CHECK(full[0 * 5 + 3] == over);
    g.unlink(right, side::up);
    CHECK(window_of(g, center, 5)[1 * 5 + 3] == long_way);
    CHECK(window_of(g, center, 3) == window{none, up, none, none, center, right, none, none, none});
}

TEST_CASE("a window around the axis of a helix stays on one turn until another turn is nearer") {
    // A spiral staircase around the corner that four lattice positions share. A turn has one pixel per position:
    //
    //     a   b      a - c, c - d and d - b are linked. The right neighbor of a is the b of the next turn.
    //     |   |
    //     c - d
    testing::sketched_graph g(2, 2);
    buffer<std::int32_t> a, b, c, d;  // top left, top right, bottom left, bottom right
    for (std::size_t turn = 0; turn < 3; ++turn) {
        a.push_back(g.add_pixel(0, 0)), b.push_back(g.add_pixel(1, 0));
        c.push_back(g.add_pixel(0, 1)), d.push_back(g.add_pixel(1, 1));
        g.link(a[turn], side::down, c[turn]);
        g.link(c[turn], side::right, d[turn]);
        g.link(d[turn], side::up, b[turn]);
        if (turn > 0) g.link(a[turn - 1], side::right, b[turn]);
    }
    CHECK(window_of(g, a[1], 3) == window{none, none, none, none, a[1], b[2], none, c[1], d[1]});
    CHECK(window_of(g, b[1], 3) == window{none, none, none, a[0], b[1], none, c[1], d[1], none});
    CHECK(window_of(g, d[1], 3) == window{a[0], b[1], none, c[1], d[1], none, none, none, none});
    CHECK(window_of(g, c[1], 3) == window{none, a[1], b[2], none, c[1], d[1], none, none, none});
    CHECK(window_of(g, a[2], 3) == window{none, none, none, none, a[2], b[2], none, c[2], d[2]});
}

TEST_CASE("on random graphs, gather_window() matches an exploration that advances by one link per round") {
    const std::int32_t sizes[] = {1, 3, 5, 7, 9, 15};
    testing::for_random_graphs(20, 2500, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        for (int repeat = 0; repeat < 6 && g.size() > 0; ++repeat) {
            const std::int32_t pixel = testing::below(random, static_cast<std::int32_t>(g.size()));
            const std::int32_t kernel_size = sizes[repeat];
            REQUIRE(window_of(g, pixel, kernel_size) == window_by_rounds(g, pixel, kernel_size));
        }
    });
}

TEST_CASE(
    "every pixel of a window lies at its element's offset and, except for the center, is linked to another pixel of the window") {
    testing::for_random_graphs(21, 500, [](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        for (std::int32_t pixel = 0; pixel < static_cast<std::int32_t>(g.size()); ++pixel) {
            const std::int32_t kernel_size = 1 + 2 * testing::below(random, 4), center = kernel_size / 2;
            const window found = window_of(g, pixel, kernel_size);
            REQUIRE(found[found.size() / 2] == pixel);
            for (std::int32_t element = 0; element < static_cast<std::int32_t>(found.size()); ++element) {
                const std::int32_t there = found[static_cast<std::size_t>(element)];
                if (there == none) continue;
                const std::size_t i = static_cast<std::size_t>(pixel), j = static_cast<std::size_t>(there);
                REQUIRE(g.x()[j] - g.x()[i] == element % kernel_size - center);
                REQUIRE(g.y()[j] - g.y()[i] == element / kernel_size - center);
                bool joined = there == pixel;
                for (const side s : all_sides)
                    joined = joined || (g.neighbor(there, s) != none &&
                                        std::find(found.begin(), found.end(), g.neighbor(there, s)) != found.end());
                REQUIRE(joined);
            }
        }
    });
}

TEST_CASE("a window does not depend on the order of the pixels in memory") {
    testing::for_random_graphs(22, 500, [](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const buffer<std::int32_t> order = testing::random_permutation(random, g.size());
        const graph moved = ldi::reordered(g, order);
        for (std::int32_t repeat = 0; repeat < 10 && g.size() > 0; ++repeat) {
            const std::int32_t pixel = testing::below(random, static_cast<std::int32_t>(g.size()));
            window there = window_of(moved, pixel, 5);
            for (std::int32_t& i : there) i = i == none ? none : order[static_cast<std::size_t>(i)];
            REQUIRE(there == window_of(g, order[static_cast<std::size_t>(pixel)], 5));
        }
    });
}
