// Ordinary photographs without known depth: the share of hidden pixels, and a strip of pictures of each for inspection.
#pragma once

#include "converter.hpp"
#include "estimated_views.hpp"
#include "holes.hpp"
#include "metrics.hpp"
#include "silhouettes.hpp"

#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace ldi_quality {

/// The 24 photographs of ../shared/photos/eval, and every 32nd of train, which the training of the networks holds out for
/// validation (VALIDATION_EVERY in data.py).
inline std::vector<std::filesystem::path> ordinary_photographs() { return photographs_of_shared(32); }

/// Converts values in [0, 1] to a gray picture.
inline picture shown(const ldi::image<float>& values) {
    picture result = ldi::image<std::uint8_t>(values.height(), values.width(), 3);
    for (std::size_t i = 0; i < values.size(); ++i)
        std::fill_n(result.data() + 3 * i, 3, static_cast<std::uint8_t>(255 * std::clamp(values.data()[i], 0.0F, 1.0F)));
    return result;
}

/// Combines pictures side by side, resized to the same height.
template <ldi::executor Executor>
picture side_by_side(const std::vector<picture>& pictures, std::size_t rows, Executor& threads) {
    std::vector<picture> parts;
    std::size_t columns = 0;
    for (const picture& p : pictures) {
        parts.push_back(ldi::area_resize(p, rows, p.width() * rows / p.height(), threads));
        columns += parts.back().width();
    }
    picture result = ldi::image<std::uint8_t>(rows, columns, 3);
    for (std::size_t y = 0; y < rows; ++y) {
        std::uint8_t* to = result.row(y);
        for (const picture& p : parts) to = std::copy_n(p.row(y), 3 * p.width(), to);
    }
    return result;
}

/// Prints for each network the number of photographs without hidden pixels, the median share of hidden pixels, and the mean
/// share of closed discontinuities. Writes a strip for every photograph: the photo, the depth of each network, and the last
/// network's 3D photo from the right.
template <ldi::executor Executor>
void print_photographs(const std::vector<named_network>& networks, const converter& convert, const std::filesystem::path& folder,
                       Executor& threads) {
    const std::vector<std::filesystem::path> files = ordinary_photographs();
    if (files.empty()) return;
    ldi::photo3d_options options;
    options.long_side = 768;
    ldi::buffer<ldi::buffer<double>> hidden(networks.size()), closed(networks.size());
    for (const std::filesystem::path& file : files) {
        const picture photo = ldi::load_photo(file).color;
        std::vector<picture> strip{photo};
        for (std::size_t i = 0; i < networks.size(); ++i) {
            const ldi::photo3d made = convert(photo, networks[i].second, ldi::diffusion_inpainter(), options, threads);
            const double seen = static_cast<double>(made.photo.size()) / 3;
            hidden[i].push_back(static_cast<double>(made.layers.size()) / seen - 1);
            closed[i].push_back(share_closed(made.photo, made.disparity, made.curves, options.surface));
            strip.push_back(shown(made.disparity));
            if (i + 1 < networks.size()) continue;
            const float movement = 0.04F * static_cast<float>(std::max(made.facts.camera.width, made.facts.camera.height));
            const ldi::view beside = ldi::moved_view(made.facts.camera, made.facts.range, 1, -movement);
            strip.push_back(ldi::rasterize(made.mesh, made.atlas.color, beside, {}, threads).color);
        }
        ldi::save_png(folder / ("photograph_" + file.stem().string() + ".png"), side_by_side(strip, 288, threads));
    }
    std::printf(
        "\n### %zu photographs of any kind\n\n| network | photographs without hidden pixels | hidden pixels, median share "
        "| discontinuities closed |\n|---|---|---|---|\n",
        files.size());
    for (std::size_t i = 0; i < networks.size(); ++i) {
        const auto none = std::count(hidden[i].begin(), hidden[i].end(), 0.0);
        std::printf("| %s | %td (%.0f %%) | %.1f %% | %.1f %% |\n", networks[i].first.c_str(), none,
                    100 * static_cast<double>(none) / static_cast<double>(files.size()), 100 * median(hidden[i]),
                    100 * mean(closed[i]));
    }
    std::fflush(stdout);
}

}  // namespace ldi_quality
