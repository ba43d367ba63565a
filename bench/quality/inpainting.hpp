// The paper's measure of inpainting (section "Results", "Inpainting"). Lifts the photo to one layer, and converts it to the
// layers of another camera. The pixels behind the first layer are hidden from that camera, and are inpainted. All of them are
// visible from the photo's camera, and are compared with the photo. Inpainting in screen space instead fills the holes that
// the first layer leaves in the photo's view.
#pragma once

#include "metrics.hpp"
#include "micro_polygons.hpp"
#include "peel.hpp"
#include "picture_quality.hpp"
#include "subjects.hpp"
#include "views.hpp"

#include <examples/photo3d/stage_pictures.hpp>

#include <ldi/core/components.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/weighted_median.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>

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

/// Results of one inpainting method.
struct inpainted {
    double layered = 0;     ///< PSNR over all pixels of the layered image, hidden or not
    double hidden = 0;      ///< PSNR over the hidden pixels
    quality whole, inside;  ///< reprojected and compared with the photo: everywhere, and at inpainted pixels
};

struct inpainting_result {
    std::string name;
    double inpainted_share = 0;  ///< share of the photo
    double cut_off = 0;          ///< share of the hidden pixels that no chain of links connects with a known pixel
    inpainted network, with_texture, diffusion, network_in_screen_space, diffusion_in_screen_space, truth;
};

/// Runs the network or diffusion on a picture with all pixels linked.
template <class Inpainter, ldi::executor Executor>
picture inpaint_picture(const Inpainter& inpainter, const ldi::rendering& r, Executor& threads) {
    ldi::photo_layers grid(
        ldi::make_grid(static_cast<std::int32_t>(r.color.width()), static_cast<std::int32_t>(r.color.height())));
    std::copy(r.color.begin(), r.color.end(), grid.column<ldi::color_column>().begin());
    std::copy(r.coverage.begin(), r.coverage.end(), grid.column<ldi::known_column>().begin());
    inpainter.inpaint(grid, ldi::progress_listener(), threads);
    picture result = r.color;
    std::copy(grid.column<ldi::color_column>().begin(), grid.column<ldi::color_column>().end(), result.begin());
    return result;
}

/// Share of the unknown pixels that lie on surfaces without a known pixel, where no inpainting can find the colors.
inline double cut_off_share(const ldi::photo_layers& layers) {
    const ldi::components parts = ldi::connected_components(layers.topology());
    const auto known = layers.column<ldi::known_column>();
    ldi::buffer<std::uint8_t> has_known(parts.count(), 0);
    for (std::size_t i = 0; i < known.size(); ++i)
        if (known[i] != 0) has_known[static_cast<std::size_t>(parts.label[i])] = 1;
    std::size_t unknown = 0, cut_off = 0;
    for (std::size_t i = 0; i < known.size(); ++i) {
        unknown += known[i] == 0 ? 1U : 0U;
        cut_off += has_known[static_cast<std::size_t>(parts.label[i])] == 0 ? 1U : 0U;
    }
    return unknown > 0 ? static_cast<double>(cut_off) / static_cast<double>(unknown) : 0;
}

/// Makes one layer with cleaned depth and closed spurious discontinuities, as make_photo3d() does before expand().
template <ldi::executor Executor>
ldi::photo_layers lift_cleaned(const subject& s, Executor& threads) {
    ldi::normalize_options normalize;
    normalize.clipped_share = 0;
    normalize.max_depth_ratio = 1e6F;
    ldi::image<float> disparity = ldi::weighted_median(ldi::normalize(s.inverse_depth, normalize).disparity, {}, {}, threads);
    ldi::merge_middle_components(disparity);
    ldi::photo_layer lifted = ldi::lift(s.photo, disparity, {}, threads);
    ldi::close_spurious_discontinuities(lifted, ldi::find_discontinuity_curves(lifted, {}));
    return ldi::expand(std::move(lifted), {}, {}).layers;
}

