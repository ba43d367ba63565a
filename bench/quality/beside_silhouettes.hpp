// Counts faults beside silhouettes of photographs without true depth: islands (narrow surfaces between a nearer and a farther
// one), colors that fit neither surface, and hard borders between hidden surfaces. Also draws the worst places, enlarged.
#pragma once

#include "holes.hpp"
#include "metrics.hpp"

#include <ldi/core/components.hpp>
#include <ldi/inpaint/detail/local_matte.hpp>
#include <ldi/inpaint/detail/silhouette_band.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

/// A pixel of a view with many faults around it.
struct bad_place {
    std::string photo;
    std::size_t view = 0;  ///< index in views_beside()
    std::int32_t x = 0, y = 0;
    std::int64_t score = 0;  ///< around it: 8 per pixel of a hard border, 1 per pixel whose color fits neither surface
};

struct silhouette_faults {
    std::size_t islands = 0, charts = 0, layers = 0;
    double band = 0, neither = 0;   ///< pixels of the band; those whose color fits neither surface
    std::int64_t hard_borders = 0;  ///< pixels in views_beside()
    std::size_t views_with_holes = 0;
    std::vector<bad_place> places;  ///< the worst places, none close to another
};

/// Returns four views from the limits of the motion (right, left, above and below), at the photo's resolution.
inline std::vector<ldi::view> views_beside(const ldi::photo_facts& photo) {
    std::vector<ldi::view> result;
    const float far = 0.99F * photo.range.z_near;
    for (const auto& [x, y] : {std::pair{1.0F, 0.0F}, {-1.0F, 0.0F}, {0.0F, 1.0F}, {0.0F, -1.0F}}) {
        ldi::view from;
        from.camera = photo.camera;
        from.position = ldi::within_motion({far * x, far * y, 0}, photo.camera, photo.range, photo.motion);
        result.push_back(from);
    }
    return result;
}

namespace detail {

/// Converts the photo's pixels to a layer, linked as make_photo3d() links them before expand().
inline ldi::photo_layer visible_layer(const ldi::photo3d& made) {
    picture colors = made.photo;  // receives the colors of the 3D photo's nearest pixels
    const ldi::graph& g = made.layers.topology();
    ldi::buffer<float> nearest(g.position_count(), -1.0F);
    for (std::int32_t i = 0; i < g.count(); ++i) {
        const std::size_t position = g.position_of(i);
        const float disparity = made.layers.column<ldi::disparity_column>()[i];
        if (disparity <= nearest[position]) continue;
        nearest[position] = disparity;
        std::copy_n(made.layers.at<ldi::color_column>(i).data(), 3, colors.data() + 3 * position);
    }
    ldi::photo_layer layer = ldi::lift(colors, made.disparity, made.facts);
    ldi::close_spurious_discontinuities(layer, made.curves);
    return layer;
}

/// Counts islands: surfaces that touch a nearer and a farther surface, each along at least an eighth of their border, and that
/// are narrower than 12 pixels of a photo with a long side of 1152.
inline std::size_t count_islands(const ldi::graph& g, std::span<const ldi::discontinuity_curve> curves) {
    const ldi::components found = ldi::connected_components(g);
    ldi::buffer<std::int32_t> beside_nearer(found.count(), 0), beside_farther(found.count(), 0);
    for (const ldi::discontinuity_curve& curve : curves)
        for (const ldi::discontinuity& d : curve.sides) {
            const std::int32_t back = found.label[d.back], front = found.label[d.front];
            if (back != front) ++beside_nearer[back], ++beside_farther[front];
        }
    const double limit = 12.0 / 1152 * std::max(g.width(), g.height());
    std::size_t result = 0;
    for (std::size_t i = 0; i < found.count(); ++i) {
        const std::int32_t border = beside_nearer[i] + beside_farther[i];
        const bool between = 8 * std::min(beside_nearer[i], beside_farther[i]) >= border && border > 0;
        result += between && 2.0 * found.size[i] / border < limit ? 1U : 0U;
    }
    return result;
}

/// Returns H x W x 1 over the photo. 1: within 12 pixels of a silhouette whose surfaces differ in color. 2: in addition, the
/// color is farther than 30 of 255 from every mixture of both surfaces' colors nearby. 0: elsewhere.
inline mask fits_neither(const ldi::photo_layer& layer) {
    constexpr float contrast = 40, tolerance = 30;
    const ldi::graph& g = layer.topology();
    ldi::detail::silhouette_band band(g, layer.column<ldi::disparity_column>(), 12);
    band.sample(layer.column<ldi::color_column>(), contrast);
    const ldi::detail::local_matte matte(g, band, layer.column<ldi::color_column>());
    mask result(static_cast<std::size_t>(g.height()), static_cast<std::size_t>(g.width()), 1, std::uint8_t{0});
    for (std::size_t i = 0; i < band.places().size(); ++i) {
        const auto& place = band.places()[i];
        if (!band.sides()[place.side].can_tell) continue;
        const ldi::detail::mixture& m = matte.mixtures()[i];
        const std::uint8_t* color = layer.at<ldi::color_column>(place.pixel).data();
        float squared = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float error = static_cast<float>(color[c]) - m.alpha * m.foreground[c] - (1 - m.alpha) * m.background[c];
            squared += error * error;
        }
        result.data()[place.pixel] = squared > 3 * tolerance * tolerance ? 2 : 1;
    }
    return result;
}

