#include <ldi/core/image.hpp>

#include <xtensor/xview.hpp>

#include <catch2/catch.hpp>

#include <numeric>
#include <type_traits>

using namespace ldi;

static_assert(std::is_same_v<decltype(row(std::declval<image<float>&>(), std::size_t{0})), float*>);
static_assert(std::is_same_v<decltype(row(std::declval<const image<float>&>(), std::size_t{0})), const float*>);

TEST_CASE("an image knows its height, width and channels") {
    const image<float> picture = make_image<float>(3, 5, 2);
    CHECK(height(picture) == 3);
    CHECK(width(picture) == 5);
    CHECK(channels(picture) == 2);
    CHECK(picture.size() == 30);
    CHECK(channels(make_image<std::uint8_t>(3, 5)) == 1);
    CHECK(make_image<float>(0, 5, 3).size() == 0);
}

TEST_CASE("an image can be made of one value") {
    const image<std::uint8_t> picture = make_image<std::uint8_t>(2, 3, 4, 9);
    CHECK(std::count(picture.begin(), picture.end(), 9) == 24);
    const image<float> one = make_image<float>(1, 1, 1, 0.5F);
    CHECK(one(0, 0, 0) == 0.5F);
}

TEST_CASE("rows are contiguous, one after the other, channels last") {
    image<int> picture = make_image<int>(4, 3, 2);
    std::iota(picture.data(), picture.data() + picture.size(), 0);
    for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 3; ++x)
            for (std::size_t c = 0; c < 2; ++c) {
                CHECK(picture(y, x, c) == static_cast<int>((y * 3 + x) * 2 + c));
                CHECK(&row(picture, y)[x * 2 + c] == &picture(y, x, c));
                CHECK(&row(std::as_const(picture), y)[x * 2 + c] == &picture(y, x, c));
            }
    row(picture, std::size_t{2})[0] = -1;
    CHECK(picture(2, 0, 0) == -1);
}
