// Tests that 3D photos of ordinary photographs, with depth from the shipped network, have no holes. Slow.
#include <bench/quality/holes.hpp>

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/tiefenrausch_file.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <vector>

TEST_CASE("cameras within the supported motion see no hole in photographs") {
    const std::vector<std::filesystem::path> photographs = ldi_quality::forty_photographs();
    if (photographs.empty()) return;
    const ldi::tiefenrausch network = ldi::load_depth_network(LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors");
    ldi::photo3d_options options;
    options.texture.strength = options.grain.strength = 0;
    ldi::thread_pool threads;
    for (std::size_t i = 0; i < photographs.size(); i += 2) {
        const ldi::photo3d made =
            ldi::make_photo3d(ldi::load_photo(photographs[i]).color, network, ldi::diffusion_inpainter(), options, threads);
        const ldi_quality::hole_report report = ldi_quality::count_holes(made.mesh, made.facts, 1000, threads);
        CAPTURE(photographs[i], report.views_with_holes, report.max_pixels);
        CHECK(report.holes.empty());
    }
}
