// Draws a layered image directly, without charts and simplification. Every pixel becomes a small square that shares corners
// with linked pixels and is separate from all others (the micro-polygons of the paper's section "Inpainting", under Results).
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/detail/pixel_squares.hpp>
#include <ldi/render/rasterizer.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Draws a layered image. Colors are interpolated across links and constant up to an edge without a link. Known and unknown
/// colors never mix.
///
/// range       distances of disparity 1 and 0
/// taken_from  camera of the layered image; its size is the lattice's size
/// from        view to draw
///
/// Omits pixels with a corner nearer than options.z_near. Raises mismatch if camera and lattice differ in size, invalid_data if a
/// disparity is not in front of the camera, invalid_option or too_large as rasterize() does.
template <has_columns<color_column, disparity_column, known_column> Layers, executor Executor = const serial_executor>
rendering render_layers(const Layers& layers, const depth_range& range, const view& taken_from, const view& from,
                        const raster_options& options = {}, Executor&& threads = {}) {
    detail::check_raster_options(from, options);
    const detail::pixel_squares squares(layers, range, taken_from, from, options.samples, options.z_near);
    return detail::draw_in_bands(
        from.camera, options, layers.topology().count(),
        [&](std::int32_t i) {
            const detail::vertical_extent e{squares.top(i), squares.bottom(i)};
            return squares.is_drawn(i) ? e : detail::vertical_extent{};
        },
        [&](std::int32_t pixel, detail::sample_band& band) {
            for (const side s : all_sides) {
                detail::screen_triangle t = squares.triangle(pixel, s);
                if (!detail::turn_clockwise(t, options.both_sides)) continue;
                band.draw(t, [&](double u, double v) { return detail::color_within_pixel(layers, pixel, u, v); });
            }
        },
        threads);
}

}}  // namespace ldi
