// Tests that 3D photos of ordinary photographs have no holes, with depth from the shipped network or from a depth map. Slow.
#include <bench/quality/holes.hpp>

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/weight_files.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <vector>

namespace {

// Converts photographs with the shipped network's depth, and counts holes in all allowed views.
void require_no_holes(const std::vector<std::filesystem::path>& photographs) {
    const ldi::tiefenrausch network = ldi::load_depth_network(LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors");
    ldi::photo3d_options options;
    options.texture.strength = options.grain.strength = 0;
    ldi::thread_pool threads;
    for (const std::filesystem::path& photograph : photographs) {
        const ldi::photo3d made =
            ldi::make_photo3d(ldi::load_photo(photograph).color, network, ldi::diffusion_inpainter(), options, threads);
        const ldi_quality::hole_report report = ldi_quality::count_holes(made.mesh, made.facts, 1000, threads);
        CAPTURE(photograph, report.views_with_holes, report.max_pixels);
        CHECK(report.holes.empty());
    }
}

}  // namespace

TEST_CASE("cameras within the supported motion see no hole in the sample with its depth map") {
    const std::filesystem::path folder = LDI_SOURCE_DIR "/examples/photo3d";
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    options.texture.strength = options.grain.strength = 0;
    ldi::thread_pool threads;
    const ldi::photo3d made = ldi::make_photo3d(ldi::load_photo(folder / "sample.jpg").color,
                                                ldi::given_disparity{ldi::load_depth_map(folder / "sample_depth.png")},
                                                ldi::diffusion_inpainter(), options, threads);
    const ldi_quality::hole_report report = ldi_quality::count_holes(made.mesh, made.facts, 1000, threads);
    CAPTURE(report.views_with_holes, report.max_pixels);
    CHECK(report.holes.empty());
}

TEST_CASE("cameras within the supported motion see no hole in photographs") {
    const std::vector<std::filesystem::path> all = ldi_quality::forty_photographs();
    std::vector<std::filesystem::path> photographs;
    for (std::size_t i = 0; i < all.size(); i += 5) photographs.push_back(all[i]);
    require_no_holes(photographs);
}

// The forty photographs are smaller than the default geometry. Larger photographs have more uncovered pixels.
TEST_CASE("cameras within the supported motion see no hole in photographs of at least the default geometry size") {
    std::vector<std::filesystem::path> photographs{LDI_SOURCE_DIR "/examples/photo3d/sample.jpg"};
    const std::filesystem::path phone = LDI_SHARED_DIR "/depth_companions/iphone_mpo_a.jpg";
    if (std::filesystem::exists(phone))
        photographs.push_back(phone);
    else
        std::printf("skipped: there is no %s\n", phone.c_str());
    require_no_holes(photographs);
}
