#include <ldi/photo3d/clean_depth.hpp>
#include <ldi/photo3d/lift_photo.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

namespace {

/// Levels that differ by a factor of `step`, at random.
struct quantized_estimator {
    float step;

    template <ldi::executor Executor>
    ldi::image<float> disparity(ldi::image_view<const std::uint8_t> photo, const ldi::progress_listener&, Executor&&) const {
        std::mt19937 random(3);
        ldi::image<float> map(photo.height(), photo.width());
        for (float& value : map) value = std::pow(step, static_cast<float>(random() % 4));
        return map;
    }
    float quantization_step() const { return step; }
};

/// Decides nothing, but puts a speck on a flat map.
struct speck_decider {
    std::uint8_t share;  // of every pixel; 0: the decider returns no shares

    template <ldi::executor Executor>
    ldi::decided_depth decide(ldi::undecided_depth depth, Executor&&) const {
        ldi::decided_depth result{ldi::image<float>(depth.disparity.height(), depth.disparity.width(), 1, 0.5F), {}};
        result.disparity(7, 9) = 0.9F;
        if (share != 0) result.shares = ldi::image<std::uint8_t>(depth.disparity.height(), depth.disparity.width(), 1, share);
        return result;
    }
};

}  // namespace

TEST_CASE("clean_depth() merges specks if the decider returns shares, and keeps them otherwise") {
    const ldi::image<std::uint8_t> photo(20, 30, 3, std::uint8_t{90});
    const ldi::given_disparity flat{ldi::image<float>(10, 15, 1, 0.5F)};
    CHECK(ldi::clean_depth(photo, flat, speck_decider{255}).disparity(7, 9) == 0.5F);
    CHECK(ldi::clean_depth(photo, flat, speck_decider{0}).disparity(7, 9) == 0.9F);
}

TEST_CASE("a curve that is long only for decided silhouettes remains only between these") {
    const ldi::image<std::uint8_t> photo(40, 60, 3, std::uint8_t{90});
    const ldi::given_disparity flat{ldi::image<float>(20, 30, 1, 0.5F)};
    const auto curves = [&](std::uint8_t share) {
        ldi::cleaned_photo cleaned = ldi::clean_depth(photo, flat, speck_decider{share});
        for (std::size_t y = 10; y < 18; ++y) std::fill_n(cleaned.disparity.row(y) + 20, 8, 0.9F);  // 32 sides around 64 pixels
        return ldi::lift_photo(cleaned).curves.size();  // samples of 2 pixels: from 40 sides, or from 16 if decided
    };
    CHECK(curves(1) == 1);
    CHECK(curves(0) == 0);
}

TEST_CASE("a photo without pixels cannot be shrunk") {
    for (const ldi::image<std::uint8_t>& photo : {ldi::image<std::uint8_t>(), {0, 5, 3}, {5, 0, 3}, {5, 5, 0}}) {
        const ldi::serial_executor threads;
        CHECK(ldi::testing::raised([&] { ldi::shrink_photo(ldi::image_view<const std::uint8_t>(photo), 10, threads); }) ==
              ldi::error_code::invalid_data);
    }
}

TEST_CASE("after clean_depth(), adjacent levels of a quantized estimate differ by at most the maximum step") {
    const ldi::image<std::uint8_t> photo(20, 30, 3, std::uint8_t{90});
    for (const float step : {1.01F, 1.0187F, 1.1F, 1.5F}) {
        const quantized_estimator estimator{step};
        ldi::normalize_options options;
        options.relative_step = step - 1.0F;
        const ldi::image<float> source = estimator.disparity(photo, {}, ldi::serial_executor());
        const ldi::cleaned_photo cleaned = ldi::clean_depth(photo, estimator);
        CAPTURE(step);
        CHECK(cleaned.estimated == ldi::normalize(source, options).disparity);
        CHECK(1.0F - *std::min_element(cleaned.estimated.begin(), cleaned.estimated.end()) <= 3 * options.max_step * 1.001F);
    }
}
