#include <ldi/base/array_view.hpp>
#include <ldi/core/image.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cstdint>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

using namespace ldi;

static_assert(std::is_same_v<decltype(std::declval<image<float>&>().row(0)), float*>);
static_assert(std::is_same_v<decltype(std::declval<const image<float>&>().row(0)), const float*>);
static_assert(std::is_convertible_v<image<float>&, image_view<float>>);
static_assert(std::is_convertible_v<const image<float>&, image_view<const float>>);
static_assert(std::is_convertible_v<image_view<float>, image_view<const float>>);
static_assert(!std::is_convertible_v<const image<float>&, image_view<float>>);
static_assert(!std::is_convertible_v<image_view<const float>, image_view<float>>);
static_assert(std::is_convertible_v<image<float>, image_view<const float>>, "a temporary image can be an argument");
static_assert(!std::is_convertible_v<image<float>, image_view<float>>, "values written to a temporary image are lost");
template <class Image>
concept shows_temporary_values = requires(Image&& i) {
    std::move(i).view();
}
|| requires(Image&& i) { std::move(i).row(0); }
|| requires(Image&& i) { std::move(i).data(); }
|| requires(Image&& i) { std::move(i).begin(); }
|| requires(Image&& i) { std::move(i).end(); };
static_assert(!shows_temporary_values<image<float>> && !shows_temporary_values<const image<float>>);
static_assert(std::is_same_v<decltype(std::declval<image<float>>()(0, 0)), float> &&
                  std::is_same_v<decltype(std::declval<const image<float>>()(0, 0)), float>,
              "a temporary's value is a copy");
template <class Buffer>
concept points_into_temporary = requires(Buffer&& b) {
    std::move(b).data();
}
|| requires(Buffer&& b) { std::move(b).begin(); }
|| requires(Buffer&& b) { std::move(b).end(); };
static_assert(!points_into_temporary<buffer<float>> && !points_into_temporary<const buffer<float>>);
static_assert(std::is_same_v<decltype(std::declval<const buffer<float>>()[0]), float> &&
              std::is_same_v<decltype(std::declval<buffer<float>>()[0]), float> &&
              std::is_same_v<decltype(std::declval<buffer<float>>().front()), float> &&
              std::is_same_v<decltype(std::declval<buffer<float>>().back()), float>);
static_assert(!std::is_constructible_v<image<float>, int, int, float>, "a value such as 0.5 is not a number of channels");
static_assert(!std::is_constructible_v<image<std::uint8_t>, int, int, std::uint8_t> &&
              std::is_constructible_v<image<std::uint8_t>, int, int, int, std::uint8_t>);
static_assert(std::is_constructible_v<image<float>, int, int, int> &&
              std::is_constructible_v<image<float>, int, int, int, float>);

struct point {
    int x;
};
struct named_point : point {
    int name;
};
template <class View, std::size_t... sizes>
concept views_literal_zero = requires {
    View(0, sizes...);
};
static_assert(!views_literal_zero<array_view<const float>, 3> && !views_literal_zero<image_view<const float>, 3, 4>);
static_assert(!std::is_constructible_v<array_view<const point>, named_point*, std::size_t>,
              "points would be read at wrong addresses");
static_assert(!std::is_constructible_v<image_view<const point>, named_point*, std::size_t, std::size_t>);
static_assert(std::is_constructible_v<array_view<const point>, point*, std::size_t>);

TEST_CASE("an image has the height, width and channels it was created with, one channel by default") {
    const image<float> picture(3, 5, 2);
    CHECK(picture.height() == 3);
    CHECK(picture.width() == 5);
    CHECK(picture.channels() == 2);
    CHECK(picture.size() == 30);
    CHECK(image<std::uint8_t>(3, 5).channels() == 1);
    CHECK(image<float>(0, 5, 3).size() == 0);
}

