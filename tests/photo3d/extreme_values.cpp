// Photos and depth maps at numerical limits: each is rejected before any work, or becomes a GLB file of finite numbers.
#include <ldi/formats/glb.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

// Another file may compile this one in another configuration.
#ifndef LDI_TEST_CONFIGURATION
#define LDI_TEST_CONFIGURATION ""
#endif

namespace {

constexpr float largest = std::numeric_limits<float>::max(), tiniest = std::numeric_limits<float>::denorm_min();
constexpr float infinity = std::numeric_limits<float>::infinity(), not_a_number = std::numeric_limits<float>::quiet_NaN();

/// A depth estimator that returns a given map, and counts its calls.
struct counted_estimator {
    ldi::image<float> map;
    int* calls;

    template <ldi::executor Executor>
    ldi::image<float> disparity(ldi::image_view<const std::uint8_t>, const ldi::progress_listener&, Executor&&) const {
        ++*calls;
        return map;
    }
    float quantization_step() const { return 1.0F; }
};

/// A wall of one value and an object in front of it with another.
ldi::image<float> two_values(float wall, float thing) {
    ldi::image<float> map(24, 32, 1, wall);
    for (std::size_t y = 6; y < 18; ++y)
        for (std::size_t x = 10; x < 22; ++x) map(y, x) = thing;
    return map;
}

/// Returns nothing if the map becomes a GLB file of finite numbers. If the map is refused, returns the reason.
std::optional<std::string> complaint_about(const ldi::image<float>& map, bool is_inverse_depth, bool is_metric) {
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = is_inverse_depth, options.normalize.is_metric = is_metric;
    try {
        const ldi::image<std::uint8_t> photo(48, 64, 3, std::uint8_t{90});
        const ldi::photo3d made = ldi::make_photo3d(photo, ldi::given_disparity{map}, ldi::diffusion_inpainter{}, options);
        for (const float p : made.mesh.positions) REQUIRE(std::isfinite(p));
        for (const float p : made.mesh.soft_edges.positions) REQUIRE(std::isfinite(p));
        REQUIRE(made.facts.range.z_near > 0);
        REQUIRE(std::isfinite(made.facts.range.z_far));
        ldi::glb_options glb;
        glb.camera = made.facts.camera;
        REQUIRE(ldi::encode_glb(made.mesh, made.atlas.color, glb).size() > 1000);  // rejects values that are not finite
        return std::nullopt;
    } catch (const ldi::error& failure) {
        REQUIRE(failure.code() == ldi::error_code::invalid_data);
        return failure.details().found;
    }
}

}  // namespace

TEST_CASE(LDI_TEST_CONFIGURATION "photos that are empty or do not have three channels are refused before depth is estimated") {
    int calls = 0;
    const counted_estimator estimator{ldi::image<float>(4, 4, 1, 0.5F), &calls};
    for (const auto& [height, width, channels] :
         {std::array<std::size_t, 3>{0, 0, 3}, {0, 5, 3}, {5, 0, 3}, {5, 4, 4}, {5, 4, 1}, {5, 4, 0}}) {
        const ldi::image<std::uint8_t> photo(height, width, channels);
        const std::string found = std::to_string(height) + " x " + std::to_string(width) + " x " + std::to_string(channels);
        CHECK_THROWS_WITH(ldi::make_photo3d(photo, estimator, ldi::diffusion_inpainter{}), Catch::Contains("found " + found));
    }
    CHECK(calls == 0);
    CHECK_THROWS_WITH(ldi::for_sheets({}, 0, 0), Catch::Contains("found 0 x 0 pixels, long_side 1536"));
    CHECK_THROWS_AS(ldi::area_resize(ldi::image<std::uint8_t>(0, 0, 3), 4, 4), ldi::error);
    CHECK_THROWS_AS(ldi::area_resize(ldi::image<std::uint8_t>(4, 4, 3), 0, 4), ldi::error);
}

TEST_CASE(LDI_TEST_CONFIGURATION "every depth map either becomes a GLB file of finite numbers or is refused") {
    for (const float wall : {0.0F, -0.0F, tiniest, 1e-38F, 1e-20F, 2e-9F, 1.0F, 1e6F, 1e20F, largest})
        for (const float thing : {tiniest, 1e-38F, 1e-20F, 2e-9F, 0.5F, 1.0F, 1e6F, 1e20F, largest}) {
            CAPTURE(wall, thing);
            CHECK_FALSE(complaint_about(two_values(wall, thing), true, false));
            CHECK_FALSE(complaint_about(two_values(wall, thing), false, false));
            CHECK_FALSE(complaint_about(two_values(-wall, thing), false, false));
            const float nearest = 1.0F / std::max(wall, thing);
            CHECK(complaint_about(two_values(wall, thing), true, true).has_value() == !(nearest >= 1e-6F && nearest <= 1e9F));
        }
    for (const bool is_inverse_depth : {false, true}) {
        CHECK(complaint_about(two_values(1.0F, infinity), is_inverse_depth, false) == "inf");
        CHECK(complaint_about(two_values(-infinity, 1.0F), is_inverse_depth, false) == "-inf");
        CHECK(complaint_about(two_values(1.0F, not_a_number), is_inverse_depth, false) == "nan");
    }
    CHECK(complaint_about(two_values(1.0F, -0.25F), true, false) == "-0.25");
    CHECK(complaint_about(two_values(0.0F, 0.0F), true, false).has_value());
    CHECK_FALSE(complaint_about(two_values(0.0F, 0.0F), false, false));
}

TEST_CASE(LDI_TEST_CONFIGURATION "a disparity of 0 lies at z_far, like a sky") {
    const ldi::image<std::uint8_t> photo(48, 64, 3, std::uint8_t{90});
    const ldi::given_disparity depth{two_values(0.0F, 0.5F)};
    const ldi::photo3d made = ldi::make_photo3d(photo, depth, ldi::diffusion_inpainter{});
    CHECK(made.disparity(2, 2) == 0.0F);
    CHECK(made.disparity(24, 32) == 1.0F);
    CHECK(made.facts.range.z_far == Approx(50.0F * made.facts.range.z_near));
    CHECK(made.layers.size() > photo.height() * photo.width());  // the sky continues behind the object
}

TEST_CASE(LDI_TEST_CONFIGURATION "options that would cause numeric overflow are refused") {
    const ldi::image<std::uint8_t> photo(4, 6, 3, std::uint8_t{90});
    const ldi::given_disparity depth{ldi::image<float>(4, 6, 1, 0.5F)};
    const auto message_for = [&](auto&& change) {
        ldi::photo3d_options options;
        change(options);
        return ldi::testing::message_of([&] { ldi::make_photo3d(photo, depth, ldi::diffusion_inpainter{}, options); });
    };
    const auto refused = Catch::Contains("(invalid option)");
    for (const float bad : {0.0F, tiniest, infinity, not_a_number, -1.0F}) {
        CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.focal_length_35mm = bad; }), refused);
        CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.surface.max_step = bad; }), refused);
        CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.normalize.max_depth_ratio = bad; }), refused);
        CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.normalize.assumed_range.z_near = bad; }), refused);
    }
    CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.focal_length_35mm = infinity; }),
               Catch::Contains("found 1536 and inf (invalid option)"));
    CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.normalize.relative_step = infinity; }),
               Catch::Contains("found 0.001, inf, 0.02, 50 (invalid option)"));
    CHECK_THAT(message_for([&](ldi::photo3d_options& o) { o.expand.motion = not_a_number; }),
               Catch::Contains("found nan (invalid option)"));
}
