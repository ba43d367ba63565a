#include <ldi/nn/ldi/convolution_plan.hpp>

#include "tests/core/broken_view.hpp"
#include "tests/nn/ldi/plan_windows.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

using namespace ldi;
using ldi::testing::raised;
using ldi::testing::random_layers;
using ldi::testing::windows_of;

namespace {
using indices = buffer<std::int32_t>;

indices explored(const graph_view& g, std::int32_t pixel, std::int32_t kernel_size) {
    indices window(static_cast<std::size_t>(kernel_size * kernel_size));
    gather_window(g, pixel, kernel_size, window);
    return window;
}

}  // namespace

TEST_CASE("a plan contains the same windows as gather_window(), for any graph, pixel, kernel size and stride") {
    std::size_t in_segments = 0;
    testing::for_random_graphs(30, 3000, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const std::int32_t kernel_size = 1 + 2 * testing::below(random, 4);
        const convolution_plan plan = plan_convolution(g, kernel_size);
        std::vector<indices> windows = windows_of(plan);
        REQUIRE(windows.size() == g.size());
        bool same = true;
        for (std::size_t i = 0; i < g.size(); ++i)
            same = same && windows[i] == explored(g, static_cast<std::int32_t>(i), kernel_size);
        REQUIRE(same);
        in_segments += g.size() - plan.irregular().size();

        const coarsened coarse = coarsen(g, orphan_rule::adopt_nearest);
        windows = windows_of(plan_convolution(g, kernel_size, coarse.map));
        REQUIRE(windows.size() == coarse.map.kept().size());
        for (std::size_t o = 0; o < coarse.map.kept().size(); ++o)
            same = same && windows[o] == explored(g, coarse.map.kept()[o], kernel_size);
        REQUIRE(same);
    });
    CHECK(in_segments > 10000);
}

TEST_CASE("a plan contains the right windows for large kernels and for graphs wider than 64 pixels") {
    std::mt19937 random(31);
    for (int round = 0; round < 40; ++round) {
        const graph g = testing::random_graph(random, 150).topology();
        const std::int32_t kernel_size = 1 + 2 * testing::below(random, 8);
        const std::vector<indices> windows = windows_of(plan_convolution(g, kernel_size));
        bool same = true;
        for (std::size_t i = 0; i < g.size(); i += 7)
            same = same && windows[i] == explored(g, static_cast<std::int32_t>(i), kernel_size);
        REQUIRE(same);
    }
}

TEST_CASE("kernel sizes other than 1, 3, ..., 15 are refused") {
    const graph g = make_grid(20, 20);
    const coarsened coarse = coarsen(g);
    for (const std::int32_t kernel_size : {std::numeric_limits<std::int32_t>::min(), -3, 0, 2, 14, 16, 17}) {
        CAPTURE(kernel_size);
        CHECK(raised([&] { plan_convolution(g, kernel_size); }) == error_code::invalid_option);
        CHECK(raised([&] { plan_convolution(g, kernel_size, coarse.map); }) == error_code::invalid_option);
    }
    CHECK_FALSE(raised([&] { plan_convolution(g, 15, coarse.map); }));
}

TEST_CASE("a plan with stride 2 refuses the map of another graph") {
    const graph g = make_grid(20, 20);
    const auto result_of = [&](const coarsened& coarse) { return raised([&] { plan_convolution(g, 3, coarse.map); }); };
    for (const auto& [width, height] : {std::pair{20, 18}, {18, 20}, {40, 40}, {2, 2}, {400, 1}, {1, 400}, {40, 10}}) {
        CAPTURE(width, height);
        const graph other = make_grid(width, height);
        CHECK(result_of(coarsen(other)) == error_code::mismatch);
    }
    CHECK(result_of({}) == error_code::mismatch);
    layered_image<> reversed(make_grid(20, 20));
    buffer<std::int32_t> order(g.size());
    for (std::int32_t i = 0; i < order.count(); ++i) order[i] = order.count() - 1 - i;
    reversed.reorder(order);
    CHECK(result_of(coarsen(reversed.topology())) == error_code::mismatch);
    CHECK_FALSE(result_of(coarsen(g)));
}

