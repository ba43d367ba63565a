// Novel views from a photo alone: the right photograph of a stereo pair, predicted from the left one with estimated depth, with
// the true depth, and without depth.
#pragma once

#include "converter.hpp"
#include "depth_metrics.hpp"
#include "metrics.hpp"
#include "picture_quality.hpp"
#include "subjects.hpp"
#include "views.hpp"

#include <ldi/io/picture.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

using named_network = std::pair<std::string, ldi::tiefenrausch>;

/// Quality of the predictions of one pair: with each network's depth, then with a flat plane, then with the true depth.
struct estimated_view {
    std::string name;
    std::vector<quality> whole;  ///< over the frame
};

/// Aligns a network's disparity with the truth by scale and shift, and keeps it above 0.
///
/// truth  H x W x 1, inverse depth, above 0; the result is h x w x 1 at the network's size
inline ldi::image<float> aligned_estimate(const ldi::image<float>& estimate, const ldi::image<float>& truth) {
    const std::size_t rows = estimate.height(), columns = estimate.width();
    const map true_here = resized(truth, rows, columns);
    const pixel_set known = ldi::image<std::uint8_t>(rows, columns, 1, std::uint8_t{1});
    const map fitted = aligned(resized(estimate, rows, columns), true_here, known);
    const double least = *std::min_element(true_here.begin(), true_here.end()) / 2;
    ldi::image<float> result(rows, columns);
    std::transform(fitted.begin(), fitted.end(), result.begin(),
                   [&](double d) { return static_cast<float>(std::max(d, least)); });
    return result;
}

template <ldi::executor Executor>
estimated_view measure_estimated_view(const subject& s, const std::vector<named_network>& networks, const converter& convert,
                                      const ldi::farbrausch& inpainter, const lpips_network& perceived,
                                      const std::filesystem::path& folder, Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const mask frame = frame_of(s);
    const int needed = static_cast<int>(std::ceil(s.parallax())) + 2;
    estimated_view result{s.name, {}};
    const auto add = [&](const std::string& name, const ldi::image<float>& inverse_depth) {
        const ldi::photo3d made =
            convert(s.photo, ldi::given_disparity{inverse_depth}, inpainter, true_depth_options(s, needed), threads);
        const picture seen = ldi::rasterize(made.mesh, made.atlas.color, s.other, raster, threads).color;
        result.whole.push_back(measure(seen, s.seen, frame, perceived));
        ldi::save_png(folder / ("estimated_" + s.name + "_" + name + ".png"), seen);
    };
    for (const auto& [name, network] : networks)
        add(name, aligned_estimate(network.disparity(s.photo, {}, threads), s.inverse_depth));
    ldi::buffer<double> values(s.inverse_depth.begin(), s.inverse_depth.end());
    add("flat", ldi::image<float>(1, 1, 1, static_cast<float>(median(values))));
    add("true", s.inverse_depth);
    return result;
}

/// Prints the table, and for each network, its share of the improvement in mean PSNR from the flat plane to the true depth.
inline void print_estimated_views(const std::vector<named_network>& networks, const std::vector<estimated_view>& rows) {
    std::printf(
        "\n### Stereo pairs from the left photograph alone\n\nPSNR in dB / SSIM / LPIPS over the frame of the right one.\n\n| "
        "pair |");
    for (const auto& network : networks) std::printf(" %s |", network.first.c_str());
    std::printf(" flat plane | true depth |\n|---|");
    const std::size_t count = networks.size() + 2;
    for (std::size_t i = 0; i < count; ++i) std::printf("---|");
    std::printf("\n");
    std::vector<quality> average(count);
    const auto print = [](const quality& q) { std::printf(" %.2f / %.4f / %.3f |", q.psnr, q.ssim, q.lpips); };
    for (const estimated_view& v : rows) {
        std::printf("| %s |", v.name.c_str());
        for (std::size_t i = 0; i < count; ++i) {
            print(v.whole[i]);
            average[i].add(v.whole[i], 1 / static_cast<double>(rows.size()));
        }
        std::printf("\n");
    }
    std::printf("| **mean** |");
    for (const quality& q : average) print(q);
    std::printf("\n| improvement, from 0 %% for the flat plane to 100 %% for the true depth |");
    const double flat = average[count - 2].psnr, whole_way = average[count - 1].psnr - flat;
    for (std::size_t i = 0; i < networks.size(); ++i) std::printf(" %.0f %% |", 100 * (average[i].psnr - flat) / whole_way);
    std::printf(" 0 %% | 100 %% |\n");
}

}  // namespace ldi_quality
