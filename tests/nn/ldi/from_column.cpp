#include <ldi/nn/ldi/from_column.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace ldi;

TEST_CASE("a column that is converted to a feature map and back is unchanged") {
    testing::for_random_graphs(70, 100, [](const testing::random_layers& random_layers, std::mt19937& random) {
        photo_layers layers(random_layers.topology());
        layers.set_column<disparity_column>(random_layers.disparity);
        for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(random());
        const feature_map colors = from_column<color_column>(layers, 1.0F / 255.0F);
        const auto bytes = from_column<color_column, std::uint8_t>(layers);
        const feature_map disparity = from_column<disparity_column>(layers);
        REQUIRE((colors.channels == 3 && colors.pixels() == layers.size()));
        for (std::int32_t i = 0; i < layers.topology().count(); ++i) {
            for (std::size_t c = 0; c < 3; ++c) REQUIRE(colors.at(i)[c] * 255.0F == Approx(layers.at<color_column>(i)[c]));
            REQUIRE(disparity.at(i)[0] == random_layers.disparity[i]);
        }
        for (const bool in_bytes : {true, false}) {
            photo_layers other(random_layers.topology());
            if (in_bytes)
                to_column<color_column>(bytes, other);
            else
                to_column<color_column>(colors, other, 255.0F);
            to_column<disparity_column>(disparity, other);
            REQUIRE(other.column<color_column>() == layers.column<color_column>());
            REQUIRE(other.column<disparity_column>() == layers.column<disparity_column>());
        }
    });
}

TEST_CASE("a map whose number of values is not a multiple of its number of channels is refused") {
    layered_image<color_column> layers(make_grid(5, 1));
    basic_feature_map<std::uint8_t> map(5, 3);
    map.values.push_back(1);
    REQUIRE(map.pixels() == 5);
    CHECK_THROWS_AS(to_column<color_column>(map, layers), error);
}

TEST_CASE("to_column() scales bytes in the same way as floats") {
    layered_image<known_column> layers(make_grid(3, 1));
    basic_feature_map<std::uint8_t> map(3, 1);
    map.values = {0, 50, 200};
    to_column<known_column>(map, layers, 2.0F);
    CHECK(layers.column<known_column>() == buffer<std::uint8_t>{0, 100, 255});
}

TEST_CASE("values outside a column's range are clamped, and NaN becomes 0") {
    layered_image<known_column> layers(make_grid(5, 1));
    feature_map map(5, 1);
    map.values = {-7.0F, 254.6F, 1e30F, std::nanf(""), 0.4F};
    to_column<known_column>(map, layers);
    CHECK(layers.column<known_column>() == buffer<std::uint8_t>{0, 255, 255, 0, 0});
}

namespace {
template <class Scalar>
struct identifier {
    using scalar = Scalar;
    static constexpr std::size_t channels = 1;
};
/// Writes 1e20, -1e20, both infinities, 2^63, 3 and -1 to a column of `Scalar`.
template <class Scalar>
buffer<Scalar> clamped() {
    layered_image<identifier<Scalar>> layers(make_grid(7, 1));
    feature_map map(7, 1);
    map.values = {1e20F, -1e20F, HUGE_VALF, -HUGE_VALF, 0x1p63F, 3.0F, -1.0F};
    to_column<identifier<Scalar>>(map, layers);
    return layers.template column<identifier<Scalar>>().copy();
}
}  // namespace

TEST_CASE("values outside the range of 64-bit integers are clamped to the column's range") {
    constexpr std::int64_t lowest = std::numeric_limits<std::int64_t>::min(), highest = std::numeric_limits<std::int64_t>::max();
    CHECK(clamped<std::int64_t>() == buffer<std::int64_t>{highest, lowest, highest, lowest, highest, 3, -1});
    constexpr std::uint64_t all = std::numeric_limits<std::uint64_t>::max();
    CHECK(clamped<std::uint64_t>() == buffer<std::uint64_t>{all, 0, all, 0, std::uint64_t{1} << 63, 3, 0});
}

TEST_CASE("a bool column is true for values of at least one half") {
    layered_image<identifier<bool>> layers(make_grid(6, 1));
    feature_map map(6, 1);
    map.values = {0.0F, 0.3F, std::nanf(""), 0.5F, 1.0F, 7.0F};
    to_column<identifier<bool>>(map, layers);
    CHECK(layers.column<identifier<bool>>() == buffer<bool>{false, false, false, true, true, true});
    to_column<identifier<bool>>(from_column<identifier<bool>>(layers), layers);
    CHECK(layers.column<identifier<bool>>() == buffer<bool>{false, false, false, true, true, true});
}

TEST_CASE("to_column() refuses maps with a different number of pixels or channels") {
    layered_image<color_column> layers(make_grid(4, 4));
    CHECK_THROWS_AS(to_column<color_column>(feature_map(17, 3), layers), error);
    CHECK_THROWS_AS(to_column<color_column>(feature_map(16, 4), layers), error);
    CHECK_NOTHROW(to_column<color_column>(feature_map(16, 3), layers));
}