/// Measures inpainting.
///
/// shift  motion of the nearest surface in pixels to the right, from the photo's view to that of the other camera, which is
///        called canonical. The other camera is to the left of the photo's, or to the right if `shift` is negative
template <ldi::executor Executor>
inpainting_result measure_inpainting(const subject& s, float shift, const ldi::farbrausch& network,
                                     const lpips_network& perceived, const std::filesystem::path& folder, Executor& threads) {
    const ldi::depth_range range = s.range();
    const ldi::photo_layers lifted = lift_cleaned(s, threads);
    ldi::view original, canonical;
    original.camera = s.camera;
    canonical = ldi::moved_view(s.camera, range, 1, shift);
    canonical.camera.width += 2 * static_cast<std::int32_t>(std::ceil(std::abs(shift)));  // nothing moves out of the picture
    peel_options options;
    options.z_near = 1e-3F;
    const ldi::photo_layers peeled = peel(lifted, range, original, canonical, options, threads).layers;
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const auto reproject = [&](const ldi::photo_layers& layers) {
        return render_layers(layers, range, canonical, original, raster, threads);
    };

    const ldi::buffer<std::size_t> layer = ldi::examples::layer_of_pixels(peeled);
    ldi::photo_layers hidden = peeled;
    ldi::buffer<std::uint8_t> is_first(layer.size());
    for (std::size_t i = 0; i < layer.size(); ++i) {
        is_first[i] = layer[i] == 0 ? 1 : 0;
        hidden.column<ldi::known_column>()[i] = is_first[i];
        for (std::size_t c = 0; c < 3 && layer[i] > 0; ++c) hidden.column<ldi::color_column>()[3 * i + c] = 0;
    }
    ldi::photo_layers in_front = peeled;
    in_front.keep(is_first);
    const ldi::rendering first = reproject(in_front);
    const ldi::rendering truth = reproject(peeled);
    // Excludes the gaps that resampling leaves in the truth itself from the comparison.
    mask everywhere = truth.coverage, holes = truth.coverage;
    for (std::size_t i = 0; i < holes.size(); ++i) holes.data()[i] = everywhere.data()[i] != 0 && first.coverage.data()[i] == 0;

    inpainting_result result;
    result.name = s.name;
    result.inpainted_share = share(holes);
    result.cut_off = cut_off_share(hidden);
    const auto compare = [&](picture p, inpainted& to) {
        for (std::size_t i = 0; i < everywhere.size(); ++i)
            if (everywhere.data()[i] == 0) std::copy_n(s.photo.data() + 3 * i, 3, p.data() + 3 * i);
        to.whole = measure(p, s.photo, everywhere, perceived);
        to.inside = measure(p, s.photo, holes, perceived);
        return p;
    };
    const auto in_layers = [&](const auto& inpainter, inpainted& to) {
        ldi::photo_layers filled = hidden;
        inpainter.inpaint(filled, ldi::progress_listener(), threads);
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < filled.size(); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                const double d = static_cast<double>(filled.column<ldi::color_column>()[3 * i + c]) -
                                 static_cast<double>(peeled.template column<ldi::color_column>()[3 * i + c]);
                sum += d * d, count += is_first[i] == 0 ? 1 : 0;
            }
        to.layered = psnr_of(sum / (3.0 * static_cast<double>(filled.size())));
        to.hidden = psnr_of(sum / std::max(count, 1.0));
        std::fill(filled.column<ldi::known_column>().begin(), filled.column<ldi::known_column>().end(), std::uint8_t{1});
        return compare(reproject(filled).color, to);
    };
    const picture by_network = in_layers(network, result.network);
    in_layers(textured<ldi::farbrausch>{network}, result.with_texture);
    in_layers(ldi::diffusion_inpainter(), result.diffusion);
    const picture on_screen = compare(inpaint_picture(network, first, threads), result.network_in_screen_space);
    compare(inpaint_picture(ldi::diffusion_inpainter(), first, threads), result.diffusion_in_screen_space);
    compare(truth.color, result.truth);

    picture wrapped = first.color;
    for (std::size_t i = 0; i < holes.size(); ++i)
        if (first.coverage.data()[i] == 0) wrapped.data()[3 * i] = 255, wrapped.data()[3 * i + 2] = 255;
    const std::string name = "inpainting_" + s.name + (shift < 0 ? "_left_" : "_right_");
    ldi::save_png(folder / (name + "1_truth.png"), s.photo);
    ldi::save_png(folder / (name + "2_wrapped.png"), wrapped);
    ldi::save_png(folder / (name + "3_screen_space.png"), on_screen);
    ldi::save_png(folder / (name + "4_layers.png"), by_network);
    return result;
}

