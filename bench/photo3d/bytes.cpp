// Measures the bytes that each stage allocates for the shipped sample, and the peak during the stage, both per pixel of the
// photo. The inpainting network runs in 8 bits. A stage writes at least what it allocates. Prints the measured columns of the
// table "Budget of bytes" in bench/photo3d/README.md.
#include "tests/support/counted_memory.hpp"
#include "tests/support/stage_peaks.hpp"

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/photo3d.hpp>

#include <cstdio>
#include <filesystem>

int main() {
    const std::filesystem::path root = LDI_SOURCE_DIR, sample = root / "examples/photo3d";
    const ldi::image<std::uint8_t> photo = ldi::load_photo(sample / "sample.jpg").color;
    const ldi::given_disparity depth{ldi::fill_invalid(ldi::load_depth_map(sample / "sample_depth.png"))};
    const ldi::farbrausch inpainter =
        ldi::load_farbrausch(root / "examples/models/farbrausch.safetensors", ldi::arithmetic::int8);
    ldi::testing::counted_memory own;
    ldi::testing::stage_peaks peaks(own);
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    options.progress = peaks.listener();
    const ldi::memory_scope scope(own.source);
    const ldi::photo3d made = ldi::make_photo3d(photo, depth, inpainter, options);
    const double pixels = static_cast<double>(photo.height() * photo.width());
    std::printf("%.1f %% hidden\n\n| stage | allocated | peak |\n|---|---|---|\n",
                100 * (static_cast<double>(made.layers.size()) / pixels - 1));
    for (const auto& stage : peaks.stages)
        std::printf("| %s | %.0f | %.0f |\n", stage.name.c_str(), static_cast<double>(stage.allocated) / pixels,
                    static_cast<double>(stage.peak) / pixels);
}
