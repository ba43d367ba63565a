// Depth peeling: converts a layered image to a layered image of another camera, including everything hidden from that camera
// (paper, section "Inpainting" under Results; Everitt, "Interactive Order-Independent Transparency", 2001).
#pragma once

#include "pixel_squares.hpp"
#include "surface_walk.hpp"

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace ldi_quality {

struct peel_options {
    float z_near = 0.01F;    ///< above 0; omits pixels with a corner nearer than this depth
    bool both_sides = true;  ///< false: omits surfaces seen from behind
};

/// Intersection of a surface with the ray through the center of a pixel.
struct fragment {
    std::int64_t position;  ///< y * width + x on the screen
    surface_triangle where;
    double inverse_depth, u, v;  ///< u, v: coordinates within the pixel of `where`
};

/// Finds the fragments of one screen, band by band.
class fragment_finder {
public:
    fragment_finder(const pixel_squares& squares, const ldi::pinhole_camera& screen, bool both_sides)
        : squares_(squares), width_(screen.width), height_(screen.height), both_sides_(both_sides) {}

    /// Returns the fragments sorted by position, and from near to far at each position.
    template <ldi::executor Executor>
    ldi::buffer<fragment> find_all(std::int32_t pixel_count, Executor& threads) const {
        const auto extent = [&](std::int32_t i) {
            return squares_.is_drawn(i) ? ldi::detail::vertical_extent{squares_.top(i), squares_.bottom(i)}
                                        : ldi::detail::vertical_extent{};
        };
        const ldi::detail::band_lists lists(pixel_count, extent, height_, ldi::detail::rows_per_band);
        ldi::buffer<ldi::buffer<fragment>> parts(lists.band_count());
        ldi::parallel_for(threads, parts.size(), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) parts[b] = find_in_band(lists, b);
        });
        ldi::buffer<fragment> fragments;
        for (ldi::buffer<fragment>& part : parts) {
            fragments.insert(fragments.end(), part.begin(), part.end());
            part = {};
        }
        return fragments;
    }

private:
    ldi::buffer<fragment> find_in_band(const ldi::detail::band_lists& lists, std::size_t band) const {
        const auto [first_row, last_row] = lists.rows_of(band);
        ldi::buffer<fragment> result;
        for (std::size_t k = lists.start[band]; k < lists.start[band + 1]; ++k) {
            const std::int32_t pixel = lists.list[k];
            for (const ldi::side s : ldi::all_sides) {
                screen_triangle t = squares_.triangle(pixel, s);
                if (!turn_clockwise(t, both_sides_)) continue;
                const ldi::detail::screen_values values(t);
                ldi::detail::for_each_span(
                    t, width_, first_row, last_row, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
                        for (std::int64_t x = first; x < last; ++x)
                            result.push_back(
                                {y * width_ + x, {pixel, s}, values.inverse_depth(x, y), values.u(x, y), values.v(x, y)});
                    });
            }
        }
        std::sort(result.begin(), result.end(), [](const fragment& a, const fragment& b) {
            if (a.position != b.position) return a.position < b.position;
            if (a.inverse_depth != b.inverse_depth) return a.inverse_depth > b.inverse_depth;
            return std::pair(a.where.pixel, a.where.outer) < std::pair(b.where.pixel, b.where.outer);
        });
        return result;
    }

    const pixel_squares& squares_;
    std::int64_t width_, height_;
    bool both_sides_;
};

/// Returns `range`, widened to contain all fragments. Rounding errors alone do not widen it.
inline ldi::depth_range range_of(const ldi::buffer<fragment>& fragments, const ldi::depth_range& range) {
    const double first = 1.0 / range.z_near, last = 1.0 / range.z_far;
    double nearest = first, farthest = last;
    for (const fragment& f : fragments)
        nearest = (std::max)(nearest, f.inverse_depth), farthest = (std::min)(farthest, f.inverse_depth);
    const double slack = 1e-5 * (first - last);  // well above the rounding of float disparities
    ldi::depth_range result = range;
    if (nearest > first + slack) result.z_near = static_cast<float>(1 / nearest);
    if (farthest < last - slack) result.z_far = static_cast<float>(1 / farthest);
    return result;
}

/// Links pixels of neighboring positions if the surface connects them. Pixel i belongs to fragment i.
inline void link_neighbors(ldi::graph_builder& g, const ldi::buffer<fragment>& fragments, const surface_walk& walk) {
    ldi::buffer<std::int32_t> start(g.position_count() + 1, 0);
    for (const fragment& f : fragments) ++start[f.position + 1];
    for (std::size_t p = 1; p < start.size(); ++p) start[p] += start[p - 1];
    for (std::int32_t i = 0; i < g.count(); ++i)
        for (const ldi::side s : {ldi::side::right, ldi::side::down}) {
            const std::int32_t x = g.x()[i], y = g.y()[i];
            if (s == ldi::side::right ? x + 1 == g.width() : y + 1 == g.height()) continue;
            const surface_triangle end = walk.one_sample(fragments[i].where, x, y, s);
            if (end.pixel == ldi::no_pixel) continue;
            const std::int64_t position = fragments[i].position + (s == ldi::side::right ? 1 : g.width());
            std::int32_t there = start[position];
            while (there < start[position + 1] && fragments[there].where != end) ++there;
            LDI_ASSERT(there < start[position + 1]);
            g.link(i, s, there);
        }
}