template <class Plan>
constexpr bool can_change_plan = requires(Plan p) {
    p.segments()[0] = {};
}
|| requires(Plan p) { p.irregular()[0] = 0; }
|| requires(Plan p) { p.windows()[0] = 0; }
|| requires(Plan p) { p.rows_of(0)[0] = 0; };
template <class Plan>
constexpr bool plan_shows_temporary_values = requires {
    Plan().segments();
}
|| requires { Plan().irregular(); }
|| requires { Plan().windows(); }
|| requires { Plan().rows_of(0); }
|| requires { Plan().window_of(0); };
template <class Plan>
constexpr bool is_made_by_braces = requires {
    Plan({3, 1, 9, 9, {}, {}, {}, {}});
};
static_assert(!is_made_by_braces<convolution_plan> && !std::is_constructible_v<convolution_plan, detail::plan_parts>);
static_assert(!can_change_plan<convolution_plan> && !plan_shows_temporary_values<convolution_plan>);

TEST_CASE("on a grid, all pixels except those near the border are regular, in one segment per row") {
    const graph g = make_grid(200, 50);
    for (const std::int32_t kernel_size : {3, 5, 7}) {
        const convolution_plan plan = plan_convolution(g, kernel_size);
        const std::size_t rows = static_cast<std::size_t>(50 - (kernel_size - 1));
        CHECK(plan.segments().size() == rows);
        CHECK(plan.irregular().size() == 200 * 50 - rows * static_cast<std::size_t>(200 - (kernel_size - 1)));
        const convolution_plan halved = plan_convolution(g, kernel_size, coarsen(g, orphan_rule::adopt_nearest).map);
        CHECK(halved.output_count() == 100 * 25);
        CHECK(halved.segments().size() == rows / 2);
    }
}

TEST_CASE("a pixel stays regular without links that the exploration of its window does not use") {
    // The spine of a pixel is the window column that contains the pixel, and its ribs are the rows. In this grid of 7 x 7 pixels,
    // the center's spine is column 3.
    testing::sketched_graph g(make_grid(7, 7));
    const auto is_regular = [&] { return detail::regular_pixels(g, 7).contains(24); };
    CHECK(is_regular());
    for (std::int32_t i = 0; i < 49; ++i)
        if (i % 7 != 3) g.unlink(i, side::up);
    CHECK(is_regular());
    const graph grid = make_grid(7, 7);
    CHECK(explored(g, 24, 7) == explored(grid, 24, 7));
    g.unlink(5, side::left);
    CHECK_FALSE(is_regular());
}

TEST_CASE("plan_convolution() refuses an invalid view") {
    const level_map map = coarsen(make_grid(8, 8)).map;
    testing::for_broken_views([&](const graph_view& view) {
        CHECK_THAT(testing::message_of([&] { plan_convolution(view, 3); }), Catch::StartsWith("plan_convolution: "));
        CHECK_THAT(testing::message_of([&] { plan_convolution(view, 3, map); }), Catch::StartsWith("plan_convolution: "));
    });
}

TEST_CASE("a moved-from plan is empty") {
    convolution_plan plan = plan_convolution(make_grid(8, 8), 3);
    CHECK(plan.is_full());
    convolution_plan other = std::move(plan), assigned;
    const auto is_empty = [](const convolution_plan& p) {
        return p.kernel_size() == 1 && p.input_count() == 0 && p.output_count() == 0 && p.segments().empty() &&
               p.windows().empty();
    };
    CHECK((is_empty(plan) && other.output_count() == 64));  // NOLINT(bugprone-use-after-move)
    assigned = std::move(other);
    CHECK((is_empty(other) && assigned.output_count() == 64 && assigned.input_count() == 64));  // NOLINT(bugprone-use-after-move)
}
