#include <ldi/core/coarsening.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_features.hpp"

#include <catch2/catch.hpp>

#include <utility>

using namespace ldi;

TEST_CASE("a feature map stores a row of channels per pixel and moves without a copy") {
    std::mt19937 random(1);
    feature_map a = testing::random_features(random, 7, 3);
    CHECK(a.pixels() == 7);
    CHECK(a.at(4).data() == a.values.data() + 12);
    CHECK(a.at(4).size() == 3);
    const float* const values = a.values.data();
    const feature_map b = std::move(a);
    CHECK(a.pixels() == 0);  // NOLINT(bugprone-use-after-move)
    CHECK(b.values.data() == values);
    CHECK(b.at(6).data() == values + 18);
    CHECK(feature_map().pixels() == 0);
}

TEST_CASE("a view of a feature map refers to the map's memory") {
    std::mt19937 random(2);
    const feature_map a = testing::random_features(random, 5, 2);
    const feature_view view = a;
    CHECK(view.values.data() == a.values.data());
    CHECK(view.pixels() == 5);
    CHECK(view.row_of(3) == 3);
    CHECK(view.row_of(no_pixel) == no_pixel);
}

TEST_CASE("an upsampled map has one pixel per pixel of the finer graph, and each pixel reads the row of its parent") {
    testing::for_random_graphs(3, 50, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half = coarsen(layers.topology());
        const feature_map coarse = testing::random_features(random, half.map.kept().size(), 2);
        const feature_view fine = upsample(coarse, half.map);
        CHECK(fine.pixels() == layers.topology().size());
        for (std::size_t i = 0; i < half.map.parent().size(); ++i)
            CHECK(fine.row_of(static_cast<std::int32_t>(i)) == half.map.parent()[i]);
    });
}

TEST_CASE("upsample() refuses the map of another level") {
    const coarsened half = coarsen(make_grid(8, 8)), quarter = coarsen(half.topology);
    const feature_map coarse(quarter.map.kept().size(), 1);
    CHECK(upsample(coarse, quarter.map).pixels() == 16);
    CHECK(testing::raised([&] { upsample(coarse, half.map); }) == error_code::mismatch);  // skips a level
    const level_map nothing;
    CHECK(testing::raised([&] { upsample(coarse, nothing); }) == error_code::mismatch);
}

TEST_CASE("upsample() refuses a parent that is not a row of the coarse map") {
    const feature_map coarse(4, 1);
    for (const std::int32_t parent : {4, 100000, -2}) {
        const buffer<std::int32_t> parents{0, 3, no_pixel, parent};
        CHECK(testing::raised([&] { upsample(coarse, parents); }) == error_code::mismatch);
    }
    const buffer<std::int32_t> parents{0, 3, no_pixel};
    CHECK(upsample(coarse, parents).row_of(1) == 3);
}

// Views of temporaries, which must not compile.
template <class Map>
constexpr bool shows_temporary_values = requires {
    Map(1, 1).at(0);
}
|| requires(const level_map& m) { upsample(Map(1, 1), m); }
|| requires(const Map& f) { upsample(f, coarsen(make_grid(2, 2)).map); };
static_assert(!shows_temporary_values<feature_map> && !shows_temporary_values<basic_feature_map<std::uint8_t>>);
