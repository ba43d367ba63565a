// Novel views: 3D photos from photo and true depth, compared with another photograph from its viewpoint.
#pragma once

#include "converter.hpp"
#include "degraded_depth.hpp"
#include "extremes.hpp"
#include "metrics.hpp"
#include "picture_quality.hpp"
#include "subjects.hpp"
#include "views.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace ldi_quality {

enum method : std::size_t { no_expansion, by_diffusion, by_network, with_texture, in_screen_space, method_count };

struct novel_view {
    std::string name;
    double disoccluded = 0;                      ///< share of the frame that is uncovered without expansion
    double uncovered = 0;                        ///< share that remains uncovered with the expansion that this pair requires
    extreme worst;                               ///< uncovered share at the worst position that the default motion allows
    extreme worst_degraded;                      ///< the same with degraded depth
    std::array<quality, method_count> whole{};   ///< over the frame
    std::array<quality, method_count> inside{};  ///< where nothing is visible without expansion
};

template <ldi::executor Executor>
novel_view measure_novel_view(const subject& s, const converter& convert, const ldi::farbrausch& network,
                              const lpips_network& perceived, const std::filesystem::path& folder, Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const auto make = [&](const ldi::image<float>& depth, const auto& inpainter, const ldi::photo3d_options& options) {
        return convert(s.photo, ldi::given_disparity{depth}, inpainter, options, threads);
    };
    const auto render = [&](const auto& inpainter, int iterations) {
        const ldi::photo3d made = make(s.inverse_depth, inpainter, true_depth_options(s, iterations));
        return ldi::rasterize(made.mesh, made.atlas.color, s.other, raster, threads);
    };
    const int needed = static_cast<int>(std::ceil(s.parallax())) + 2;
    const ldi::rendering none = render(network, 0), diffused = render(ldi::diffusion_inpainter(), needed),
                         expanded = render(network, needed), detailed = render(textured<ldi::farbrausch>{network}, needed);
    const std::array<picture, method_count> results{none.color, diffused.color, expanded.color, detailed.color,
                                                    network.inpaint(none.color, none.coverage, {}, threads)};

    novel_view result;
    result.name = s.name;
    const mask frame = frame_of(s);
    const auto holes = [&](const ldi::rendering& r) {
        mask m = frame;
        for (std::size_t i = 0; i < m.size(); ++i) m.data()[i] = frame.data()[i] != 0 && r.coverage.data()[i] == 0 ? 1 : 0;
        return m;
    };
    const mask hole = holes(none);
    result.disoccluded = share(hole) / share(frame);
    result.uncovered = share(holes(expanded)) / share(frame);
    ldi::photo3d_options as_by_default = true_depth_options(s, ldi::expand_options().iterations);
    as_by_default.expand.motion = ldi::expand_options().motion;
    const auto worst_with = [&](const ldi::image<float>& depth) {
        return worst_extreme(make(depth, ldi::diffusion_inpainter(), as_by_default), threads);
    };
    result.worst = worst_with(s.inverse_depth), result.worst_degraded = worst_with(degraded(s.inverse_depth));
    for (std::size_t m = 0; m < method_count; ++m) {
        result.whole[m] = measure(results[m], s.seen, frame, perceived);
        result.inside[m] = measure(results[m], s.seen, hole, perceived);
    }
    const char* names[] = {"none", "diffusion", "farbrausch", "texture", "screen_space"};
    for (std::size_t m = 0; m < method_count; ++m)
        ldi::save_png(folder / ("view_" + s.name + "_" + names[m] + ".png"), results[m]);
    ldi::save_png(folder / ("view_" + s.name + "_truth.png"), s.seen);
    return result;
}

inline novel_view mean_of(const std::vector<novel_view>& rows) {
    novel_view average;
    average.name = "**mean**";
    const double part = 1.0 / static_cast<double>(rows.size());
    for (const novel_view& v : rows) {
        average.disoccluded += part * v.disoccluded, average.uncovered += part * v.uncovered;
        average.worst.uncovered += part * v.worst.uncovered;
        average.worst_degraded.uncovered += part * v.worst_degraded.uncovered;
        for (std::size_t m = 0; m < method_count; ++m) {
            average.whole[m].add(v.whole[m], part);
            average.inside[m].add(v.inside[m], part);
        }
    }
    return average;
}

inline void print_novel_views(const char* title, const std::vector<novel_view>& rows) {
    std::printf("\n### Novel views: %s\n\n", title);
    std::printf("PSNR in dB over the frame / inside the areas that the photo did not see; shares of the frame.\n\n");
    std::printf(
        "| picture | not seen by the photo | no expansion | diffusion | Farbrausch | with texture | in screen space | uncovered "
        "| uncovered at the "
        "worst position of the default motion | with degraded depth |\n|---|---|---|---|---|---|---|---|---|---|\n");
    const auto line = [](const novel_view& v) {
        std::printf("| %s | %.2f %% |", v.name.c_str(), 100 * v.disoccluded);
        for (std::size_t m = 0; m < method_count; ++m) std::printf(" %.2f / %.2f |", v.whole[m].psnr, v.inside[m].psnr);
        std::printf(" %.3f %% | %.3f %% %s | %.3f %% %s |\n", 100 * v.uncovered, 100 * v.worst.uncovered, v.worst.where.c_str(),
                    100 * v.worst_degraded.uncovered, v.worst_degraded.where.c_str());
    };
    for (const novel_view& v : rows) line(v);
    const novel_view average = mean_of(rows);
    line(average);
    const auto means = [&](const char* name, double quality::*value) {
        std::printf("| mean %s | |", name);
        for (std::size_t m = 0; m < method_count; ++m)
            std::printf(" %.4f / %.4f |", average.whole[m].*value, average.inside[m].*value);
        std::printf(" | | |\n");
    };
    means("SSIM", &quality::ssim), means("LPIPS", &quality::lpips);
}

}  // namespace ldi_quality