/// Returns a picture of the atlas's size, in which hidden pixels are red, and pixels whose color fits neither surface are
/// green.
inline picture marked_atlas(const ldi::photo3d& made, const mask& neither) {
    picture result(made.atlas.color.height(), made.atlas.color.width(), 3, std::uint8_t{0});
    const ldi::graph& g = made.layers.topology();
    const auto disparity = made.layers.column<ldi::disparity_column>();
    for (const std::int32_t reach : {2, 0})  // padding first, then the pixels themselves
        for (std::size_t c = 0; c < made.charts.charts.size(); ++c) {
            const ldi::chart& chart = made.charts.charts[c];
            const ldi::chart_placement at = made.atlas.placements[c];
            for (const std::int32_t i : chart.pixels) {
                const std::size_t position = g.position_of(i);
                const bool hidden = disparity[i] < made.disparity.data()[position];
                const std::array<std::uint8_t, 2> mark{
                    static_cast<std::uint8_t>(hidden ? 255 : 0),
                    static_cast<std::uint8_t>(!hidden && neither.data()[position] == 2 ? 255 : 0)};
                const std::int32_t x = g.x()[i] - chart.x + at.x, y = g.y()[i] - chart.y + at.y;
                for (std::int32_t v = y - reach; v <= y + reach; ++v)
                    for (std::int32_t u = x - reach; u <= x + reach; ++u) {
                        if (u < 0 || v < 0 || u >= static_cast<std::int32_t>(result.width()) ||
                            v >= static_cast<std::int32_t>(result.height()))
                            continue;
                        std::copy_n(mark.data(), 2, result.row(static_cast<std::size_t>(v)) + 3 * u);
                    }
            }
        }
    return result;
}

/// Returns H x W x 1 over a view: 1 for hard borders between hidden surfaces (both sides hidden, with a step in depth and in
/// color), 2 for visible colors that fit neither surface, 0 elsewhere.
template <ldi::executor Executor>
mask faults_seen(const ldi::photo3d& made, const picture& marks, const ldi::view& from, Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * made.facts.range.z_near;
    const ldi::rendering seen = ldi::rasterize(made.mesh, made.atlas.color, from, raster, threads);
    const picture kinds = ldi::rasterize(made.mesh, marks, from, raster, threads).color;
    const float per_step = made.facts.range.inverse_depth(1) - made.facts.range.inverse_depth(0);
    const std::size_t width = seen.color.width();
    mask result(seen.color.height(), width, 1, std::uint8_t{0});
    const auto is_border = [&](std::size_t a, std::size_t b) {
        if (kinds.data()[3 * a] < 192 || kinds.data()[3 * b] < 192) return false;
        const float step = std::abs(1 / seen.depth.data()[a] - 1 / seen.depth.data()[b]) / per_step;
        if (!(step > made.facts.surface.max_step)) return false;
        int difference = 0;
        for (std::size_t c = 0; c < 3; ++c) difference += std::abs(seen.color.data()[3 * a + c] - seen.color.data()[3 * b + c]);
        return difference > 60;
    };
    for (std::size_t y = 0; y + 1 < seen.color.height(); ++y)
        for (std::size_t x = 0; x + 1 < width; ++x) {
            const std::size_t i = y * width + x;
            result.data()[i] = is_border(i, i + 1) || is_border(i, i + width) ? 1 : kinds.data()[3 * i + 1] >= 192 ? 2 : 0;
        }
    return result;
}

}  // namespace detail

