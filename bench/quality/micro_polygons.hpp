// Draws a layered image directly, without charts and simplification. Every pixel becomes a small square that shares corners
// with linked pixels and is separate from all others (the micro-polygons of the paper's section "Inpainting", under Results).
#pragma once

#include "pixel_squares.hpp"

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <cstdint>

namespace ldi_quality {

/// Draws a layered image. Colors are interpolated across links and constant up to an edge without a link. Known and unknown
/// colors never mix.
///
/// range       distances of disparity 1 and 0
/// taken_from  camera of the layered image; its size is the lattice's size
/// from        view to draw
///
/// Omits pixels with a corner nearer than options.z_near. Raises mismatch if camera and lattice differ in size, invalid_data if a
/// disparity is not in front of the camera, invalid_option or too_large as rasterize() does.
template <ldi::has_columns<ldi::color_column, ldi::disparity_column, ldi::known_column> Layers,
          ldi::executor Executor = const ldi::serial_executor>
ldi::rendering render_layers(const Layers& layers, const ldi::depth_range& range, const ldi::view& taken_from,
                             const ldi::view& from, const ldi::raster_options& options = {}, Executor&& threads = {}) {
    ldi::detail::check_raster_options(from, options);
    const pixel_squares squares(layers, range, taken_from, from, options.samples, options.z_near);
    return ldi::detail::draw_in_bands(
        from.camera, options, layers.topology().count(),
        [&](std::int32_t i) {
            const ldi::detail::vertical_extent e{squares.top(i), squares.bottom(i)};
            return squares.is_drawn(i) ? e : ldi::detail::vertical_extent{};
        },
        [&](std::int32_t pixel, ldi::detail::sample_band& band) {
            for (const ldi::side s : ldi::all_sides) {
                screen_triangle t = squares.triangle(pixel, s);
                if (!turn_clockwise(t, options.both_sides)) continue;
                band.draw(t, [&](double u, double v) { return color_within_pixel(layers, pixel, u, v); });
            }
        },
        threads);
}

}  // namespace ldi_quality
