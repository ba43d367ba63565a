// Peak memory of every stage from photo to mesh, in bytes per pixel of the photo, on depth maps that are as hard as can be
// (tests/support/hard_maps.hpp), coarse and fine.
//
//     ldi_bench_photo3d_peaks [WIDTH HEIGHT [MAP WIDTH HEIGHT UNIT]]
#include "tests/support/counted_memory.hpp"
#include "tests/support/hard_maps.hpp"
#include "tests/support/stage_peaks.hpp"

#include <ldi/occlusion/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

void measure(const ldi::image<std::uint8_t>& photo, std::string_view name, std::size_t rows, std::size_t columns,
             std::size_t unit) {
    ldi::testing::counted_memory own;
    ldi::testing::stage_peaks peaks(own);
    ldi::photo3d_options options;
    options.long_side = std::max(photo.height(), photo.width());
    options.progress = peaks.listener();
    const double pixels = static_cast<double>(photo.height() * photo.width());
    std::printf("%-13s %4zu x %-4zu %2zu ", std::string(name).c_str(), columns, rows, unit);
    std::fflush(stdout);
    const auto start = std::chrono::steady_clock::now();
    std::string found;
    std::size_t hidden = 0, curves = 0, charts = 0, triangles = 0;
    try {
        const ldi::memory_scope scope(own.source);
        const ldi::photo3d made = ldi::make_photo3d(photo, ldi::given_disparity{ldi::test::hard_map(name, rows, columns, unit)},
                                                    ldi::diffusion_inpainter{}, options);
        hidden = made.layers.size() - photo.height() * photo.width(), curves = made.curves.size(),
        charts = made.charts.charts.size(), triangles = made.mesh.triangle_count();
    } catch (const ldi::error& e) {
        found = e.what();
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    for (const auto& stage : peaks.stages) std::printf("%6.0f", static_cast<double>(stage.peak) / pixels);
    std::printf("  %6.2f us/px  hidden %.2f curves %zu charts %zu triangles %zu  %s\n", taken.count() * 1e6 / pixels,
                static_cast<double>(hidden) / pixels, curves, charts, triangles, found.c_str());
}

}  // namespace

int main(int count, char** arguments) {
    const auto number = [&](int i, std::size_t otherwise) {
        return i < count ? static_cast<std::size_t>(std::atoll(arguments[i])) : otherwise;
    };
    const ldi::image<std::uint8_t> photo = ldi::test::noisy_photo(number(2, 576), number(1, 768));
    if (count > 3) {
        measure(photo, arguments[3], number(5, 72), number(4, 96), number(6, 1));
        return 0;
    }
    for (const std::string_view name : ldi::test::hard_maps) {
        for (std::size_t columns = 16; columns <= photo.width(); columns *= 4)
            for (const std::size_t unit : {std::size_t{1}, std::size_t{6}})
                if (3 * unit < columns) measure(photo, name, columns * photo.height() / photo.width(), columns, unit);
        for (const std::size_t unit : {std::size_t{1}, std::size_t{6}, std::size_t{24}})
            measure(photo, name, photo.height(), photo.width(), unit);
    }
}
