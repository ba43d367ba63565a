#include <ldi/depth/normalize.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace {

ldi::image<float> ramp(float first, float last, std::size_t count = 1000) {
    ldi::image<float> map(1, count);
    for (std::size_t x = 0; x < count; ++x)
        map(0, x, 0) = first + (last - first) * static_cast<float>(x) / static_cast<float>(count - 1);
    return map;
}

}  // namespace

TEST_CASE("normalized disparity ranges from 0 to 1 and increases with the source") {
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    const ldi::normalized_disparity n = ldi::normalize(ramp(2.0F, 10.0F), options);
    CHECK(n.disparity(0, 0, 0) == Approx(0.0F).margin(1e-6));
    CHECK(n.disparity(0, 999, 0) == 1.0F);
    for (std::size_t x = 1; x < 1000; ++x) REQUIRE(n.disparity(0, x, 0) >= n.disparity(0, x - 1, 0));
    CHECK(n.range.z_far / n.range.z_near == Approx(5.0F));
}

TEST_CASE("normalized depth is the inverse of the source, up to scale") {
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    const ldi::image<float> source = ramp(0.5F, 4.0F);
    const ldi::normalized_disparity n = ldi::normalize(source, options);
    const float scale = n.range.depth(n.disparity(0, 0, 0)) * source(0, 0, 0);
    for (std::size_t x = 0; x < 1000; x += 37)
        CHECK(n.range.depth(n.disparity(0, x, 0)) * source(0, x, 0) == Approx(scale).epsilon(1e-4));
}

TEST_CASE("the depth of a metric source stays in meters") {
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    options.is_metric = true;
    const ldi::image<float> source = ramp(0.25F, 2.0F);  // 4 m to half a meter
    const ldi::normalized_disparity n = ldi::normalize(source, options);
    for (std::size_t x = 0; x < 1000; x += 37)
        CHECK(n.range.depth(n.disparity(0, x, 0)) == Approx(1.0F / source(0, x, 0)).epsilon(1e-4));
}

TEST_CASE("a single outlier does not compress the range of the other values") {
    ldi::image<float> map = ramp(1.0F, 2.0F, 10000);
    map(0, 0, 0) = 1e6F;
    const ldi::normalized_disparity n = ldi::normalize(map);
    CHECK(n.disparity(0, 0, 0) == 1.0F);
    CHECK(n.disparity(0, 5000, 0) == Approx(0.5F).margin(0.01));
}

TEST_CASE("one quantization step of the source never exceeds the maximum step of disparity, even in a flat scene") {
    const float ratio = std::exp(0.0187F);
    ldi::normalize_options options;
    options.relative_step = ratio - 1.0F;
    for (int levels : {1, 2, 5, 20, 100}) {
        ldi::image<float> map(100, 100);
        for (std::size_t i = 0; i < map.size(); ++i)
            map.data()[i] = 3.0F * std::pow(ratio, static_cast<float>(static_cast<int>(i) % levels));
        const ldi::normalized_disparity n = ldi::normalize(map, options);
        for (std::size_t i = 0; i + 1 < map.size(); ++i)
            if (static_cast<int>(i) % levels != levels - 1)
                REQUIRE(std::abs(n.disparity.data()[i + 1] - n.disparity.data()[i]) <= options.max_step * 1.001F);
        CHECK(n.range.z_far >= n.range.z_near);
    }
}

TEST_CASE("the ratio of far to near depth is limited, and the assumed range applies to sources that are not inverse depth") {
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    CHECK(ldi::normalize(ramp(0.001F, 10.0F), options).range.z_far == Approx(options.max_depth_ratio));
    options.is_inverse_depth = false;
    options.assumed_range = {2.0F, 7.0F};
    CHECK(ldi::normalize(ramp(-5.0F, 10.0F), options).range.z_far == 7.0F);
}

