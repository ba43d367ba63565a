// Memory of the whole conversion on difficult depth maps, from 16 x 12 samples up to the photo's size. Two counts are bounded:
// bytes in use at any time during each stage, and bytes ever allocated. Queues are part of this memory, so a pixel that is
// visited many times increases the second count.
#include "tests/support/counted_memory.hpp"
#include "tests/support/hard_maps.hpp"
#include "tests/support/stage_peaks.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

namespace {

/// Maximum bytes in a stage, including the results of earlier stages: per pixel of the photo and per hidden pixel behind it.
struct bound {
    const char* stage;
    double per_pixel, per_hidden_pixel;
};
constexpr bound bounds[] = {
    {"depth estimation", 20, 0},     {"depth filter", 120, 0},       {"connected components", 90, 0},
    {"occluded geometry", 200, 160}, {"color inpainting", 180, 230}, {"chart generation", 70, 110},
    {"chart padding", 180, 210},     {"meshing", 140, 280},
};

/// Width of a depth map and of its features, in samples, for a photo 128 pixels wide.
constexpr std::pair<std::size_t, std::size_t> map_sizes[] = {{16, 1}, {32, 1}, {64, 4}, {128, 1}, {128, 6}};

struct cost {
    std::vector<ldi::testing::stage_peaks::stage> stages;
    double pixels = 0, hidden = 0, charts = 0, sides = 0, dropped_sides = 0, motion = 0;

    double hidden_per_pixel() const { return hidden / pixels; }
    /// Allocated bytes per pixel of the layers.
    double allocated_per_pixel() const {
        double sum = 0;
        for (const auto& stage : stages) sum += static_cast<double>(stage.allocated);
        return sum / (pixels + hidden);
    }
    double peak_per_pixel() const {
        std::size_t peak = 0;
        for (const auto& stage : stages) peak = std::max(peak, stage.peak);
        return static_cast<double>(peak) / (pixels + hidden);
    }
};

cost cost_of(std::string_view name, std::size_t photo_columns, std::size_t columns, std::size_t unit) {
    const std::size_t photo_rows = 3 * photo_columns / 4;
    const ldi::image<std::uint8_t> photo = ldi::testing::noisy_photo(photo_rows, photo_columns);
    ldi::testing::counted_memory own;
    own.limit = 4000 * photo_rows * photo_columns + (std::size_t{1} << 21);
    ldi::testing::stage_peaks peaks(own);
    ldi::photo3d_options options;
    options.progress = peaks.listener();
    cost result;
    const ldi::memory_scope scope(own.source);
    const ldi::given_disparity depth{ldi::testing::hard_map(name, 3 * columns / 4, columns, unit)};
    const ldi::photo3d made = ldi::make_photo3d(photo, depth, ldi::diffusion_inpainter{}, options);
    result.stages = peaks.stages;
    result.pixels = static_cast<double>(photo_rows * photo_columns);
    result.hidden = static_cast<double>(made.layers.size()) - result.pixels;
    result.charts = static_cast<double>(made.charts.charts.size());
    result.dropped_sides = static_cast<double>(made.dropped_sides), result.motion = double{made.facts.motion};
    for (const ldi::discontinuity_curve& curve : made.curves) result.sides += static_cast<double>(curve.sides.size());
    return result;
}

}  // namespace

TEST_CASE("on difficult depth maps, silhouettes, hidden pixels, charts and the memory of each stage are bounded per pixel") {
    for (const std::string_view name : ldi::testing::hard_maps)
        for (const auto& [columns, unit] : map_sizes) {
            const cost c = cost_of(name, 128, columns, unit);
            REQUIRE(c.stages.size() == std::size(bounds));
            CAPTURE(name, columns, unit, c.sides, c.hidden, c.charts);
            CHECK(c.sides <= ldi::curve_options().max_density * c.pixels);
            CHECK(c.hidden_per_pixel() < 1.5);   // max_hidden plus surfaces past the frame; without the limit, noise had 7
            CHECK(c.charts < 0.025 * c.pixels);  // without limits, noise had 0.25
            for (std::size_t i = 0; i < c.stages.size(); ++i) {
                CAPTURE(name, columns, unit, c.stages[i].name, c.hidden_per_pixel());
                REQUIRE(c.stages[i].name == bounds[i].stage);
                CHECK(static_cast<double>(c.stages[i].peak) / c.pixels <
                      bounds[i].per_pixel + bounds[i].per_hidden_pixel * c.hidden_per_pixel());
            }
        }
}

TEST_CASE(
    "a 3D photo reports exceeded limits: noise exceeds the limit on silhouettes, stairs exceed the limit on hidden surfaces, and "
    "a ramp exceeds neither") {
    constexpr double motion = double{ldi::expand_options().motion};
    const cost noise = cost_of("noise", 128, 128, 1), stairs = cost_of("stairs", 256, 256, 2),
               ramp = cost_of("ramp", 128, 128, 1);
    CHECK(noise.dropped_sides > ldi::curve_options().max_density * noise.pixels);
    CHECK(stairs.motion < 0.9 * motion);
    CHECK(ramp.dropped_sides == 0);
    CHECK(ramp.motion == motion);
}

TEST_CASE("on a photo with four times the pixels, peak and total memory per pixel of all layers grow by less than 25 %") {
    for (const std::string_view name : {"ramp", "checkerboard", "spiral", "stairs", "noise"})
        for (const auto& [columns, unit] : {map_sizes[0], map_sizes[2], map_sizes[3]}) {
            CAPTURE(name, columns, unit);
            const cost small = cost_of(name, 128, columns, unit), large = cost_of(name, 256, 2 * columns, unit);
            // A hidden pixel costs more than a pixel of the photo, and the larger photo may have a larger share of hidden
            // pixels.
            const double growth = (1 + large.hidden_per_pixel()) / (1 + small.hidden_per_pixel());
            CHECK(large.allocated_per_pixel() < 1.25 * growth * small.allocated_per_pixel());
            CHECK(large.peak_per_pixel() < 1.25 * growth * small.peak_per_pixel());
        }
}

TEST_CASE("tiny and narrow photos need at most 1 MiB with depth maps of any size") {
    for (const auto& [rows, columns] :
         {std::pair<std::size_t, std::size_t>{1, 1}, {1, 2}, {2, 2}, {1, 60}, {60, 1}, {3, 5}, {17, 16}})
        for (const auto& [map_rows, map_columns] :
             {std::pair<std::size_t, std::size_t>{1, 1}, {1, 40}, {40, 1}, {12, 16}, {60, 60}})
            for (const std::string_view name : {"flat", "checkerboard", "noise"}) {
                CAPTURE(name, rows, columns, map_rows, map_columns);
                ldi::testing::counted_memory own;
                own.limit = 1 << 20;
                const ldi::memory_scope scope(own.source);
                const ldi::given_disparity depth{ldi::testing::hard_map(name, map_rows, map_columns, 1)};
                const ldi::photo3d made =
                    ldi::make_photo3d(ldi::testing::noisy_photo(rows, columns), depth, ldi::diffusion_inpainter{});
                CHECK(made.mesh.triangle_count() >= 2);
            }
}
