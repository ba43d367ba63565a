#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include "bench/quality/extremes.hpp"
#include "examples/scenes/scene.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/psnr.hpp"

#include <ldi/core/validate.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

namespace {

struct converted {
    ldi::scenes::scene scene;
    ldi::photo3d result;
};

converted convert(const std::string& name, std::int32_t width, std::int32_t height, ldi::photo3d_options options = {}) {
    converted c{ldi::scenes::scene_by_name(name, width, height), {}};
    const ldi::scenes::picture picture = ldi::scenes::render(c.scene, ldi::scenes::picture_options{2, 0.7});
    ldi::image<float> disparity = picture.disparity;
    for (float& value : disparity) value = std::clamp(value, 0.0F, 1.0F);
    options.normalize.is_inverse_depth = false;
    options.normalize.assumed_range = c.scene.range;
    options.normalize.clipped_share = 0.0F;
    options.focal_length_35mm = c.scene.camera.focal_length / ldi::focal_length_from_35mm(1.0F, width, height);
    c.result = ldi::make_photo3d(picture.color, ldi::given_disparity{disparity}, ldi::diffusion_inpainter{}, options);
    return c;
}

// Share of uncovered pixels among those at least `margin` pixels inside the frame, seen from a camera that moves the nearest
// surface by (shift_right, shift_down) pixels.
double uncovered_share(const ldi::photo3d& photo, float shift_right, float shift_down, std::size_t margin) {
    const ldi::view from = ldi::moved_view(photo.facts.camera, photo.facts.range, 1.0F, shift_right, shift_down);
    const ldi::rendering seen = ldi::rasterize(photo.mesh, photo.atlas.color, from);
    std::size_t holes = 0, pixels = 0;
    for (std::size_t y = margin; y + margin < seen.coverage.height(); ++y)
        for (std::size_t x = margin; x + margin < seen.coverage.width(); ++x) {
            ++pixels;
            holes += seen.coverage(y, x, 0) == 0 ? 1U : 0U;
        }
    return static_cast<double>(holes) / static_cast<double>(pixels);
}

/// Records whether make_photo3d() called it.
struct watched_estimator {
    bool* called;
    ldi::image<float> disparity(ldi::image_view<const std::uint8_t>, const ldi::progress_listener&, auto&&) const {
        *called = true;
        return ldi::image<float>(1, 2, 1);
    }
    float quantization_step() const { return 1.0F; }
};

}  // namespace

TEST_CASE(
    "the result of clean_depth() leads to the same 3D photo as the photo and its depth, whether or not depth maps are kept") {
    const ldi::scenes::picture picture = ldi::scenes::render(ldi::scenes::scene_by_name("t_junction", 96, 72));
    const ldi::given_disparity depth{picture.disparity};
    const ldi::diffusion_inpainter inpainter;
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    const ldi::photo3d whole = ldi::make_photo3d(picture.color, depth, inpainter, options);
    options.keeps_depth_maps = GENERATE(true, false);
    const ldi::photo3d made =
        ldi::make_photo3d(ldi::clean_depth(picture.color, depth, options), ldi::photo_columns<>(), inpainter, options);
    CHECK(made.estimated.empty() == !options.keeps_depth_maps);
    CHECK(made.disparity.empty() == !options.keeps_depth_maps);
    CHECK(made.resampled.empty() == !options.keeps_depth_maps);
    CHECK(std::equal(made.mesh.positions.begin(), made.mesh.positions.end(), whole.mesh.positions.begin(),
                     whole.mesh.positions.end()));
    CHECK(std::equal(made.atlas.color.begin(), made.atlas.color.end(), whole.atlas.color.begin(), whole.atlas.color.end()));
}

TEST_CASE("cameras within the supported motion see no hole at a T-junction, and almost none in other scenes") {
    ldi::serial_executor threads;
    for (const auto& [name, most] : {std::pair{"t_junction", 0.0}, {"rods", 0.001}, {"random3", 0.0005}})
        for (const float motion : {0.03F, 0.08F}) {
            ldi::photo3d_options options;
            options.expand.motion = motion;
            const ldi_quality::extreme worst = ldi_quality::worst_extreme(convert(name, 240, 320, options).result, threads);
            INFO(name << ", motion " << motion << ": " << worst.where);
            CHECK(worst.uncovered <= most);
        }
}

TEST_CASE("seen from the photo's viewpoint, the 3D photo closely matches the photo") {
    for (const char* name : {"t_junction", "rods", "random3"}) {
        const converted c = convert(name, 240, 320);
        const ldi::rendering seen = ldi::rasterize(c.result.mesh, c.result.atlas.color,
                                                   ldi::moved_view(c.result.facts.camera, c.result.facts.range, 1.0F, 0.0F));
        INFO(name);
        CHECK(ldi::testing::psnr(seen.color, c.result.photo, 2) > 28.0);
        // Simplified silhouettes cut corners. At curves too short for hidden surfaces, nothing is behind these corners.
        CHECK(uncovered_share(c.result, 0.0F, 0.0F, 2) < 0.0002);
    }
}

