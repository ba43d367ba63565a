#include <ldi/core/image.hpp>

#include <xtensor/xview.hpp>

#include <catch2/catch.hpp>

#include <numeric>
#include <type_traits>

using namespace ldi;

static_assert(std::is_same_v<decltype(row(std::declval<image<float>&>(), std::size_t{0})), float*>);
static_assert(std::is_same_v<decltype(row(std::declval<const image<float>&>(), std::size_t{0})), const float*>);

TEST_CASE("an image knows its height, width and channels") {
    const image<float> picture(3, 5, 2);
    CHECK(picture.height() == 3);
    CHECK(picture.width() == 5);
    CHECK(picture.channels() == 2);
    CHECK(picture.size() == 30);
    CHECK(image<std::uint8_t>(3, 5).channels() == 1);
    CHECK(image<float>(0, 5, 3).size() == 0);
}

TEST_CASE("an image can be made of one value") {
    const image<std::uint8_t> picture(2, 3, 4, 9);
    CHECK(std::count(picture.begin(), picture.end(), 9) == 24);
    const image<float> one(1, 1, 1, 0.5F);
    CHECK(one(0, 0, 0) == 0.5F);
}

TEST_CASE("rows are contiguous, one after the other, channels last") {
    image<int> picture(4, 3, 2);
    std::iota(picture.data(), picture.data() + picture.size(), 0);
    for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 3; ++x)
            for (std::size_t c = 0; c < 2; ++c) {
                CHECK(picture(y, x, c) == static_cast<int>((y * 3 + x) * 2 + c));
                CHECK(&picture.row(y)[x * 2 + c] == &picture(y, x, c));
                CHECK(&std::as_const(picture).row(y)[x * 2 + c] == &picture(y, x, c));
            }
    picture.row(std::size_t{2})[0] = -1;
    CHECK(picture(2, 0, 0) == -1);
}
