#include <ldi/depth/resample.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

namespace {

// A disc in front of a background of another color. The depth edge is displaced to the left by `shift` pixels of the photo.
struct disc_scene {
    ldi::image<std::uint8_t> photo{160, 200, 3};
    ldi::image<float> truth{160, 200};
    ldi::image<float> map{40, 50};

    explicit disc_scene(float shift) {
        std::mt19937 random(4);
        for (std::size_t y = 0; y < 160; ++y)
            for (std::size_t x = 0; x < 200; ++x) {
                const bool front = inside(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
                truth(y, x, 0) = front ? 0.9F : 0.2F;
                for (std::size_t c = 0; c < 3; ++c)
                    photo(y, x, c) = static_cast<std::uint8_t>((front ? 60 * c : 200 - 40 * c) + random() % 20);
            }
        for (std::size_t y = 0; y < 40; ++y)
            for (std::size_t x = 0; x < 50; ++x)
                map(y, x, 0) =
                    inside(4.0F * static_cast<float>(x) + 2.0F + shift, 4.0F * static_cast<float>(y) + 2.0F) ? 0.9F : 0.2F;
    }

    static bool inside(float x, float y) { return std::hypot(x - 100.0F, y - 80.0F) < 50.0F; }
};

}  // namespace

TEST_CASE("resampling moves depth edges to the color edges of the photo") {
    for (float shift : {0.0F, 3.0F, -5.0F}) {
        const disc_scene scene(shift);
        const ldi::image<float> fine = ldi::resample_to_photo(scene.map, scene.photo);
        std::size_t wrong = 0, nearest_wrong = 0;
        for (std::size_t y = 0; y < 160; ++y)
            for (std::size_t x = 0; x < 200; ++x) {
                wrong += std::abs(fine(y, x, 0) - scene.truth(y, x, 0)) > 0.05F ? 1U : 0U;
                nearest_wrong += std::abs(scene.map(y / 4, x / 4, 0) - scene.truth(y, x, 0)) > 0.05F ? 1U : 0U;
            }
        INFO("shift " << shift << ": " << wrong << " pixels wrong, " << nearest_wrong << " without the photo");
        CHECK(wrong * 4 < nearest_wrong);
    }
}

TEST_CASE("resampling creates no values between the two sides of an edge") {
    const disc_scene scene(2.0F);
    for (float value : ldi::resample_to_photo(scene.map, scene.photo))
        REQUIRE((std::abs(value - 0.9F) < 1e-4F || std::abs(value - 0.2F) < 1e-4F));
}

TEST_CASE("a depth edge moves one pixel toward a color edge of 24 gray levels, but not toward one of 16") {
    const auto moves = [](int contrast) {
        ldi::image<float> map(20, 20);
        ldi::image<std::uint8_t> photo(80, 80, 3, std::uint8_t{100});
        for (std::size_t y = 0; y < 80; ++y)
            for (std::size_t x = 0; x < 80; ++x) {
                map(y / 4, x / 4) = x < 40 ? 0.2F : 0.9F;
                if (x >= 44) photo(y, x, 0) = static_cast<std::uint8_t>(100 + contrast);
            }
        const ldi::image<float> fine = ldi::resample_to_photo(map, photo);
        CHECK(fine(40, 39) == Approx(0.2F));
        CHECK(fine(40, 41) == Approx(0.9F));
        return fine(40, 40) < 0.5F;
    };
    CHECK(moves(24));
    CHECK_FALSE(moves(16));
}

TEST_CASE("resampling preserves a plane exactly") {
    ldi::image<std::uint8_t> photo(96, 120, 3, std::uint8_t{100});
    ldi::image<float> map(24, 30);
    for (std::size_t y = 0; y < 24; ++y)
        for (std::size_t x = 0; x < 30; ++x)
            map(y, x, 0) = 0.3F + 0.004F * static_cast<float>(x) + 0.002F * static_cast<float>(y);
    const ldi::image<float> fine = ldi::resample_to_photo(map, photo);
    for (std::size_t y = 2; y < 94; ++y)
        for (std::size_t x = 2; x < 118; ++x) {
            const float at_x = (static_cast<float>(x) + 0.5F) / 4.0F - 0.5F, at_y = (static_cast<float>(y) + 0.5F) / 4.0F - 0.5F;
            REQUIRE(fine(y, x, 0) == Approx(0.3F + 0.004F * at_x + 0.002F * at_y).margin(1e-5));
        }
}

TEST_CASE("resampling works for any ratio of sizes, with the same result on three threads") {
    std::mt19937 random(5);
    ldi::thread_pool threads(3);
    for (int round = 0; round < 60; ++round) {
        const auto photo = ldi::image<std::uint8_t>(1 + random() % 40, 1 + random() % 40, 3, std::uint8_t{7});
        ldi::image<float> map(1 + random() % 40, 1 + random() % 40);
        for (float& value : map) value = 0.25F + 0.5F * static_cast<float>(random() % 2);
        const ldi::image<float> fine = ldi::resample_to_photo(map, photo);
        REQUIRE(fine.height() == photo.height());
        REQUIRE(fine.width() == photo.width());
        for (float value : fine) REQUIRE((value >= 0.2499F && value <= 0.7501F));
        REQUIRE((ldi::resample_to_photo(map, photo, {}, {}, threads) == fine));
    }
}

TEST_CASE("a sigma that is 0, negative or NaN is refused, and so is a map or photo with a wrong number of channels") {
    const auto error_for = [](const ldi::resample_options& options, std::size_t map_channels = 1,
                              std::size_t photo_channels = 3) {
        return ldi::testing::raised([&] {
            const ldi::image<float> map(2, 2, map_channels, 0.5F);
            ldi::resample_to_photo(map, ldi::image<std::uint8_t>(4, 4, photo_channels), {}, options);
        });
    };
    for (const float wrong : {0.0F, -1.0F, std::nanf("")}) {
        CHECK(error_for({.spatial_sigma = wrong}) == ldi::error_code::invalid_option);
        CHECK(error_for({.color_sigma = wrong}) == ldi::error_code::invalid_option);
    }
    CHECK(error_for({}, 2, 3) == ldi::error_code::mismatch);
    CHECK(error_for({}, 1, 4) == ldi::error_code::mismatch);
    CHECK_FALSE(error_for({}));
}
