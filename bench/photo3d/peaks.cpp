// Peak memory of each stage from photo to mesh, in bytes per pixel of the photo, for difficult depth maps
// (tests/support/hard_maps.hpp), from 16 x 12 samples up to the photo's size. Prints the tables of bench/photo3d/README.md.
//
//     ldi_bench_photo3d_peaks [WIDTH]  width of the photo (default: 1536); the height is 3 / 4 of the width
#include "tests/support/counted_memory.hpp"
#include "tests/support/hard_maps.hpp"
#include "tests/support/stage_peaks.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

/// Bytes per pixel of each stage, and the number of hidden pixels per pixel.
struct row {
    std::vector<double> peaks;
    double hidden = 0;

    void widen(const row& other) {
        peaks.resize(other.peaks.size(), 0);
        for (std::size_t i = 0; i < peaks.size(); ++i) peaks[i] = std::max(peaks[i], other.peaks[i]);
        hidden = std::max(hidden, other.hidden);
    }
    void print(const std::string& name) const {
        std::printf("| %s ", name.c_str());
        for (const double peak : peaks) std::printf("| %.0f ", peak);
        std::printf("| %.1f |\n", hidden);
    }
};

void print_header(const char* first, const std::vector<std::string>& stages) {
    std::printf("\n| %s ", first);
    for (const std::string& stage : stages) std::printf("| %s ", stage.c_str());
    std::printf("| hidden pixels |\n|---|");
    for (std::size_t i = 0; i <= stages.size(); ++i) std::printf("---|");
    std::printf("\n");
}

row measure(const ldi::image<std::uint8_t>& photo, const ldi::image<float>& map, std::vector<std::string>& stages) {
    ldi::testing::counted_memory own;
    ldi::testing::stage_peaks peaks(own);
    ldi::photo3d_options options;
    options.long_side = photo.width();
    options.progress = peaks.listener();
    const double pixels = static_cast<double>(photo.height() * photo.width());
    const ldi::memory_scope scope(own.source);
    const ldi::photo3d made = ldi::make_photo3d(photo, ldi::given_disparity{map}, ldi::diffusion_inpainter{}, options);
    row result;
    result.hidden = static_cast<double>(made.layers.size()) / pixels - 1;
    stages.clear();
    for (const auto& stage : peaks.stages) {
        stages.push_back(stage.name);
        result.peaks.push_back(static_cast<double>(stage.peak) / pixels);
    }
    return result;
}

}  // namespace

int main(int count, char** arguments) {
    const std::size_t width = count > 1 ? static_cast<std::size_t>(std::atoll(arguments[1])) : 1536, height = 3 * width / 4;
    const ldi::image<std::uint8_t> photo = ldi::testing::noisy_photo(height, width);
    std::vector<std::string> stages;
    std::vector<row> by_map(std::size(ldi::testing::hard_maps));
    std::vector<std::pair<std::string, row>> by_size;
    for (const std::size_t columns : {std::size_t{16}, std::size_t{96}, std::size_t{384}, width})
        for (const std::size_t unit : {std::size_t{1}, std::size_t{6}}) {
            if (columns < 8 * unit) continue;
            const std::size_t rows = 3 * columns / 4;
            by_size.emplace_back(std::to_string(columns) + " x " + std::to_string(rows) + ", " + std::to_string(unit), row());
            for (std::size_t m = 0; m < by_map.size(); ++m) {
                const row measured =
                    measure(photo, ldi::testing::hard_map(ldi::testing::hard_maps[m], rows, columns, unit), stages);
                by_map[m].widen(measured), by_size.back().second.widen(measured);
                std::fprintf(stderr, "%s, %s\n", by_size.back().first.c_str(), std::string(ldi::testing::hard_maps[m]).c_str());
            }
        }
    std::printf("Photo of %zu x %zu\n", width, height);
    print_header("size of the map, and width of its features, in samples", stages);
    for (const auto& [name, worst] : by_size) worst.print(name);
    print_header("map", stages);
    for (std::size_t m = 0; m < by_map.size(); ++m) by_map[m].print(std::string(ldi::testing::hard_maps[m]));
}
