// Measures of the silhouettes of 3D photos, with true depth and with depth that is degraded like a network's: position,
// stretched texture across silhouettes, rims beside them, and closed discontinuities.
#pragma once

#include "converter.hpp"
#include "degraded_depth.hpp"
#include "halo.hpp"
#include "silhouettes.hpp"
#include "stretch.hpp"
#include "subjects.hpp"
#include "true_silhouettes.hpp"
#include "views.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace ldi_quality {

struct silhouette_quality {
    silhouette_distance distance;
    double halo = 0;     ///< mean color error beside silhouettes, of 255
    double stretch = 0;  ///< share of the frame
    double closed = 0;   ///< share of the sides with a step in disparity whose pixels are linked again
};

struct silhouette_row {
    std::string name, depth;  ///< name of the subject; "true", "degraded" or a network
    silhouette_quality quality;
};

/// Marks the band of the halo in green, and stretched texture in red.
inline picture marked(picture seen, const mask& band, const mask& stretched) {
    for (std::size_t i = 0; i < band.size(); ++i) {
        std::uint8_t* color = seen.data() + 3 * i;
        if (band.data()[i] != 0) color[1] = static_cast<std::uint8_t>(128 + color[1] / 2);
        if (stretched.data()[i] != 0) color[0] = 255;
    }
    return seen;
}

/// Marks true silhouettes in green, or in yellow where the colors of their surfaces differ, and our silhouettes in red.
inline picture marked(picture photo, const std::vector<true_side>& truth, const std::vector<side_middle>& ours) {
    const auto paint = [&](const side_middle& m, const std::array<std::uint8_t, 3>& color) {
        for (std::size_t c = 0; c < 3; ++c) photo((m.y - 1) / 2, (m.x - 1) / 2, c) = color[c];
    };
    for (const true_side& t : truth) paint(t.middle(), {static_cast<std::uint8_t>(t.colors_differ ? 255 : 0), 255, 0});
    for (const side_middle& m : ours) paint(m, {255, 0, 0});
    return photo;
}

/// Measures one subject. Fills hidden pixels by diffusion, which is fast and depends on no network.
///
/// depth          name of the depth: "true", "degraded" or that of a network
/// inverse_depth  h x w x 1 of any size
/// folder         folder for pictures
template <ldi::executor Executor>
silhouette_row measure_silhouettes(const subject& s, const std::string& depth, const ldi::image<float>& inverse_depth,
                                   const converter& convert, const std::filesystem::path& folder, Executor& threads) {
    const std::vector<true_side> truth = true_silhouettes(s.photo, s.inverse_depth, s.known);
    const mask frame = frame_of(s);
    const auto in_frame = [&](mask m) {
        for (std::size_t i = 0; i < m.size(); ++i) m.data()[i] = m.data()[i] != 0 && frame.data()[i] != 0 ? 1 : 0;
        return m;
    };
    const mask band = in_frame(silhouette_band(s, truth));
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const ldi::photo3d_options options = true_depth_options(s, static_cast<int>(std::ceil(s.parallax())) + 2);

    const ldi::photo3d made = convert(s.photo, ldi::given_disparity{inverse_depth}, ldi::diffusion_inpainter(), options, threads);
    const picture seen = ldi::rasterize(made.mesh, made.atlas.color, s.other, raster, threads).color;
    const std::vector<side_middle> ours = sides_of(made.curves, static_cast<std::int32_t>(s.photo.width()));
    const mask stretched = in_frame(shown_triangles(made.mesh, spanning_triangles(made.mesh, s, truth), s.other, threads));
    silhouette_row row{s.name, depth, {}};
    row.quality.distance = distance_of_silhouettes(ours, truth, s.photo.height(), s.photo.width());
    row.quality.halo = color_error(seen, s.seen, band);
    row.quality.stretch = share(stretched) / share(frame);
    row.quality.closed = share_closed(made.photo, made.disparity, made.curves, options.surface);
    const std::string file = "silhouettes_" + s.name + "_" + depth;
    ldi::save_png(folder / (file + ".png"), marked(s.photo, truth, ours));
    ldi::save_png(folder / (file + "_view.png"), seen);
    ldi::save_png(folder / (file + "_marked.png"), marked(seen, band, stretched));
    return row;
}

/// Measures with true depth and with degraded depth.
template <ldi::executor Executor>
void measure_silhouettes(std::vector<silhouette_row>& rows, const subject& s, const degradation& how, const converter& convert,
                         const std::filesystem::path& folder, Executor& threads) {
    rows.push_back(measure_silhouettes(s, "true", s.inverse_depth, convert, folder, threads));
    rows.push_back(measure_silhouettes(s, "degraded", degraded(s.inverse_depth, how), convert, folder, threads));
}

/// Means over the rows with this depth; unmeasured values do not count.
inline silhouette_quality mean_of(const std::vector<silhouette_row>& rows, const std::string& depth) {
    const auto average = [&](auto&& value) {
        ldi::buffer<double> values;
        for (const silhouette_row& r : rows)
            if (r.depth == depth && !std::isnan(value(r.quality))) values.push_back(value(r.quality));
        return mean(values);
    };
    using measured = silhouette_quality;
    silhouette_quality result;
    result.distance.pixels = average([](const measured& q) { return q.distance.pixels; });
    result.distance.missed = average([](const measured& q) { return q.distance.missed; });
    result.halo = average([](const measured& q) { return q.halo; });
    result.stretch = average([](const measured& q) { return q.stretch; });
    result.closed = average([](const measured& q) { return q.closed; });
    return result;
}

inline void print_silhouettes(const char* title, const std::vector<silhouette_row>& rows) {
    std::printf("\n### Silhouettes: %s\n\n", title);
    std::printf(
        "Median distance from our silhouettes to the true ones, in pixels of 1152; share of the true ones that are missed; halo, "
        "of "
        "255; stretch, share of the frame; share of discontinuities closed.\n\n");
    std::printf("| picture, depth | silhouettes | missed | halo | stretch | closed |\n|---|---|---|---|---|---|\n");
    const auto line = [](const std::string& name, const silhouette_quality& q) {
        std::printf("| %s | %.2f px | %.1f %% | %.1f | %.2f %% | %.1f %% |\n", name.c_str(), q.distance.pixels,
                    100 * q.distance.missed, q.halo, 100 * q.stretch, 100 * q.closed);
    };
    std::vector<std::string> depths;  // in the order of their first rows
    for (const silhouette_row& r : rows)
        if (std::find(depths.begin(), depths.end(), r.depth) == depths.end()) depths.push_back(r.depth);
    for (const std::string& depth : depths) {
        for (const silhouette_row& r : rows)
            if (r.depth == depth) line(r.name + ", " + depth, r.quality);
        line("**mean, " + depth + "**", mean_of(rows, depth));
    }
}

}  // namespace ldi_quality
