#include <ldi/core/layered_image.hpp>

#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <string>
#include <type_traits>

using namespace ldi;

namespace {
struct normal_column {
    using scalar = double;
    static constexpr std::size_t channels = 3;
};
struct name_column {  // a payload need not be a number
    using scalar = std::string;
    static constexpr std::size_t channels = 1;
};
struct other_disparity_column {  // columns of one scalar and size are told apart by their names
    using scalar = float;
    static constexpr std::size_t channels = 1;
};
struct no_channels {
    using scalar = float;
};
struct no_scalar {
    static constexpr std::size_t channels = 1;
};
using users_layers = layered_image<normal_column, disparity_column, name_column, other_disparity_column>;

static_assert(payload_column<color_column> && payload_column<normal_column> && payload_column<name_column>);
static_assert(no_scalar::channels == 1);  // used, so that no compiler warns
static_assert(!payload_column<no_channels> && !payload_column<no_scalar> && !payload_column<float>);
static_assert(std::is_default_constructible_v<users_layers> && std::is_copy_constructible_v<users_layers>);
static_assert(std::is_nothrow_move_constructible_v<users_layers> && std::is_move_assignable_v<users_layers>);
static_assert(!std::is_polymorphic_v<photo_layers>);
static_assert(!std::is_convertible_v<graph, photo_layers>, "a graph does not turn into a layered image unasked");
static_assert(std::is_same_v<decltype(std::declval<photo_layers&>().column<color_column>()), buffer<std::uint8_t>&>);
static_assert(std::is_same_v<decltype(std::declval<const photo_layers&>().column<disparity_column>()), const buffer<float>&>);
static_assert(std::is_same_v<decltype(std::declval<users_layers&>().at<normal_column>(0)), std::span<double, 3>>);
static_assert(std::is_same_v<decltype(std::declval<const users_layers&>().at<normal_column>(0)), std::span<const double, 3>>);
}  // namespace

TEST_CASE("columns are as long as the graph, and zero at first") {
    const users_layers layers(make_grid(4, 3));
    REQUIRE(layers.size() == 12);
    CHECK(layers.column<normal_column>() == buffer<double>(36, 0.0));
    CHECK(layers.column<disparity_column>() == buffer<float>(12, 0.0F));
    CHECK(layers.column<name_column>() == buffer<std::string>(12));
    CHECK(users_layers().size() == 0);
}

TEST_CASE("columns of one type are told apart by their names") {
    users_layers layers(make_grid(2, 1));
    layers.column<disparity_column>()[1] = 0.5F;
    CHECK(layers.column<other_disparity_column>()[1] == 0.0F);
}

TEST_CASE("a pixel's scalars lie side by side") {
    users_layers layers(make_grid(2, 2));
    layers.at<normal_column>(2)[1] = 7.0;
    CHECK(layers.column<normal_column>()[2 * 3 + 1] == 7.0);
    const users_layers& fixed = layers;
    CHECK(fixed.at<normal_column>(2).data() == fixed.column<normal_column>().data() + 6);
}

TEST_CASE("new pixels get rows of zeros, and the old rows stay") {
    users_layers layers(make_grid(2, 1));
    layers.at<normal_column>(1)[2] = 3.0;
    layers.topology.add_pixel(0, 0);
    layers.resize_columns(layers.topology.size());
    CHECK(layers.column<normal_column>() == buffer<double>{0, 0, 0, 0, 0, 3, 0, 0, 0});
    CHECK(layers.column<name_column>().size() == 3);
}

TEST_CASE("the user's payload travels with its pixel when the order changes") {
    testing::for_random_graphs(60, 300, [](const testing::random_layers& random_layers, std::mt19937& random) {
        users_layers layers(random_layers.topology);
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            for (std::size_t c = 0; c < 3; ++c) layers.at<normal_column>(i)[c] = i + 0.25 * static_cast<double>(c);
            layers.at<name_column>(i)[0] = "pixel " + std::to_string(i);
        }
        layers.column<disparity_column>() = random_layers.disparity;

        const users_layers before = layers;
        const buffer<std::int32_t> order = testing::random_permutation(random, layers.size());
        layers.reorder(order);
        REQUIRE(testing::same_graph(layers.topology, ldi::reordered(before.topology, order)));
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            const std::int32_t old = order[static_cast<std::size_t>(i)];
            REQUIRE(layers.at<name_column>(i)[0] == "pixel " + std::to_string(old));
            REQUIRE(layers.at<disparity_column>(i)[0] == before.at<disparity_column>(old)[0]);
            for (std::size_t c = 0; c < 3; ++c) REQUIRE(layers.at<normal_column>(i)[c] == before.at<normal_column>(old)[c]);
        }
    });
}

TEST_CASE("of the pixels that are kept the links and rows stay, in their order, and nothing else does") {
    testing::for_random_graphs(60, 300, [](const testing::random_layers& random_layers, std::mt19937& random) {
        users_layers before(random_layers.topology);
        before.column<disparity_column>() = random_layers.disparity;
        buffer<std::uint8_t> kept(before.size());
        buffer<std::int32_t> now(before.size(), no_pixel);
        std::int32_t count = 0;
        for (std::size_t i = 0; i < kept.size(); ++i)
            if ((kept[i] = testing::chance(random, 60) ? 7 : 0) != 0) now[i] = count++;
        users_layers layers = before;
        layers.keep(kept);
        REQUIRE(layers.size() == static_cast<std::size_t>(count));
        REQUIRE(layers.column<name_column>().size() == layers.size());
        for (std::size_t i = 0; i < kept.size(); ++i) {
            if (kept[i] == 0) continue;
            REQUIRE(layers.at<disparity_column>(now[i])[0] == before.at<disparity_column>(static_cast<std::int32_t>(i))[0]);
            for (const side s : all_sides) {
                const std::int32_t neighbor = before.topology.neighbors(s)[i];
                const std::int32_t expected = neighbor == no_pixel ? no_pixel : now[static_cast<std::size_t>(neighbor)];
                REQUIRE(layers.topology.neighbor(now[i], s) == expected);
            }
        }
    });
}