/// Mean advantage in dB of the network on layers over the network in screen space, after reprojection.
inline double lead(const std::vector<inpainting_result>& rows) {
    ldi::buffer<double> leads;
    for (const inpainting_result& r : rows) leads.push_back(r.network.whole.psnr - r.network_in_screen_space.whole.psnr);
    return mean(leads);
}

inline void print_inpainting(const char* title, const std::vector<inpainting_result>& rows) {
    std::printf("\n### The paper's inpainting protocol: %s\n\n", title);
    std::printf("Reprojected, PSNR in dB over the whole picture / where pixels were inpainted.\n\n");
    std::printf(
        "| picture | inpainted | hidden pixels cut off | Farbrausch, layers | Farbrausch, screen space | lead | diffusion, "
        "layers | "
        "diffusion, screen "
        "space | true colors |\n|---|---|---|---|---|---|---|---|---|\n");
    const auto pair = [](const inpainted& i) { std::printf(" %.2f / %.2f |", i.whole.psnr, i.inside.psnr); };
    for (const inpainting_result& r : rows) {
        std::printf("| %s | %.1f %% | %.1f %% |", r.name.c_str(), 100 * r.inpainted_share, 100 * r.cut_off);
        pair(r.network), pair(r.network_in_screen_space);
        std::printf(" %+.2f / %+.2f |", r.network.whole.psnr - r.network_in_screen_space.whole.psnr,
                    r.network.inside.psnr - r.network_in_screen_space.inside.psnr);
        pair(r.diffusion), pair(r.diffusion_in_screen_space), pair(r.truth);
        std::printf("\n");
    }
    std::printf(
        "\n| mean | PSNR of the layered image: all / hidden pixels | reprojected: PSNR | SSIM | LPIPS | inside: PSNR | SSIM | "
        "LPIPS |\n|---|---|---|---|---|---|---|---|\n");
    const auto line = [&](const char* name, inpainted inpainting_result::*way, bool on_layers) {
        const auto average = [&](auto&& value) {
            ldi::buffer<double> values;
            for (const inpainting_result& r : rows) values.push_back(value(r.*way));
            return mean(values);
        };
        std::printf("| %s |", name);
        if (on_layers)
            std::printf(" %.2f / %.2f |", average([](const inpainted& i) { return i.layered; }),
                        average([](const inpainted& i) { return i.hidden; }));
        else
            std::printf(" |");
        for (quality inpainted::*part : {&inpainted::whole, &inpainted::inside})
            std::printf(" %.2f | %.4f | %.3f |", average([&](const inpainted& n) { return (n.*part).psnr; }),
                        average([&](const inpainted& n) { return (n.*part).ssim; }),
                        average([&](const inpainted& n) { return (n.*part).lpips; }));
        std::printf("\n");
    };
    line("Farbrausch", &inpainting_result::network, true);
    line("Farbrausch and texture", &inpainting_result::with_texture, true);
    line("diffusion", &inpainting_result::diffusion, true);
    line("Farbrausch (screen space)", &inpainting_result::network_in_screen_space, false);
    line("diffusion (screen space)", &inpainting_result::diffusion_in_screen_space, false);
    line("true colors, resampled twice", &inpainting_result::truth, false);
}

}  // namespace ldi_quality
