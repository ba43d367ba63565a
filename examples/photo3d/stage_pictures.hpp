// Writes a picture of every stage, for inspection: `photo3d --stages DIR`.
#pragma once

#include "outputs.hpp"

#include <ldi/io/picture.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

using rgb = std::array<std::uint8_t, 3>;
using picture = image<std::uint8_t>;

inline void set(picture& p, std::size_t x, std::size_t y, const rgb& color) {
    std::copy(color.begin(), color.end(), p.row(y) + 3 * x);
}

/// Returns one color per index. Consecutive hues are a golden angle apart, so that the colors are easy to distinguish.
inline rgb distinct_color(std::size_t index) {
    const float hue = std::fmod(0.618034F * static_cast<float>(index), 1.0F) * 6.0F;
    const auto channel = [&](float offset) {
        const float k = std::fmod(offset + hue, 6.0F);
        return static_cast<std::uint8_t>(255.0F * (1.0F - 0.8F * std::clamp(std::min(k, 4.0F - k), 0.0F, 1.0F)));
    };
    return {channel(5), channel(3), channel(1)};
}

inline void draw_line(picture& p, float x0, float y0, float x1, float y1, const rgb& color) {
    const int steps = static_cast<int>(std::max(std::abs(x1 - x0), std::abs(y1 - y0))) + 1;
    for (int i = 0; i <= steps; ++i) {
        const float t = static_cast<float>(i) / static_cast<float>(steps);
        const float x = std::floor(x0 + t * (x1 - x0)), y = std::floor(y0 + t * (y1 - y0));
        if (x >= 0 && y >= 0 && x < static_cast<float>(p.width()) && y < static_cast<float>(p.height()))
            set(p, static_cast<std::size_t>(x), static_cast<std::size_t>(y), color);
    }
}

/// Converts disparity to gray, white near.
inline picture gray(const image<float>& disparity) {
    picture p = image<std::uint8_t>(disparity.height(), disparity.width());
    for (std::size_t i = 0; i < p.size(); ++i)
        p.data()[i] = static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(disparity.data()[i], 0.0F, 1.0F)));
    return p;
}

/// Darkens a picture to a third of its brightness, as a background.
inline picture darkened(const picture& p) {
    picture result = p;
    for (std::uint8_t& value : result) value = static_cast<std::uint8_t>(value / 3);
    return result;
}

/// Draws every silhouette curve in its own color on the darkened photo, and the growth constraints at its ends as white lines.
inline picture curve_picture(const photo3d& result) {
    picture p = darkened(result.photo);
    const std::size_t columns = p.width();
    for (std::size_t c = 0; c < result.curves.size(); ++c)
        for (const discontinuity& d : result.curves[c].sides)
            for (std::int32_t pixel : {d.back, d.front})
                set(p, static_cast<std::size_t>(pixel) % columns, static_cast<std::size_t>(pixel) / columns, distinct_color(c));
    for (const discontinuity_curve& curve : result.curves)
        for (const growth_constraint& c : curve.constraints)
            draw_line(p, c.x, c.y, c.x + 50.0F * c.perpendicular_x, c.y + 50.0F * c.perpendicular_y, {255, 255, 255});
    return p;
}

/// Returns, for each pixel of the layered image, the number of pixels in front of it.
inline buffer<std::size_t> layer_of_pixels(const photo_layers& layers) {
    const graph& g = layers.topology();
    buffer<buffer<std::size_t>> at(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()));
    for (std::size_t i = 0; i < g.size(); ++i)
        at[static_cast<std::size_t>(g.y()[i]) * static_cast<std::size_t>(g.width()) + static_cast<std::size_t>(g.x()[i])]
            .push_back(i);
    const auto disparity = layers.column<disparity_column>();
    buffer<std::size_t> layer(g.size());
    for (buffer<std::size_t>& pixels : at) {
        std::sort(pixels.begin(), pixels.end(), [&](std::size_t a, std::size_t b) { return disparity[a] > disparity[b]; });
        for (std::size_t k = 0; k < pixels.size(); ++k) layer[pixels[k]] = k;
    }
    return layer;
}

/// Draws one layer with the colors `color(pixel)`; gray where it has no pixel.
template <class Color>
picture layer_picture(const photo_layers& layers, const buffer<std::size_t>& layer_of, std::size_t layer, Color&& color) {
    const graph& g = layers.topology();
    picture p =
        image<std::uint8_t>(static_cast<std::size_t>(g.height()), static_cast<std::size_t>(g.width()), 3, std::uint8_t{40});
    for (std::size_t i = 0; i < g.size(); ++i)
        if (layer_of[i] == layer) set(p, static_cast<std::size_t>(g.x()[i]), static_cast<std::size_t>(g.y()[i]), color(i));
    return p;
}