TEST_CASE("seen from the side, the 3D photo of a scene is close to the scene itself") {
    const converted c = convert("t_junction", 240, 320);
    const ldi::view from = ldi::moved_view(c.result.facts.camera, c.result.facts.range, 1.0F, 12.0F);
    const ldi::rendering seen = ldi::rasterize(c.result.mesh, c.result.atlas.color, from);
    const ldi::scenes::picture truth = ldi::scenes::render(c.scene, from, ldi::scenes::picture_options{2, 0.7});
    CHECK(ldi::testing::psnr(seen.color, truth.color, 14) > 22.0);
}

TEST_CASE("all stages together produce a valid layered image without uncolored pixels") {
    for (const char* name : {"rods", "random1", "random2", "random5"}) {
        ldi::photo3d_options options;
        options.texture.strength = options.grain.strength = 0.0F;  // they may make a dark pixel black
        const converted c = convert(name, 150, 200, options);
        const ldi::graph& g = c.result.layers.topology();
        INFO(name);
        CHECK_FALSE(ldi::validate_canonical(g, c.result.layers.column<ldi::disparity_column>()));
        CHECK(c.result.charts.chart_of.size() == g.size());
        CHECK(c.result.mesh.triangle_count() > 0);
        // Unknown pixels are filled from their surroundings: none is as black as an unset pixel.
        for (std::size_t i = 0; i < g.size(); ++i) {
            const auto color = c.result.layers.at<ldi::color_column>(static_cast<std::int32_t>(i));
            REQUIRE(color[0] + color[1] + color[2] > 0);
        }
    }
}

TEST_CASE("texture and grain change only the colors of inpainted pixels") {
    const ldi::scenes::scene scene = ldi::scenes::scene_by_name("random4", 150, 200);
    ldi::scenes::picture picture = ldi::scenes::render(scene, ldi::scenes::picture_options{1, 0.5});
    std::mt19937 random(4);
    for (std::uint8_t& value : picture.color)
        value = static_cast<std::uint8_t>(std::clamp<int>(value + static_cast<int>(random() % 21) - 10, 0, 255));
    ldi::image<float> disparity = picture.disparity;
    for (float& value : disparity) value = std::clamp(value, 0.0F, 1.0F);
    const auto made = [&](float texture, float grain) {
        ldi::photo3d_options options;
        options.normalize.is_inverse_depth = false;
        options.texture.strength = texture;
        options.grain.strength = grain;
        return ldi::make_photo3d(picture.color, ldi::given_disparity{disparity}, ldi::diffusion_inpainter{}, options);
    };
    const ldi::photo3d without = made(0.0F, 0.0F);
    for (const ldi::photo3d& with : {made(1.0F, 0.0F), made(0.0F, 1.0F)}) {
        CHECK((with.mesh.positions == without.mesh.positions));
        std::size_t changed = 0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(with.layers.size()); ++i) {
            const bool differs =
                !std::ranges::equal(with.layers.at<ldi::color_column>(i), without.layers.at<ldi::color_column>(i));
            if (with.layers.column<ldi::known_column>()[static_cast<std::size_t>(i)] != 0) REQUIRE_FALSE(differs);
            changed += differs ? 1 : 0;
        }
        CHECK(changed > 100);
    }
}

TEST_CASE("if depth samples cover several pixels, specks of an object's color on the surface behind it are removed") {
    // A red object in front of a green wall, and red specks on the wall, up to 10 pixels from the object.
    std::mt19937 random(6);
    ldi::image<std::uint8_t> photo(160, 200, 3);
    for (std::size_t y = 0; y < photo.height(); ++y)
        for (std::size_t x = 0; x < photo.width(); ++x) photo(y, x, x >= 100 || (x >= 90 && random() % 5 == 0) ? 0 : 1) = 200;
    const auto red_on_wall = [&](std::size_t rows, std::size_t columns) {
        ldi::image<float> depth(rows, columns, 1, 0.2F);
        for (std::size_t y = 0; y < rows; ++y) std::fill(depth.row(y) + columns / 2, depth.row(y) + columns, 0.9F);
        const ldi::photo3d made = ldi::make_photo3d(photo, ldi::given_disparity{depth}, ldi::diffusion_inpainter{});
        int red = 0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(made.layers.size()); ++i) {
            const auto color = made.layers.at<ldi::color_column>(i);
            red += made.layers.at<ldi::disparity_column>(i)[0] < 0.5F && color[0] > color[1] ? 1 : 0;
        }
        return red;
    };
    CHECK(red_on_wall(40, 50) < 10);
    CHECK(red_on_wall(160, 200) > 100);
}