/// Enlarges the pixels around a place fourfold.
inline picture enlarged(const picture& seen, std::int32_t x, std::int32_t y) {
    constexpr std::int32_t side = 80, times = 4;
    picture result(side * times, side * times, 3);
    for (std::int32_t v = 0; v < side * times; ++v)
        for (std::int32_t u = 0; u < side * times; ++u) {
            const std::int32_t from_x = std::clamp(x + u / times - side / 2, 0, static_cast<std::int32_t>(seen.width()) - 1);
            const std::int32_t from_y = std::clamp(y + v / times - side / 2, 0, static_cast<std::int32_t>(seen.height()) - 1);
            std::copy_n(seen.row(static_cast<std::size_t>(from_y)) + 3 * from_x, 3,
                        result.row(static_cast<std::size_t>(v)) + 3 * u);
        }
    return result;
}

/// Draws the surroundings of a place, enlarged fourfold.
template <ldi::executor Executor>
picture picture_of(const ldi::photo3d& made, const bad_place& place, Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * made.facts.range.z_near;
    raster.background = {255, 0, 255};
    return enlarged(ldi::rasterize(made.mesh, made.atlas.color, views_beside(made.facts)[place.view], raster, threads).color,
                    place.x, place.y);
}

/// Arranges pictures of one size in a grid.
inline picture in_grid(const std::vector<picture>& pictures, std::size_t columns) {
    if (pictures.empty()) return picture(1, 1, 3);
    const std::size_t rows = (pictures.size() + columns - 1) / columns, h = pictures[0].height(), w = pictures[0].width();
    picture result(rows * h, columns * w, 3, std::uint8_t{255});
    for (std::size_t i = 0; i < pictures.size(); ++i)
        for (std::size_t y = 0; y < h; ++y)
            std::copy_n(pictures[i].row(y), 3 * w, result.row(i / columns * h + y) + 3 * (i % columns) * w);
    return result;
}

/// Finds all faults except holes.
template <ldi::executor Executor>
silhouette_faults find_faults(const ldi::photo3d& made, const std::string& photo, Executor& threads) {
    constexpr std::size_t cell = 20, places_per_view = 2;
    silhouette_faults result;
    const ldi::photo_layer layer = detail::visible_layer(made);
    result.islands = detail::count_islands(layer.topology(), made.curves);
    result.charts = made.charts.charts.size();
    const ldi::graph& g = made.layers.topology();
    ldi::buffer<std::uint16_t> depth(g.position_count(), std::uint16_t{0});
    for (std::int32_t i = 0; i < g.count(); ++i) result.layers = std::max<std::size_t>(result.layers, ++depth[g.position_of(i)]);
    const mask neither = detail::fits_neither(layer);
    for (const std::uint8_t n : neither) result.band += n != 0 ? 1 : 0, result.neither += n == 2 ? 1 : 0;
    const picture marks = detail::marked_atlas(made, neither);
    const std::vector<ldi::view> views = views_beside(made.facts);
    for (std::size_t v = 0; v < views.size(); ++v) {
        const mask faults = detail::faults_seen(made, marks, views[v], threads);
        const std::size_t rows = faults.height() / cell, columns = faults.width() / cell;
        std::vector<std::int64_t> cells(rows * columns, 0);
        for (std::size_t y = 0; y < rows * cell; ++y)
            for (std::size_t x = 0; x < columns * cell; ++x) {
                const std::uint8_t fault = faults(y, x, 0);
                result.hard_borders += fault == 1 ? 1 : 0;
                cells[y / cell * columns + x / cell] += fault == 1 ? 8 : fault == 2 ? 1 : 0;
            }
        std::vector<bad_place> here;
        for (std::size_t y = 0; y + 2 < rows; ++y)
            for (std::size_t x = 0; x + 2 < columns; ++x) {
                std::int64_t score = 0;
                for (std::size_t k = 0; k < 9; ++k) score += cells[(y + k / 3) * columns + x + k % 3];
                if (score > 0)
                    here.push_back({photo, v, static_cast<std::int32_t>(cell * x + 3 * cell / 2),
                                    static_cast<std::int32_t>(cell * y + 3 * cell / 2), score});
            }
        std::stable_sort(here.begin(), here.end(), [](const bad_place& a, const bad_place& b) { return a.score > b.score; });
        for (std::size_t taken = 0; const bad_place& p : here) {
            const bool is_new = std::none_of(result.places.begin(), result.places.end(), [&](const bad_place& other) {
                // Compares places of all views, because the views show the same silhouettes.
                return std::abs(other.x - p.x) < 60 && std::abs(other.y - p.y) < 60;
            });
            if (is_new && taken++ < places_per_view) result.places.push_back(p);
        }
    }
    return result;
}

}  // namespace ldi_quality
