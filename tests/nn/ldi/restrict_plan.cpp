#include <ldi/core/coarsening.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include "tests/nn/ldi/plan_windows.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

using namespace ldi;
using ldi::testing::raised;
using ldi::testing::random_layers;
using ldi::testing::windows_of;

namespace {
using indices = buffer<std::int32_t>;

indices subset_of_random_size(std::mt19937& random, std::size_t count) {
    indices subset;
    const std::int32_t percent = testing::below(random, 101);
    bool chosen = false;
    for (std::size_t i = 0; i < count; ++i) {
        if (testing::chance(random, 30)) chosen = testing::chance(random, percent);
        if (chosen) subset.push_back(static_cast<std::int32_t>(i));
    }
    return subset;
}
}  // namespace

TEST_CASE("restrict_to() refuses outputs that are not ascending or not in the plan") {
    const graph g = make_grid(20, 20);
    const convolution_plan plan = plan_convolution(g, 3);
    const auto result_of = [&](const convolution_plan& p, const indices& outputs) {
        CHECK(raised([&] { restrict_to(p, outputs); }) == raised([&] { restrict_and_renumber(p, outputs); }));
        return raised([&] { restrict_to(p, outputs); });
    };
    CHECK_FALSE(result_of(plan, {}));
    CHECK_FALSE(result_of(plan, {0, 19, 50, 51, 399}));
    for (const indices& outputs : {indices{400},
                                   {-1},
                                   {0, 0},
                                   {1, 0},
                                   {399, 398},
                                   {50, 50},
                                   {51, 50},
                                   {100, 50},
                                   {50, 1000},
                                   {INT32_MAX},
                                   {INT32_MAX, INT32_MIN}}) {
        CAPTURE(outputs);
        CHECK(result_of(plan, outputs) == error_code::mismatch);
    }
    const convolution_plan part = restrict_to(plan, indices{0, 50, 51, 399});
    CHECK(result_of(part, {52}) == error_code::mismatch);
    CHECK(raised([&] { restrict_to(part, pixel_subset::marked(buffer<std::uint8_t>(400, std::uint8_t{1}))); }) ==
          error_code::mismatch);
    for (const std::size_t count : {0U, 399U, 401U})
        CHECK(raised([&] { restrict_to(plan, pixel_subset::marked(buffer<std::uint8_t>(count))); }) == error_code::mismatch);
}

TEST_CASE(
    "a restricted plan contains exactly the windows of its outputs, and needed_inputs() returns the pixels of these windows") {
    testing::for_random_graphs(32, 1500, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const std::int32_t kernel_size = 1 + 2 * testing::below(random, 4);
        const convolution_plan plan = testing::chance(random, 50)
                                          ? plan_convolution(g, kernel_size)
                                          : plan_convolution(g, kernel_size, coarsen(g, orphan_rule::adopt_nearest).map);
        const indices subset = subset_of_random_size(random, plan.output_count());
        const convolution_plan restricted = restrict_to(plan, subset);
        const std::vector<indices> all = windows_of(plan), some = windows_of(restricted);
        std::vector<indices> expected(all.size());
        std::vector<bool> is_needed(g.size());
        for (const std::int32_t o : subset) {
            expected[static_cast<std::size_t>(o)] = all[static_cast<std::size_t>(o)];
            for (const std::int32_t i : all[static_cast<std::size_t>(o)])
                if (i != no_pixel) is_needed[static_cast<std::size_t>(i)] = true;
        }
        REQUIRE(some == expected);
        buffer<std::uint8_t> marks(plan.output_count());
        for (const std::int32_t o : subset) marks[o] = 1;
        REQUIRE(windows_of(restrict_to(plan, pixel_subset::marked(marks))) == expected);
        indices needed;
        for (std::size_t i = 0; i < g.size(); ++i)
            if (is_needed[i]) needed.push_back(static_cast<std::int32_t>(i));
        REQUIRE(needed_inputs(restricted) == needed);
    });
}

TEST_CASE("a restricted plan counts as full only if its outputs are renumbered") {
    const convolution_plan plan = plan_convolution(make_grid(8, 8), 3);
    const indices some{0, 1, 9, 10, 11, 12, 13};
    CHECK_FALSE(restrict_to(plan, some).is_full());
    CHECK(restrict_and_renumber(plan, some).is_full());
}
