// Novel views: photo and true depth to a 3D photo, seen from where there is another photograph.
#pragma once

#include "extremes.hpp"
#include "metrics.hpp"
#include "subjects.hpp"

#include <ldi/adapt/eigen.hpp>
#include <ldi/formats/picture.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/occlusion/diffusion_inpainter.hpp>
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

enum method : std::size_t { no_expansion, by_diffusion, by_network, in_screen_space, method_count };

struct novel_view {
    std::string name;
    double disoccluded = 0;                      ///< share of the frame that shows nothing without expansion
    double uncovered = 0;                        ///< with expansion as far as this pair needs
    extreme worst;                               ///< with the default motion, at the worst of all places where the camera may go
    std::array<quality, method_count> whole{};   ///< over the frame
    std::array<quality, method_count> inside{};  ///< where it shows nothing without expansion
};

/// 3D photo options for the truth: the photo as large as it is, no depth clipped, and surfaces grown by `iterations`.
inline ldi::photo3d_options true_depth_options(const subject& s, int iterations) {
    ldi::photo3d_options options;
    options.focal_length_35mm = s.camera.focal_length / ldi::focal_length_from_35mm(1, s.camera.width, s.camera.height);
    options.normalize.is_metric = true;
    options.normalize.clipped_share = 0;
    options.normalize.largest_depth_ratio = 1e6F;
    options.expand.motion = 1;
    options.expand.iterations = iterations;
    options.grain.strength = 0;  // fills are compared, and grain would cost each of them the same
    return options;
}

/// Where the other view shows what the photo's picture reaches to, whatever its depth: what a frame leaves in sight.
inline mask frame_of(const subject& s) {
    const ldi::depth_range range = s.range();
    const Eigen::Isometry3f to_photo = ldi::pose(s.other);
    mask result = ldi::image<std::uint8_t>(s.photo.height(), s.photo.width());
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x) {
            bool inside = true;
            for (const float depth : {range.z_near, range.z_far}) {  // of what the other camera sees here
                const std::array<float, 3> seen =
                    s.other.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, depth);
                const Eigen::Vector3f point = to_photo * Eigen::Map<const Eigen::Vector3f>(seen.data());
                const auto [u, v] = s.camera.project({point.x(), point.y(), point.z()});
                inside = inside && u >= 1 && u <= static_cast<float>(s.camera.width) - 1 && v >= 0 &&
                         v <= static_cast<float>(s.camera.height);
            }
            result(y, x, 0) = inside ? 1 : 0;
        }
    return result;
}

template <ldi::executor Executor>
novel_view measure_novel_view(const subject& s, const ldi::farbrausch& network, const std::filesystem::path& folder,
                              Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const auto make = [&](const auto& inpainter, const ldi::photo3d_options& options) {
        return ldi::make_photo3d(s.photo, ldi::given_disparity{s.inverse_depth}, inpainter, options, threads);
    };
    const auto render = [&](const auto& inpainter, int iterations) {
        const ldi::photo3d made = make(inpainter, true_depth_options(s, iterations));
        return ldi::rasterize(made.mesh, made.atlas.color, s.other, raster, threads);
    };
    const int needed = static_cast<int>(std::ceil(s.parallax())) + 2;
    const ldi::rendering none = render(network, 0), diffused = render(ldi::diffusion_inpainter(), needed),
                         expanded = render(network, needed);
    const std::array<picture, method_count> results{none.color, diffused.color, expanded.color,
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
    result.worst = worst_extreme(make(ldi::diffusion_inpainter(), as_by_default), threads);
    for (std::size_t m = 0; m < method_count; ++m) {
        result.whole[m] = measure(results[m], s.seen, frame);
        result.inside[m] = measure(results[m], s.seen, hole);
    }
    const char* names[] = {"none", "diffusion", "farbrausch", "screen_space"};
    for (std::size_t m = 0; m < method_count; ++m)
        ldi::save_png(folder / ("view_" + s.name + "_" + names[m] + ".png"), results[m]);
    ldi::save_png(folder / ("view_" + s.name + "_truth.png"), s.seen);
    return result;
}

inline void print_novel_views(const char* title, const std::vector<novel_view>& rows) {
    std::printf("\n### Novel views: %s\n\n", title);
    std::printf("PSNR in dB over the frame / inside what the photo did not see; shares of the frame.\n\n");
    std::printf(
        "| picture | not seen by the photo | no expansion | diffusion | Farbrausch | in screen space | uncovered | at the "
        "worst place of the default motion |\n|---|---|---|---|---|---|---|---|\n");
    const auto line = [](const novel_view& v) {
        std::printf("| %s | %.2f %% |", v.name.c_str(), 100 * v.disoccluded);
        for (std::size_t m = 0; m < method_count; ++m) std::printf(" %.2f / %.2f |", v.whole[m].psnr, v.inside[m].psnr);
        std::printf(" %.3f %% | %.3f %% %s |\n", 100 * v.uncovered, 100 * v.worst.uncovered, v.worst.where.c_str());
    };
    novel_view average;
    average.name = "**mean**";
    const double part = 1.0 / static_cast<double>(rows.size());
    for (const novel_view& v : rows) {
        line(v);
        average.disoccluded += part * v.disoccluded;
        average.uncovered += part * v.uncovered, average.worst.uncovered += part * v.worst.uncovered;
        for (std::size_t m = 0; m < method_count; ++m) {
            average.whole[m].psnr += part * v.whole[m].psnr, average.whole[m].ssim += part * v.whole[m].ssim;
            average.inside[m].psnr += part * v.inside[m].psnr, average.inside[m].ssim += part * v.inside[m].ssim;
        }
    }
    line(average);
    std::printf("| mean SSIM | |");
    for (std::size_t m = 0; m < method_count; ++m) std::printf(" %.4f / %.4f |", average.whole[m].ssim, average.inside[m].ssim);
    std::printf(" | |\n");
}

}  // namespace ldi_quality
