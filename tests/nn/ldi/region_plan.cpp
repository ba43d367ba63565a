#include <ldi/nn/ldi/region_plan.hpp>

#include "tests/support/random_region.hpp"

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <limits>
#include <vector>

using namespace ldi;
using ldi::testing::number_in;
using ldi::testing::random_marks;
using ldi::testing::region_of;

namespace {

/// The windows of all outputs. Requires that each output is computed once and that segments are in ascending order.
std::vector<buffer<std::int32_t>> windows_in(const convolution_plan& plan) {
    std::vector<buffer<std::int32_t>> windows(plan.output_count());
    const auto add = [&](std::int32_t output, buffer<std::int32_t> window) {
        REQUIRE(windows.at(static_cast<std::size_t>(output)).empty());
        windows[static_cast<std::size_t>(output)] = std::move(window);
    };
    for (std::size_t s = 0; s < plan.segments().size(); ++s) {
        if (s > 0) REQUIRE(plan.segments()[s].first >= plan.segments()[s - 1].first + plan.segments()[s - 1].count);
        for (std::int32_t i = 0; i < plan.segments()[s].count; ++i) {
            buffer<std::int32_t> window;
            for (const std::int32_t row : plan.rows_of(s))
                for (std::int32_t x = 0; x < plan.kernel_size(); ++x)
                    window.push_back(row + plan.stride() * i + x - plan.kernel_size() / 2);
            add(plan.segments()[s].first + i, std::move(window));
        }
    }
    for (std::size_t i = 0; i < plan.irregular().size(); ++i) {
        if (i > 0) REQUIRE(plan.irregular()[i] > plan.irregular()[i - 1]);
        add(plan.irregular()[i], {plan.window_of(i).begin(), plan.window_of(i).end()});
    }
    return windows;
}

void check_windows(const convolution_plan& plan, const image<std::uint8_t>& marks, const pixel_region& outputs) {
    REQUIRE(plan.output_count() == outputs.size());
    const std::vector<buffer<std::int32_t>> windows = windows_in(plan);
    const std::int32_t radius = plan.kernel_size() / 2;
    for (std::int32_t y = 0; y < outputs.height(); ++y)
        for (const pixel_region::run& run : outputs.row(y))
            for (std::int32_t x = run.first; x < run.last; ++x) {
                buffer<std::int32_t> expected;
                for (std::int32_t v = -radius; v <= radius; ++v)
                    for (std::int32_t u = -radius; u <= radius; ++u)
                        expected.push_back(number_in(marks, plan.stride() * x + u, plan.stride() * y + v));
                CHECK(windows[static_cast<std::size_t>(run.pixel_at(x))] == expected);
            }
}

}  // namespace

TEST_CASE("a plan for a pixel region contains the windows of the lattice, without pixels outside the region") {
    std::size_t segments = 0, irregular = 0;
    for (const auto& [height, width] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 9}, {9, 1}, {12, 17}, {15, 30}})
        for (std::uint32_t seed = 0; seed < 12; ++seed)
            for (const std::int32_t kernel_size : {1, 3, 5}) {
                const image<std::uint8_t> marks = random_marks(height, width, seed);
                const pixel_region region = region_of(marks), half = halved(region);
                const convolution_plan same = plan_convolution(region, kernel_size);
                check_windows(same, marks, region);
                check_windows(plan_convolution(region, kernel_size, half), marks, half);
                segments += same.segments().size(), irregular += same.irregular().size();
            }
    CHECK(segments > 100);
    CHECK(irregular > 100);
}

TEST_CASE("a plan for a pixel region refuses kernel sizes other than 1, 3, ..., 15") {
    const pixel_region region = region_of(random_marks(12, 17, 1)), half = halved(region);
    for (const std::int32_t kernel_size : {-1, 0, 2, 16, 17}) {
        CAPTURE(kernel_size);
        CHECK_THROWS_AS(plan_convolution(region, kernel_size), error);
        CHECK_THROWS_AS(plan_convolution(region, kernel_size, half), error);
    }
    CHECK_NOTHROW(plan_convolution(region, 15));
}

TEST_CASE("a plan with stride 2 refuses any region but the halved one") {
    const pixel_region region = region_of(random_marks(12, 17, 1));
    for (const pixel_region& wrong : {region, halved(region_of(random_marks(12, 17, 2))), halved(halved(region)), pixel_region()})
        CHECK(testing::raised([&] { plan_convolution(region, 3, wrong); }) == error_code::mismatch);
}

TEST_CASE("a pixel region's lattice has at most 2^30 columns") {
    CHECK_NOTHROW(pixel_region_builder(1 << 30));
    for (const std::int32_t width : {(1 << 30) + 1, (std::numeric_limits<std::int32_t>::max)(), -1})
        CHECK(testing::raised([&] { pixel_region_builder{width}; }) == error_code::invalid_option);
}
