#include <ldi/adapt/xtensor.hpp>

#include <catch2/catch.hpp>

#include <xtensor/xmath.hpp>
#include <xtensor/xview.hpp>

#include <cstdint>
#include <numeric>

using namespace ldi;

TEST_CASE("as_tensor() returns a tensor that shares the image's memory") {
    image<float> picture(3, 4, 2);
    std::iota(picture.begin(), picture.end(), 0.0F);
    auto tensor = as_tensor(picture);
    CHECK(tensor(2, 1, 1) == picture(2, 1, 1));
    CHECK(xt::sum(tensor)() == Approx(23.0 * 24.0 / 2.0));
    tensor(0, 0, 0) = 7.0F;
    CHECK(picture(0, 0, 0) == 7.0F);
    const image<float>& constant = picture;
    CHECK(as_tensor(constant)(0, 0, 0) == 7.0F);
}

TEST_CASE("view_of() refers to tensors and to strided views of them without a copy") {
    xt::xarray<std::uint8_t> photo = xt::arange<std::uint8_t>(120);
    photo.reshape({4, 10, 3});
    const image_view<std::uint8_t> all = view_of(photo);
    REQUIRE((all.height() == 4 && all.width() == 10 && all.channels() == 3));
    CHECK(all.data() == photo.data());
    auto part = xt::view(photo, xt::range(1, 3), xt::range(2, 7));
    const auto cut = view_of(part);
    REQUIRE((cut.height() == 2 && cut.width() == 5 && cut.channels() == 3 && cut.row_stride() == 30));
    for (std::size_t y = 0; y < 2; ++y)
        for (std::size_t x = 0; x < 5; ++x)
            for (std::size_t c = 0; c < 3; ++c) CHECK(cut(y, x, c) == photo(y + 1, x + 2, c));
    const xt::xtensor<float, 2> map = xt::ones<float>({5, 6});
    CHECK(view_of(map).channels() == 1);
}

TEST_CASE("a transposed tensor is refused by view_of(), but copied by make_image()") {
    xt::xarray<float> values = xt::arange<float>(24);
    values.reshape({4, 6});
    auto turned = xt::transpose(values);
    CHECK_THROWS_AS(view_of(turned), error);
    const image<float> picture = make_image<float>(turned);
    REQUIRE((picture.height() == 6 && picture.width() == 4 && picture.channels() == 1));
    CHECK(picture(5, 3) == values(3, 5));
    CHECK(make_image<std::uint8_t>(values * 2.0F)(1, 1) == 14);
    const xt::xarray<float> line = xt::arange<float>(5);
    CHECK_THROWS_AS(view_of(line), error);
    CHECK_THROWS_AS(make_image<float>(line), error);
}
