#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_features.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <random>
#include <type_traits>
#include <utility>

using namespace ldi;

namespace {
using marks = buffer<std::uint8_t>;

marks random_marks(std::mt19937& random, std::size_t count, int percent) {
    marks result(count, 0);
    for (std::uint8_t& mark : result) mark = testing::chance(random, percent) ? 1 : 0;
    return result;
}

/// Marks all pixels that a plan reads.
marks read_by(const convolution_plan& plan) {
    marks result(plan.input_count(), 0);
    mark_needed_inputs(plan, result);
    return result;
}
}  // namespace

TEST_CASE("a subset lists its pixels in ascending order, and returns each pixel's index") {
    std::mt19937 random(1);
    for (int round = 0; round < 100; ++round) {
        const marks marked = random_marks(random, random() % 300, round % 3 == 0 ? 40 : round % 3 == 1 ? 97 : 2);
        const pixel_subset subset = pixel_subset::marked(marked);
        REQUIRE(subset.pixel_count() == marked.size());
        const buffer<std::int32_t> pixels = subset.pixels();
        std::int32_t rows = 0;
        for (std::int32_t pixel = 0; pixel < marked.count(); ++pixel) {
            REQUIRE(subset.row_of(pixel) == (marked[pixel] != 0 ? rows : no_pixel));
            if (marked[pixel] != 0) REQUIRE(pixels[rows++] == pixel);
        }
        REQUIRE(subset.size() == static_cast<std::size_t>(rows));
        REQUIRE(pixels.size() == subset.size());
    }
}

TEST_CASE("the runs of a subset cover its pixels in ascending order, and do not touch each other") {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        const std::size_t count = random() % 400;
        marks marked(count, static_cast<std::uint8_t>(random() % 2));
        for (int edit = testing::below(random, 6); edit > 0 && count > 0; --edit) {
            const std::size_t first = random() % count, last = first + random() % (count - first + 1);
            std::fill(marked.begin() + first, marked.begin() + last, static_cast<std::uint8_t>(random() % 3));
        }
        const pixel_subset subset = pixel_subset::marked(marked);
        buffer<std::int32_t> covered;
        std::int32_t end = -1;
        subset.for_each_run([&](std::int32_t first, std::int32_t length, std::int32_t row) {
            REQUIRE((first > end && length > 0));
            REQUIRE(row == covered.count());
            for (std::int32_t pixel = first; pixel < first + length; ++pixel) covered.push_back(pixel);
            end = first + length;
        });
        REQUIRE(covered == subset.pixels());
    }
}

TEST_CASE("on_subsets() lets a convolution read only the rows of a subset, with bit-identical results") {
    testing::for_random_graphs(2, 60, [](const testing::random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const auto weights = pack_convolution(best_isa(), testing::random_floats(random, 2 * 3 * 9),
                                              testing::random_floats(random, 2), 3, no_activation);
        const feature_map all = testing::random_features(random, g.size(), 3);
        const pixel_subset outputs = pixel_subset::marked(random_marks(random, g.size(), 50));
        const convolution_plan restricted = restrict_to(plan_convolution(g, 3), outputs);
        const pixel_subset inputs = pixel_subset::marked(read_by(restricted));

        const buffer<std::int32_t> read = inputs.pixels(), written = outputs.pixels();
        feature_map stored(inputs.size(), 3);
        for (std::size_t row = 0; row < inputs.size(); ++row) std::copy_n(all.at(read[row]).data(), 3, stored.at(row).data());
        feature_map expected(g.size(), 2), found(outputs.size(), 2);
        const feature_view from_all[] = {all}, from_stored[] = {stored};
        convolve(restricted, weights, from_all, expected.values);
        convolve(on_subsets(restricted, outputs, inputs), weights, from_stored, found.values);
        for (std::size_t row = 0; row < outputs.size(); ++row)
            for (std::size_t c = 0; c < 2; ++c) REQUIRE(found.at(row)[c] == expected.at(written[row])[c]);
    });
}

TEST_CASE("a plan refuses subsets of other graphs, and subsets without a pixel that it reads or writes") {
    const graph g = make_grid(6, 5);
    const convolution_plan plan = plan_convolution(g, 3);
    const pixel_subset all = pixel_subset::marked(marks(30, 1)), none = pixel_subset::marked(marks(30, 0)),
                       other = pixel_subset::marked(marks(29, 1));
    CHECK_FALSE(testing::raised([&] { on_subsets(plan, all, all); }));
    for (const pixel_subset* const wrong : {&none, &other}) {
        CHECK(testing::raised([&] { renumber_inputs(plan, *wrong); }) == error_code::mismatch);
        CHECK(testing::raised([&] { on_subsets(plan, *wrong, all); }) == error_code::mismatch);
        CHECK(testing::raised([&] { on_subsets(plan, all, *wrong); }) == error_code::mismatch);
    }
    for (std::int32_t pixel = 0; pixel < 30; ++pixel) {
        marks most(30, 1);
        most[pixel] = 0;
        CHECK(testing::raised([&] { renumber_inputs(plan, pixel_subset::marked(most)); }) == error_code::mismatch);
    }
}

static_assert(!std::is_aggregate_v<pixel_subset>);
TEST_CASE("a moved-from subset is empty") {
    pixel_subset subset = pixel_subset::marked(marks{1, 0, 1});
    const pixel_subset other = std::move(subset);
    CHECK((other.size() == 2 && other.pixel_count() == 3));
    CHECK((subset.size() == 0 && subset.pixel_count() == 0));  // NOLINT(bugprone-use-after-move)
}

TEST_CASE("if memory runs out during an assignment, the subset stays unchanged") {
    testing::counted_memory memory;
    const memory_scope scope(memory.source);
    pixel_subset assigned = pixel_subset::marked(marks(10, std::uint8_t{1}));
    const pixel_subset large = pixel_subset::marked(marks(1000, std::uint8_t{1}));
    const std::size_t before = memory.calls;
    memory.calls = 0, memory.most = 0;
    CHECK_THROWS_AS(assigned = large, std::bad_alloc);
    CHECK((assigned.size() == 10 && assigned.pixel_count() == 10));
    memory.calls = before, memory.most = static_cast<std::size_t>(-1);
    assigned = large;
    CHECK(assigned == large);
}