TEST_CASE("the number of threads does not change the result") {
    const ldi::scenes::scene scene = ldi::scenes::scene_by_name("random4", 150, 200);
    const ldi::scenes::picture picture = ldi::scenes::render(scene, ldi::scenes::picture_options{1, 0.5});
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    ldi::image<float> disparity = picture.disparity;
    for (float& value : disparity) value = std::clamp(value, 0.0F, 1.0F);
    const ldi::given_disparity estimator{disparity};
    const ldi::photo3d serial = ldi::make_photo3d(picture.color, estimator, ldi::diffusion_inpainter{}, options);
    for (std::size_t count : {2U, 5U}) {
        ldi::thread_pool threads(count);
        const ldi::photo3d parallel = ldi::make_photo3d(picture.color, estimator, ldi::diffusion_inpainter{}, options, threads);
        CHECK((parallel.mesh.positions == serial.mesh.positions));
        CHECK((parallel.mesh.triangles == serial.mesh.triangles));
        CHECK((parallel.atlas.color == serial.atlas.color));
    }
}

TEST_CASE("invalid options are refused") {
    const auto photo = ldi::image<std::uint8_t>(4, 6, 3, std::uint8_t{90});
    const ldi::given_disparity estimator{ldi::image<float>(2, 3, 1, 0.5F)};
    const auto is_refused = [&](auto&& change) {
        ldi::photo3d_options options;
        change(options);
        return ldi::testing::raised([&] { ldi::make_photo3d(photo, estimator, ldi::diffusion_inpainter{}, options); }) ==
               ldi::error_code::invalid_option;
    };
    CHECK_FALSE(is_refused([](ldi::photo3d_options&) {}));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.long_side = 0; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.focal_length_35mm = 0.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.normalize.max_step = 0.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.resample.color_sigma = 0.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.median.sigma = -1.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.expand.motion = -1.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.texture.strength = -1.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.grain.strength = -1.0F; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.grain.rounds = 0; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.passes_before_resampling = -1; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.passes_before_resampling = 65; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.charts.max_side = 0; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.atlas.padding.filter_padding = 0; }));
    CHECK(is_refused([](ldi::photo3d_options& o) { o.mesh.studs.spacing = 0; }));
    for (const int rounds : {-1, 0, 65})
        CHECK(ldi::testing::raised([&] { ldi::make_photo3d(photo, estimator, ldi::diffusion_inpainter{rounds}); }) ==
              ldi::error_code::invalid_option);
}

TEST_CASE("a photo with more than 65,535 pixels per side is refused before its depth is estimated, unless it is shrunk") {
    for (const auto& [rows, columns] : {std::pair<std::size_t, std::size_t>{1, 65536}, {65536, 1}}) {
        const auto photo = ldi::image<std::uint8_t>(rows, columns, 3, std::uint8_t{90});
        bool called = false;
        ldi::photo3d_options options;
        options.long_side = 65536;
        CHECK(ldi::testing::raised([&] {
                  ldi::make_photo3d(photo, watched_estimator{&called}, ldi::diffusion_inpainter{}, options);
              }) == ldi::error_code::too_large);
        CHECK_FALSE(called);
        // A photo of 65,535 pixels passes.
        const auto narrower =
            ldi::image<std::uint8_t>(std::min<std::size_t>(rows, 65535), std::min<std::size_t>(columns, 65535), 3);
        ldi::photo3d_options cropped = options;
        cropped.frame = ldi::photo_frame::crop;
        CHECK_FALSE(ldi::testing::raised([&] {
            ldi::make_photo3d(narrower, ldi::given_disparity{ldi::image<float>(1, 1, 1, 0.5F)}, ldi::diffusion_inpainter{},
                              cropped);
        }));
        options.long_side = 64;
        CHECK_FALSE(ldi::testing::raised([&] {
            ldi::make_photo3d(photo, ldi::given_disparity{ldi::image<float>(1, 1, 1, 0.5F)}, ldi::diffusion_inpainter{}, options);
        }));
    }
}

TEST_CASE("the smallest photos become 3D photos") {
    for (const auto& [rows, columns] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 7}, {9, 1}, {2, 2}, {3, 50}}) {
        const auto photo = ldi::image<std::uint8_t>(rows, columns, 3, std::uint8_t{90});
        const ldi::given_disparity estimator{ldi::image<float>(rows, columns, 1, 0.5F)};
        const ldi::photo3d result = ldi::make_photo3d(photo, estimator, ldi::diffusion_inpainter{});
        INFO(rows << " x " << columns);
        CHECK(result.mesh.triangle_count() >= 2);
        CHECK(result.layers.size() > rows * columns);
        CHECK(result.facts.margin > 0);
        ldi::photo3d_options cropped;
        cropped.frame = ldi::photo_frame::crop;
        const ldi::photo3d small = ldi::make_photo3d(photo, estimator, ldi::diffusion_inpainter{}, cropped);
        CHECK(small.layers.size() == rows * columns);
        CHECK(small.facts.margin == 0);
    }
}