TEST_CASE(
    "values that are not finite, negative inverse depth and invalid shapes are refused, and the error states the value found") {
    const auto complaint_about = [](const ldi::image<float>& map, const ldi::normalize_options& options = {}) {
        const std::string message = ldi::testing::message_of([&] { ldi::normalize(map, options); });
        return message.substr(message.find("found"));
    };
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (const auto& [bad, found] : {std::pair<float, const char*>{std::numeric_limits<float>::quiet_NaN(), "nan"},
                                     {infinity, "inf"},
                                     {-infinity, "-inf"},
                                     {-1.0F, "-1"},
                                     {-1e-45F, "-1.401298e-45"}}) {
        ldi::image<float> map = ramp(1.0F, 2.0F);
        map(0, 500, 0) = bad;
        CHECK(complaint_about(map) == std::string("found ") + found + " (invalid data)");
    }
    CHECK(complaint_about(ldi::image<float>(0, 3)) == "found 0 x 3 x 1 (mismatch)");
    CHECK(complaint_about(ldi::image<float>(4, 3, 2, 0.5F)) == "found 4 x 3 x 2 (mismatch)");
    CHECK(complaint_about(ramp(0.0F, 0.0F)) == "found no value above 0 outside the clipped_share (invalid data)");
    ldi::normalize_options options;
    options.assumed_range = {0.0F, infinity};
    CHECK(complaint_about(ramp(1.0F, 2.0F), options) == "found 0 to inf (invalid option)");
}

TEST_CASE("an inverse depth of 0 becomes the farthest depth that the maximum ratio allows") {
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    ldi::image<float> map = ramp(0.2F, 0.5F);
    for (std::size_t x = 0; x < 300; ++x) map(0, x, 0) = 0.0F;
    for (const bool is_metric : {false, true}) {
        options.is_metric = is_metric;
        const ldi::normalized_disparity n = ldi::normalize(map, options);
        CHECK(n.disparity(0, 0, 0) == 0.0F);
        CHECK(n.disparity(0, 300, 0) > 0.5F);
        CHECK(n.range.z_near == Approx(is_metric ? 2.0F : 1.0F));
        CHECK(n.range.z_far == Approx(50.0F * n.range.z_near));
    }
}

TEST_CASE("metric distances below 1e-6 or above 1e9 meters are refused") {
    ldi::normalize_options options;
    options.is_metric = true;
    CHECK_THROWS_WITH(
        ldi::normalize(ldi::image<float>(2, 2, 1, 2.94e-39F), options),
        Catch::Contains("between 1e-6 and 1e9 meters away, found 3.4") && Catch::Contains("e+38 meters (invalid data)"));
    CHECK_THROWS_WITH(ldi::normalize(ldi::image<float>(2, 2, 1, 3.4e38F), options), Catch::Contains("e-39 meters"));
    // A sky at the distance of the largest float, behind a wall, is accepted.
    ldi::image<float> map = ramp(0.2F, 0.5F);
    map(0, 0, 0) = 1.0F / std::numeric_limits<float>::max();
    options.clipped_share = 0.0F;
    CHECK(ldi::normalize(map, options).range.z_near == Approx(2.0F));
}

TEST_CASE("maps of the largest and of the smallest floats are normalized without overflow") {
    constexpr float largest = std::numeric_limits<float>::max(), smallest = std::numeric_limits<float>::denorm_min();
    ldi::normalize_options options;
    options.clipped_share = 0.0F;
    const ldi::normalized_disparity tiny = ldi::normalize(ramp(smallest, 100.0F * smallest), options);
    CHECK(tiny.disparity(0, 0, 0) == 0.0F);
    CHECK(tiny.disparity(0, 999, 0) == 1.0F);
    CHECK(std::isfinite(tiny.range.z_far));
    options.is_inverse_depth = false;
    ldi::image<float> wide(1, 3, 1, 0.0F);
    wide(0, 0, 0) = -largest, wide(0, 2, 0) = largest;
    const ldi::normalized_disparity n = ldi::normalize(wide, options);
    CHECK(n.disparity(0, 0, 0) == 0.0F);
    CHECK(n.disparity(0, 1, 0) == 0.5F);
    CHECK(n.disparity(0, 2, 0) == 1.0F);
}

TEST_CASE("a fraction of clipped pixels that is negative, NaN or at least one half is refused") {
    for (float share : {-0.1F, 0.5F, 1.0F, std::numeric_limits<float>::quiet_NaN()}) {
        ldi::normalize_options options;
        options.clipped_share = share;
        CHECK(ldi::testing::raised([&] { ldi::normalize(ramp(1.0F, 2.0F), options); }) == ldi::error_code::invalid_option);
    }
}