/// Builds a graph with one pixel per fragment, and links neighbors.
inline ldi::graph graph_of(const ldi::buffer<fragment>& fragments, const ldi::pinhole_camera& camera, const surface_walk& walk) {
    ldi::graph_builder g(camera.width, camera.height, fragments.size());
    for (std::int32_t i = 0; i < fragments.count(); ++i)
        g.set_position(i, static_cast<std::int32_t>(fragments[i].position % g.width()),
                       static_cast<std::int32_t>(fragments[i].position / g.width()));
    link_neighbors(g, fragments, walk);
    return std::move(g).build(ldi::detail::unchecked);
}

/// Sets the columns of `result`, whose pixels are the fragments.
template <ldi::payload_column... Columns, ldi::executor Executor>
void copy_columns(const ldi::buffer<fragment>& fragments, const ldi::layered_image<Columns...>& layers,
                  const ldi::depth_range& range, ldi::layered_image<Columns...>& result, Executor& threads) {
    const double last = 1.0 / range.z_far, span = 1.0 / range.z_near - last;
    ldi::parallel_for(threads, fragments.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::int32_t i = static_cast<std::int32_t>(begin), stop = static_cast<std::int32_t>(end); i < stop; ++i) {
            const fragment& f = fragments[i];
            const auto copy = [](auto from, auto to) { std::copy(from.begin(), from.end(), to.begin()); };
            (copy(layers.template at<Columns>(f.where.pixel), result.template at<Columns>(i)), ...);
            result.template column<ldi::disparity_column>()[i] =
                static_cast<float>(span > 0 ? std::clamp((f.inverse_depth - last) / span, 0.0, 1.0) : 0.0);
            copy(color_within_pixel(layers, f.where.pixel, f.u, f.v), result.template at<ldi::color_column>(i));
        }
    });
}

/// A layered image in the space of another camera.
template <ldi::payload_column... Columns>
struct peeled_layers {
    ldi::layered_image<Columns...> layers;
    ldi::depth_range range;  ///< distances of its disparities 1 and 0
};

/// Converts layers to another camera. A ray runs through the center of each pixel of `from`. Every surface that the ray meets
/// becomes a pixel of the result, so a position can have any number of pixels. Neighbors are linked if the surface connects
/// them without a tear and without folding back. The conversion is exact: with `taken_from` as `from`, it changes nothing.
///
/// range       distances of disparity 1 and 0
/// taken_from  camera of `layers`; its size is the lattice's size
/// from        camera of the result
///
/// The result is in canonical order and has all columns. Colors are interpolated as in render_layers(); every other column
/// copies the nearest source pixel. The range of distances of the result is `range`, or wider if the camera moved closer or
/// back. Raises the errors of render_layers(), and too_large for 2^31 pixels or more.
template <ldi::payload_column... Columns, ldi::executor Executor = const ldi::serial_executor>
peeled_layers<Columns...> peel(const ldi::layered_image<Columns...>& layers, const ldi::depth_range& range,
                               const ldi::view& taken_from, const ldi::view& from, const peel_options& options = {},
                               Executor&& threads = {}) {
    static_assert(ldi::has_columns<ldi::layered_image<Columns...>, ldi::color_column, ldi::disparity_column, ldi::known_column>);
    ldi::raster_options raster;
    raster.z_near = options.z_near;
    ldi::detail::check_raster_options(from, raster);
    const pixel_squares squares(layers, range, taken_from, from, 1, options.z_near);
    const ldi::buffer<fragment> fragments =
        fragment_finder(squares, from.camera, options.both_sides).find_all(layers.topology().count(), threads);
    if (fragments.size() > std::size_t{(std::numeric_limits<std::int32_t>::max)()})
        ldi::raise(ldi::error_code::too_large, "peel", "fewer than 2^31 pixels", std::to_string(fragments.size()));
    const surface_walk walk(layers.topology(), squares);
    peeled_layers<Columns...> result{ldi::layered_image<Columns...>(graph_of(fragments, from.camera, walk)),
                                     range_of(fragments, range)};
    copy_columns(fragments, layers, result.range, result.layers, threads);
    result.layers.reorder(ldi::canonical_order(result.layers.topology(), result.layers.template column<ldi::disparity_column>()));
    return result;
}

}  // namespace ldi_quality
