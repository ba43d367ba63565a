#include <ldi/ldi.hpp>

#include "tests/support/hard_maps.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace {

/// A coarse map with a near right half and a far left half. A square of medium disparity, with `spot` samples per side, lies in
/// the far half.
struct coarse_scene {
    float near_disparity = 0.9F;
    std::size_t spot = 0;

    ldi::image<float> disparity(ldi::image_view<const std::uint8_t>, const ldi::progress_listener&,
                                const ldi::serial_executor&) const {
        ldi::image<float> map(80, 100, 1);
        for (std::size_t y = 0; y < 80; ++y)
            for (std::size_t x = 0; x < 100; ++x)
                map(y, x, 0) = x >= 50 ? near_disparity : y >= 20 && y < 20 + spot && x >= 10 && x < 10 + spot ? 0.4F : 0.2F;
        map(0, 99, 0) = 1.0F;  // fixes the range, whatever near_disparity is
        map(79, 0, 0) = 0.0F;
        return map;
    }
    float quantization_step() const { return 1.0F; }
};

ldi::image<std::uint8_t> photo_of(std::size_t height, std::size_t width) {
    ldi::image<std::uint8_t> photo(height, width, 3);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < 3; ++c) photo(y, x, c) = static_cast<std::uint8_t>((7 * x + 13 * y + 31 * c) % 200);
    return photo;
}

ldi::photo3d_options without_clipping(ldi::photo3d_options options) {
    options.normalize.clipped_share = 0.0F;
    return options;
}

/// Paints all unknown pixels gray.
struct gray_inpainter {
    template <class Layers>
    void inpaint(Layers& layers, const ldi::progress_listener&, const ldi::serial_executor&) const {
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i)
            if (layers.template at<ldi::known_column>(i)[0] == 0)
                std::ranges::fill(layers.template at<ldi::color_column>(i), std::uint8_t{128});
    }
};

/// Returns the number of hidden pixels in the middle row.
std::size_t growth(const ldi::photo3d& made) {
    std::size_t hidden = 0;
    for (std::size_t i = 0; i < made.layers.size(); ++i)
        hidden += made.layers.topology().y()[i] == made.facts.camera.height / 2 &&
                          made.layers.column<ldi::known_column>()[i] == 0 && made.layers.column<ldi::disparity_column>()[i] < 0.3F
                      ? 1U
                      : 0U;
    return hidden;
}

}  // namespace

TEST_CASE("with the paper's options, surfaces grow by 50 pixels behind large and small steps alike") {
    const ldi::image<std::uint8_t> photo = photo_of(320, 400);
    for (const float near_disparity : {0.4F, 0.9F}) {
        const ldi::photo3d made = ldi::make_photo3d(photo, coarse_scene{near_disparity}, ldi::diffusion_inpainter{},
                                                    without_clipping(ldi::paper_options()));
        CHECK(growth(made) == 50);
    }
}

TEST_CASE("with the paper's options, surfaces end at the photo's border and silhouettes are hard") {
    const ldi::image<std::uint8_t> photo = photo_of(320, 400);
    const ldi::photo3d made = ldi::make_photo3d(photo, coarse_scene{}, ldi::diffusion_inpainter{}, ldi::paper_options());
    CHECK(made.facts.margin == 0);
    CHECK(made.mesh.soft_edges.triangles.empty());
    CHECK(ldi::make_photo3d(photo, coarse_scene{}, ldi::diffusion_inpainter{}).facts.margin > 0);
}

TEST_CASE(
    "with the paper's options, inpainted pixels have exactly the inpainter's colors, although the photo has texture and grain") {
    ldi::image<std::uint8_t> photo = ldi::testing::noisy_photo(320, 400);
    for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(120 + value % 17);
    const ldi::photo3d made = ldi::make_photo3d(photo, coarse_scene{}, gray_inpainter{}, ldi::paper_options());
    std::size_t inpainted = 0;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(made.layers.size()); ++i) {
        if (made.layers.at<ldi::known_column>(i)[0] != 0) continue;
        for (const std::uint8_t value : made.layers.at<ldi::color_column>(i)) REQUIRE(value == 128);
        ++inpainted;
    }
    CHECK(inpainted > 1000);
}

TEST_CASE("with the paper's options, surfaces behind a narrow staircase grow as far as without a limit on hidden pixels") {
    const ldi::image<std::uint8_t> photo = photo_of(60, 400);
    const ldi::given_disparity stairs{ldi::testing::hard_map("stairs", 60, 400, 8)};
    const auto pixels_with = [&](float max_hidden) {
        ldi::photo3d_options options = ldi::paper_options();
        if (max_hidden > 0.0F) options.expand.max_hidden = max_hidden;
        return ldi::make_photo3d(photo, stairs, ldi::diffusion_inpainter{}, options).layers.size();
    };
    const float default_limit = ldi::photo3d_options().expand.max_hidden;
    CHECK(static_cast<float>(pixels_with(0.0F)) > (1.0F + default_limit) * 60 * 400);
    CHECK(pixels_with(0.0F) == pixels_with(1000.0F));
}

TEST_CASE("with the paper's options, thresholds in pixels do not grow with the size of a depth sample") {
    // The spot covers 12 x 12 pixels, and has 48 sides. By default, the minimum of 20 sides is scaled to 80, because a depth
    // sample covers 4 x 4 pixels.
    const ldi::image<std::uint8_t> photo(320, 400, 3);
    const auto curves_of = [&](float max_sample_size) {
        ldi::photo3d_options options = without_clipping(ldi::paper_options());
        options.max_sample_size = max_sample_size;
        return ldi::make_photo3d(photo, coarse_scene{0.9F, 3}, ldi::diffusion_inpainter{}, options).curves.count();
    };
    CHECK(curves_of(1.0F) == 2);
    CHECK(curves_of(ldi::photo3d_options().max_sample_size) == 1);
}

TEST_CASE("a maximum sample size below 1 or above 16 is refused") {
    for (const float size : {0.5F, 17.0F, std::nanf("")}) {
        ldi::photo3d_options options;
        options.max_sample_size = size;
        CHECK_THROWS_AS(ldi::make_photo3d(photo_of(8, 8), coarse_scene{}, ldi::diffusion_inpainter{}, options), ldi::error);
    }
}