/// Draws the kinds of the atlas's texels in the colors of the paper's figure (see texture/padding.hpp). Texels of the photo keep
/// their colors.
inline picture kind_picture(const texture_atlas& atlas) {
    picture p = image<std::uint8_t>(atlas.kind.height(), atlas.kind.width(), 3);
    for (std::size_t y = 0; y < p.height(); ++y)
        for (std::size_t x = 0; x < p.width(); ++x) {
            const std::uint8_t* photo = atlas.color.row(y) + 3 * x;
            rgb color{photo[0], photo[1], photo[2]};
            switch (atlas.kind.row(y)[x]) {
                case texel_kind::photo: break;
                case texel_kind::empty: color = {40, 40, 40}; break;
                case texel_kind::refilled: color = {120, 190, 255}; break;
                case texel_kind::occluded: color = {20, 60, 200}; break;
                case texel_kind::copied: color = {255, 150, 150}; break;
                case texel_kind::diffused: color = {170, 0, 0}; break;
                case texel_kind::macroblock: color = {60, 170, 60}; break;
            }
            set(p, x, y, color);
        }
    return p;
}

/// Draws the triangles on the darkened atlas.
inline picture wireframe_picture(const photo3d& result) {
    picture p = darkened(result.atlas.color);
    const auto& uv = result.mesh.texture_coordinates;
    const auto& triangles = result.mesh.triangles;
    const float columns = static_cast<float>(p.width()), rows = static_cast<float>(p.height());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const std::size_t a = triangles[i], b = triangles[i % 3 == 2 ? i - 2 : i + 1];
        draw_line(p, uv[2 * a] * columns, uv[2 * a + 1] * rows, uv[2 * b] * columns, uv[2 * b + 1] * rows, {255, 220, 80});
    }
    return p;
}

/// Writes a PNG of every stage to `folder`. Creates the folder if necessary.
inline void save_stage_pictures(const photo3d& result, const std::filesystem::path& folder, output_files& files) {
    files.create_folder(folder);
    const auto save = [&](const std::string& name, const picture& p) { files.write(folder / (name + ".png"), encode_png(p)); };
    save("01_photo", result.photo);
    save("02_disparity_estimated", gray(result.estimated));
    save("03_disparity_resampled", gray(result.resampled));
    save("04_disparity_cleaned", gray(result.disparity));
    save("05_curves", curve_picture(result));

    const buffer<std::size_t> layer_of = layer_of_pixels(result.layers);
    const std::size_t layers = 1 + *std::max_element(layer_of.begin(), layer_of.end());
    const auto known = result.layers.column<known_column>();
    for (std::size_t layer = 0; layer < layers; ++layer) {
        const std::string suffix = "_layer_" + std::to_string(layer + 1);
        save("06_color" + suffix, layer_picture(result.layers, layer_of, layer, [&](std::size_t i) {
                 const auto c = result.layers.at<color_column>(static_cast<std::int32_t>(i));
                 return rgb{c[0], c[1], c[2]};
             }));
        save("07_known" + suffix, layer_picture(result.layers, layer_of, layer, [&](std::size_t i) {
                 return known[i] != 0 ? rgb{200, 200, 200} : layer == 0 ? rgb{120, 190, 255} : rgb{20, 60, 200};
             }));
        save("08_charts" + suffix, layer_picture(result.layers, layer_of, layer, [&](std::size_t i) {
                 return distinct_color(static_cast<std::size_t>(result.charts.chart_of[i]));
             }));
    }
    save("09_atlas_kinds", kind_picture(result.atlas));
    save("10_atlas", result.atlas.color);
    save("11_wireframe", wireframe_picture(result));

    // The 3D photo from the side, the nearest surface shifted by 40 pixels; holes are magenta.
    raster_options raster;
    raster.samples = 2;
    raster.z_near = 0.01F * result.facts.range.z_near;
    raster.background = {255, 0, 255};
    for (const auto& [name, shift] : {std::pair{"12_view_from_left", 40.0F}, {"13_view_from_right", -40.0F}})
        save(name,
             rasterize(result.mesh, result.atlas.color, moved_view(result.facts.camera, result.facts.range, 1.0F, shift), raster)
                 .color);
}

}  // namespace ldi::examples
