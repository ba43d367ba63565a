#include <ldi/depth/middle_components.hpp>

#include <catch2/catch.hpp>

#include <random>

namespace {

// Foreground 0.8 on the right of `edge`, background 0.2 on the left.
ldi::image<float> two_sides(std::size_t edge) {
    ldi::image<float> map(30, 40);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 40; ++x) map(y, x, 0) = x < edge ? 0.2F : 0.8F;
    return map;
}

}  // namespace

TEST_CASE("a small component with a value between both sides is merged into the side that it touches more") {
    ldi::image<float> map = two_sides(20);
    const ldi::image<float> clean = map;
    for (std::size_t y = 10; y < 13; ++y)
        for (std::size_t x = 20; x < 24; ++x) map(y, x, 0) = 0.5F;  // 3 sides toward the background, 11 toward the foreground
    CHECK(ldi::merge_middle_components(map) == 1);
    CHECK((map == clean));

    for (std::size_t y = 10; y < 13; ++y)
        for (std::size_t x = 16; x < 20; ++x) map(y, x, 0) = 0.5F;
    CHECK(ldi::merge_middle_components(map) == 1);
    CHECK((map == clean));
}

TEST_CASE("components of at least 20 pixels are not merged") {
    ldi::image<float> map = two_sides(20);
    for (std::size_t y = 10; y < 15; ++y)
        for (std::size_t x = 20; x < 24; ++x) map(y, x, 0) = 0.5F;
    const ldi::image<float> before = map;
    CHECK(ldi::merge_middle_components(map) == 0);
    CHECK((map == before));
}

TEST_CASE("small components that are nearer or farther than all their surroundings are not merged") {
    ldi::image<float> map = two_sides(20);
    map(5, 5, 0) = 0.9F;
    map(5, 35, 0) = 0.1F;
    const ldi::image<float> before = map;
    CHECK(ldi::merge_middle_components(map) == 0);
    CHECK((map == before));
}

TEST_CASE("merging introduces no new values, and changes nothing if the minimum size is 1") {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        ldi::image<float> map(1 + random() % 20, 1 + random() % 20);
        const unsigned levels = 2 + random() % 4;
        for (float& value : map) value = static_cast<float>(random() % levels) / static_cast<float>(levels);
        if (round % 2 == 0)
            for (std::size_t y = 0; y < map.height() / 2; ++y)
                for (std::size_t x = 0; x < map.width(); ++x) map(y, x, 0) = 0.0F;
        const ldi::image<float> before = map;
        ldi::merge_middle_components(map);
        for (float value : map) REQUIRE(std::find(before.begin(), before.end(), value) != before.end());
        const ldi::image<float> once = map;
        ldi::middle_component_options none;
        none.min_size = 1;
        REQUIRE(ldi::merge_middle_components(map, {}, none) == 0);
        REQUIRE((map == once));
    }
}
