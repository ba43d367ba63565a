#include <ldi/nn/ldi/convolution_planner.hpp>

#include "tests/core/broken_view.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace ldi;

namespace {
bool are_equal(const convolution_plan& a, const convolution_plan& b) {
    const auto equal = [](const auto& x, const auto& y) { return std::equal(x.begin(), x.end(), y.begin(), y.end()); };
    bool same = a.kernel_size() == b.kernel_size() && a.stride() == b.stride() && a.segments().size() == b.segments().size() &&
                equal(a.irregular(), b.irregular()) && equal(a.windows(), b.windows());
    for (std::size_t s = 0; same && s < a.segments().size(); ++s)
        same = a.segments()[s].first == b.segments()[s].first && a.segments()[s].count == b.segments()[s].count &&
               equal(a.rows_of(s), b.rows_of(s));
    return same;
}
}  // namespace

static_assert(!std::is_constructible_v<convolution_planner, graph>, "the planner would outlive the graph");

TEST_CASE("a planner refuses an invalid view") {
    testing::for_broken_views([](const graph_view& view) {
        CHECK(testing::raised([&] { convolution_planner planner(view); }) == error_code::mismatch);
    });
}

TEST_CASE("a planner makes the same plans as plan_convolution()") {
    testing::for_random_graphs(3, 30, [](const testing::random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const coarsened half = coarsen(g);
        convolution_planner planner(g);
        for (const std::int32_t kernel_size : {3, 3, 7, 1, 5}) {
            CHECK(are_equal(planner.plan(kernel_size), plan_convolution(g, kernel_size)));
            CHECK(are_equal(planner.plan(kernel_size, half.map), plan_convolution(g, kernel_size, half.map)));
        }
    });
}

TEST_CASE("a planner refuses an even kernel size") {
    const graph g = make_grid(20, 20);
    CHECK(testing::raised([&] { convolution_planner(g).plan(4); }) == error_code::invalid_option);
}
