// Depth peeling: a layered image as another camera sees it, with everything that is hidden there too, as a layered image of that
// camera (paper, section "Inpainting" under Results; Everitt, "Interactive Order-Independent Transparency", 2001).
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/detail/pixel_squares.hpp>
#include <ldi/render/detail/surface_walk.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

namespace ldi {

struct peel_options {
    float z_near = 0.01F;    ///< above 0; pixels that reach nearer than this are left out
    bool both_sides = true;  ///< false: surfaces seen from behind are left out
};

/// A layered image of the camera that it was peeled from, with all columns of the one that was peeled.
template <class Layers>
struct peeled_layers {
    Layers layers;      ///< in canonical order
    depth_range range;  ///< what its disparities stand for: as before, or wider if the camera came nearer or went back
};

namespace detail {

/// Where the ray through the center of a pixel meets a surface.
struct fragment {
    std::size_t position;  ///< y * width + x on the screen
    surface_triangle where;
    double inverse_depth, u, v;  ///< u, v: on the pixel that `where` belongs to
};

/// The fragments of the rows [first_row, last_row), by position, then nearest first.
inline buffer<fragment> peel_band(const pixel_squares& squares, const band_lists& lists, std::size_t band, std::int64_t first_row,
                                  std::int64_t last_row, std::int64_t width, bool both_sides) {
    buffer<fragment> result;
    for (std::size_t k = lists.start[band]; k < lists.start[band + 1]; ++k) {
        const std::int32_t pixel = static_cast<std::int32_t>(lists.list[k]);
        for (const side s : all_sides) {
            screen_triangle t = squares.triangle(pixel, s);
            const std::int64_t area = signed_area(t);
            if (area == 0 || (area < 0 && !both_sides)) continue;
            if (area < 0) std::swap(t[1], t[2]);
            const screen_values values(t);
            for_each_span(t, width, first_row, last_row, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
                for (std::int64_t x = first; x < last; ++x)
                    result.push_back({static_cast<std::size_t>(y * width + x),
                                      {pixel, s},
                                      values.inverse_depth(x, y),
                                      values.u(x, y),
                                      values.v(x, y)});
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

template <class Scalar>
void copy_pixel(const buffer<Scalar>& from, std::int32_t pixel, buffer<Scalar>& to, std::size_t i, std::size_t channels) {
    for (std::size_t c = 0; c < channels; ++c) to[i * channels + c] = from[static_cast<std::size_t>(pixel) * channels + c];
}

/// The range, widened to hold all fragments. Rounding alone does not widen it.
inline depth_range range_of(const buffer<fragment>& fragments, const depth_range& range) {
    const double first = 1.0 / static_cast<double>(range.z_near), last = 1.0 / static_cast<double>(range.z_far);
    double nearest = first, farthest = last;
    for (const fragment& f : fragments)
        nearest = (std::max)(nearest, f.inverse_depth), farthest = (std::min)(farthest, f.inverse_depth);
    const double slack = 1e-5 * (first - last);
    depth_range result = range;
    if (nearest > first + slack) result.z_near = static_cast<float>(1 / nearest);
    if (farthest < last - slack) result.z_far = static_cast<float>(1 / farthest);
    return result;
}

}  // namespace detail

/// Every surface that the ray through the center of a pixel of `from` meets becomes a pixel there, any number of them at one
/// position. Neighbors are linked where the surface leads from one to the other without a tear and without folding back, which
/// is followed exactly: peeled from where it was taken, a layered image stays as it is.
///
/// taken_from  the camera whose pixels `layers` are; its size is the lattice's
///
/// Colors are interpolated as render_layers() does; every other column is what the nearest source pixel has. Raises as
/// render_layers() does, and too_large if there are 2^31 pixels or more.
template <payload_column... Columns, executor Executor>
peeled_layers<layered_image<Columns...>> peel(const layered_image<Columns...>& layers, const view& taken_from,
                                              const depth_range& range, const view& from, const peel_options& options,
                                              Executor& threads) {
    static_assert(has_columns<layered_image<Columns...>, color_column, disparity_column, known_column>);
    raster_options raster;
    raster.z_near = options.z_near;
    detail::check_raster_options(from, raster);
    const detail::pixel_squares squares(layers, taken_from, range, from, 1, options.z_near);
    const std::int64_t w = from.camera.width, h = from.camera.height, band_rows = 16;
    const std::size_t bands = static_cast<std::size_t>((h + band_rows - 1) / band_rows);
    const detail::band_lists lists(
        layers.size(),
        [&](std::size_t i) {
            return squares.is_drawn(i) ? detail::vertical_extent{squares.top(i), squares.bottom(i)} : detail::vertical_extent{};
        },
        bands, band_rows);
    buffer<buffer<detail::fragment>> parts(bands);
    parallel_for(threads, bands, 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b) {
            const std::int64_t first_row = static_cast<std::int64_t>(b) * band_rows;
            parts[b] =
                detail::peel_band(squares, lists, b, first_row, (std::min)(first_row + band_rows, h), w, options.both_sides);
        }
    });
    buffer<detail::fragment> fragments;
    for (buffer<detail::fragment>& part : parts) {
        fragments.insert(fragments.end(), part.begin(), part.end());
        part = {};
    }
    const std::size_t count = fragments.size();
    if (count > static_cast<std::size_t>((std::numeric_limits<std::int32_t>::max)()))
        raise(error_code::too_large, "peel", "fewer than 2^31 pixels", std::to_string(count));

    peeled_layers<layered_image<Columns...>> result{layered_image<Columns...>(), detail::range_of(fragments, range)};
    result.layers.surface = layers.surface, result.layers.camera = from.camera, result.layers.range = result.range;
    graph& g = result.layers.topology;
    g.width = from.camera.width, g.height = from.camera.height;
    g.resize(count);
    for (const side s : all_sides) std::fill(g.neighbors(s).begin(), g.neighbors(s).end(), no_pixel);
    result.layers.resize_columns(count);
    buffer<std::size_t> start(static_cast<std::size_t>(w * h) + 1, 0);
    for (const detail::fragment& f : fragments) ++start[f.position + 1];
    for (std::size_t p = 1; p < start.size(); ++p) start[p] += start[p - 1];

    const double last = 1.0 / static_cast<double>(result.range.z_far);
    const double span = 1.0 / static_cast<double>(result.range.z_near) - last;
    parallel_for(threads, count, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const detail::fragment& f = fragments[i];
            g.x[i] = static_cast<std::int32_t>(f.position % static_cast<std::size_t>(w));
            g.y[i] = static_cast<std::int32_t>(f.position / static_cast<std::size_t>(w));
            (detail::copy_pixel(layers.template column<Columns>(), f.where.pixel, result.layers.template column<Columns>(), i,
                                Columns::channels),
             ...);
            result.layers.template column<disparity_column>()[i] =
                static_cast<float>(span > 0 ? std::clamp((f.inverse_depth - last) / span, 0.0, 1.0) : 0.0);
            const std::array<std::uint8_t, 3> color = detail::color_within_pixel(layers, f.where.pixel, f.u, f.v);
            std::copy(color.begin(), color.end(),
                      result.layers.template column<color_column>().begin() + static_cast<std::ptrdiff_t>(3 * i));
        }
    });
    const detail::surface_walk walk(layers.topology, squares);
    for (std::size_t i = 0; i < count; ++i)
        for (const side s : {side::right, side::down}) {
            const std::int32_t x = g.x[i], y = g.y[i];
            if (s == side::right ? x + 1 == g.width : y + 1 == g.height) continue;
            const detail::surface_triangle end = walk.one_sample(fragments[i].where, x, y, s);
            if (end.pixel == no_pixel) continue;
            const std::size_t position = fragments[i].position + (s == side::right ? 1 : static_cast<std::size_t>(w));
            std::size_t there = start[position];
            while (there < start[position + 1] && fragments[there].where != end) ++there;
            LDI_ASSERT(there < start[position + 1]);
            g.link(static_cast<std::int32_t>(i), s, static_cast<std::int32_t>(there));
        }
    result.layers.reorder(canonical_order(g, result.layers.template column<disparity_column>()));
    return result;
}

template <payload_column... Columns>
peeled_layers<layered_image<Columns...>> peel(const layered_image<Columns...>& layers, const view& taken_from,
                                              const depth_range& range, const view& from, const peel_options& options = {}) {
    serial_executor serial;
    return peel(layers, taken_from, range, from, options, serial);
}

}  // namespace ldi
