// Silhouettes of 3D photos, with true depth and with the same depth degraded as networks do: where they are, what is stretched
// across them, the rims beside them, and the discontinuities that are closed.
#pragma once

#include "degraded_depth.hpp"
#include "halo.hpp"
#include "novel_views.hpp"
#include "silhouettes.hpp"
#include "stretch.hpp"
#include "subjects.hpp"
#include "true_silhouettes.hpp"

#include <ldi/formats/picture.hpp>
#include <ldi/occlusion/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace ldi_quality {

enum depth_source : std::size_t { true_depth, degraded_depth, depth_source_count };

struct silhouette_quality {
    silhouette_distance distance;
    double halo = 0;     ///< mean color error beside silhouettes, of 255
    double stretch = 0;  ///< share of the frame
    double closed = 0;   ///< share of the sides with a discontinuity
};

struct silhouette_row {
    std::string name;
    std::array<silhouette_quality, depth_source_count> with{};
};

/// Hidden pixels are filled by diffusion: quickly, and the same whatever network there is.
template <ldi::executor Executor>
silhouette_row measure_silhouettes(const subject& s, const degradation& how, const std::filesystem::path& folder,
                                   Executor& threads) {
    const std::vector<true_side> truth = true_silhouettes(s.photo, s.inverse_depth, s.known);
    const mask frame = frame_of(s);
    mask band = silhouette_band(s, truth);
    for (std::size_t i = 0; i < band.size(); ++i) band.data()[i] = band.data()[i] != 0 && frame.data()[i] != 0 ? 1 : 0;
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const ldi::photo3d_options options = true_depth_options(s, static_cast<int>(std::ceil(s.parallax())) + 2);

    silhouette_row row{s.name, {}};
    for (const depth_source source : {true_depth, degraded_depth}) {
        const ldi::image<float> inverse_depth = source == true_depth ? s.inverse_depth : degraded(s.inverse_depth, how);
        const ldi::photo3d made =
            ldi::make_photo3d(s.photo, ldi::given_disparity{inverse_depth}, ldi::diffusion_inpainter(), options, threads);
        silhouette_quality& q = row.with[source];
        const std::vector<side_middle> ours = sides_of(made.curves, static_cast<std::int32_t>(s.photo.width()));
        q.distance = distance_of_silhouettes(ours, truth, s.photo.height(), s.photo.width());
        q.closed = share_closed(made, options.surface, threads);
        const picture seen = ldi::rasterize(made.mesh, made.atlas.color, s.other, raster, threads).color;
        q.halo = color_error(seen, s.seen, band);
        mask stretched = shown_triangles(made.mesh, spanning_triangles(made.mesh, s, truth), s.other, threads);
        for (std::size_t i = 0; i < stretched.size(); ++i)
            stretched.data()[i] = stretched.data()[i] != 0 && frame.data()[i] != 0 ? 1 : 0;
        q.stretch = share(stretched) / share(frame);

        picture marked = seen;
        for (std::size_t i = 0; i < band.size(); ++i) {
            if (band.data()[i] != 0) marked.data()[3 * i + 1] = static_cast<std::uint8_t>(128 + marked.data()[3 * i + 1] / 2);
            if (stretched.data()[i] != 0) marked.data()[3 * i] = 255;
        }
        const std::string name = "silhouettes_" + s.name + (source == true_depth ? "_true" : "_degraded");
        ldi::save_png(folder / (name + "_view.png"), seen);
        ldi::save_png(folder / (name + "_marked.png"), marked);
        picture sides = s.photo;  // the truth green, where colors differ yellow, ours red
        const auto paint = [&](const side_middle& m, std::array<std::uint8_t, 3> color) {
            for (std::size_t c = 0; c < 3; ++c) sides((m.y - 1) / 2, (m.x - 1) / 2, c) = color[c];
        };
        for (const true_side& t : truth)
            paint(t.middle(),
                  t.colors_differ ? std::array<std::uint8_t, 3>{255, 255, 0} : std::array<std::uint8_t, 3>{0, 255, 0});
        for (const side_middle& m : ours) paint(m, {255, 0, 0});
        ldi::save_png(folder / (name + ".png"), sides);
    }
    return row;
}

/// The means over pictures of what was measured there.
inline silhouette_quality mean_of(const std::vector<silhouette_row>& rows, depth_source source) {
    const auto average = [&](auto&& value) {
        ldi::buffer<double> values;
        for (const silhouette_row& r : rows)
            if (const double v = value(r.with[source]); !std::isnan(v)) values.push_back(v);
        return mean(values);
    };
    using quality_of = silhouette_quality;
    silhouette_quality result;
    result.distance.pixels = average([](const quality_of& q) { return q.distance.pixels; });
    result.distance.missed = average([](const quality_of& q) { return q.distance.missed; });
    result.halo = average([](const quality_of& q) { return q.halo; });
    result.stretch = average([](const quality_of& q) { return q.stretch; });
    result.closed = average([](const quality_of& q) { return q.closed; });
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
    for (const depth_source source : {true_depth, degraded_depth}) {
        const std::string depth = source == true_depth ? ", true" : ", degraded";
        for (const silhouette_row& r : rows) line(r.name + depth, r.with[source]);
        line("**mean" + depth + "**", mean_of(rows, source));
    }
}

}  // namespace ldi_quality