TEST_CASE("an image can be filled with one value") {
    const image<std::uint8_t> picture(2, 3, 4, 9);
    CHECK(std::count(picture.begin(), picture.end(), 9) == 24);
    const image<float> one(1, 1, 1, 0.5F);
    CHECK(one(0, 0, 0) == 0.5F);
}

TEST_CASE("the rows of an image are contiguous, with the channels of a pixel adjacent") {
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

TEST_CASE("a view reads and writes the caller's rows with gaps between them") {
    std::vector<int> memory(4 * 10, -1);
    const image_view<int> view(memory.data() + 1, 4, 3, 2, 10);
    CHECK(view.row_stride() == 10);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 3; ++x)
            for (int c = 0; c < 2; ++c) view(y, x, c) = 100 * y + 10 * x + c;
    CHECK(memory[1 + 3 * 10 + 2 * 2 + 1] == 321);
    CHECK(std::count(memory.begin(), memory.end(), -1) == 4 * 4);

    const image<int> copy{image_view<const int>(view)};
    REQUIRE(same_shape(copy, view));
    CHECK(copy.row_stride() == 6);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 3; ++x)
            for (int c = 0; c < 2; ++c) CHECK(copy(y, x, c) == 100 * y + 10 * x + c);
}

TEST_CASE("a stride in bytes is refused unless it is a multiple of the value's size and at least one row") {
    std::vector<float> memory(40);
    const image_view<float> view(memory.data(), 4, 3, 2, byte_stride{40});
    CHECK(view.row_stride() == 10);
    CHECK(view.row(2) == memory.data() + 20);
    CHECK_THROWS_AS(image_view<float>(memory.data(), 4, 3, 2, byte_stride{42}), error);
    CHECK_THROWS_AS(image_view<float>(memory.data(), 4, 3, 2, byte_stride{20}), error);
    CHECK_THROWS_AS(image_view<float>(memory.data(), 4, 3, 2, byte_stride{0}), error);
    CHECK_THROWS_AS(image_view<float>(memory.data(), 4, 3, 2, 5), error);
}

TEST_CASE("image sizes beyond the address space are refused, even if their product overflows to a small number") {
    constexpr std::size_t half = std::size_t{1} << (4 * sizeof(std::size_t)), most = static_cast<std::size_t>(-1);
    const auto is_refused = [](auto&& make) { return testing::raised(make) == error_code::too_large; };
    float value = 0;
    for (const std::array<std::size_t, 3>& size : {std::array{2 * half, 2 * half, std::size_t{1}},
                                                   {half + 1, half, 1},
                                                   {1, half, half},
                                                   {half, 1, half},
                                                   {1, most, 1},
                                                   {most / 4, 1, 1},
                                                   {3, most / 8, 2},
                                                   {0, half, half}}) {
        const std::size_t height = size[0], width = size[1], channels = size[2];
        CAPTURE(height, width, channels);
        CHECK(is_refused([&] { image<float>(height, width, channels); }));
        CHECK(is_refused([&] { image<float>(height, width, channels, unset); }));
        CHECK(is_refused([&] { image_view<float>(&value, height, width, channels); }));
    }
    CHECK(is_refused([&] { image_view<float>(&value, half, 1, 1, half); }));
    CHECK(is_refused([] { buffer<double>(most / 8); }));
    CHECK(is_refused([] { buffer<double>(most / 8, unset); }));
    CHECK(image<float>(0, most / 8, 1).empty());
    CHECK_THROWS_WITH(image<float>(2 * half, 2 * half),
                      Catch::Contains(std::to_string(2 * half) + " x " + std::to_string(2 * half) + " x 1"));
}

TEST_CASE("a moved-from image is empty") {
    image<float> from(2, 3, 1, 1.5F);
    const image<float> to = std::move(from);
    CHECK(to == image<float>(2, 3, 1, 1.5F));
    CHECK((from.height() == 0 && from.width() == 0 && from.size() == 0));  // NOLINT: a moved-from image is valid
}
