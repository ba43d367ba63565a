// Lifts a photo and its disparity to a layered image with one layer (paper, section "Lifting to Layered Depth Image"). Neighbors
// are linked except across discontinuities.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Sets the positions and links of the pixels of row y.
inline void place_row(image_view<const float> disparity, std::int32_t y, surface_rule surface, graph_builder& g) {
    const std::int32_t stride = g.width(), start = y * stride;
    const float* here = disparity.row(y);
    const float* above = y > 0 ? disparity.row(y - 1) : nullptr;
    const float* below = y + 1 < g.height() ? disparity.row(y + 1) : nullptr;
    for (std::int32_t x = 0; x < stride; ++x) g.set_position(start + x, x, y);
    const auto link_vertically = [&](side s, const float* other, std::int32_t step) {
        for (std::int32_t x = 0; x < stride; ++x) {
            const bool linked = other != nullptr && surface.same_surface(here[x], other[x]);
            g.set_neighbor(start + x, s, linked ? start + x + step : no_pixel);
        }
    };
    link_vertically(side::up, above, -stride);
    link_vertically(side::down, below, stride);
    g.set_neighbor(start, side::left, no_pixel);
    for (std::int32_t x = 0; x + 1 < stride; ++x) {
        const bool linked = surface.same_surface(here[x], here[x + 1]);
        g.set_neighbor(start + x, side::right, linked ? start + x + 1 : no_pixel);
        g.set_neighbor(start + x + 1, side::left, linked ? start + x : no_pixel);
    }
    g.set_neighbor(start + stride - 1, side::right, no_pixel);
}

/// Copies a disparity map. Clamps values that rounding errors moved slightly outside [0, 1]. Raises invalid_data for values that
/// are not finite or lie farther outside.
inline buffer<float> checked_disparity(image_view<const float> disparity) {
    constexpr float rounding = 1e-5F;
    buffer<float> values;
    values.reserve(disparity.height() * disparity.width());
    for (std::size_t y = 0; y < disparity.height(); ++y) {
        const float* row = disparity.row(y);
        for (std::size_t x = 0; x < disparity.width(); ++x) {
            if (!(row[x] >= -rounding && row[x] <= 1.0F + rounding))
                raise(error_code::invalid_data, "lift", "disparities in [0, 1]", to_text(row[x]));
            values.push_back(std::clamp(row[x], 0.0F, 1.0F));
        }
    }
    return values;
}

template <payload_column Color, executor Executor>
single_layer<Color, disparity_column, known_column, matte_column> lift_colors(image_view<const typename Color::scalar> color,
                                                                              image_view<const float> disparity,
                                                                              const photo_facts& facts, Executor& threads) {
    const std::size_t rows = disparity.height(), columns = disparity.width();
    if (color.height() != rows || color.width() != columns || color.channels() != 3 || disparity.channels() != 1 || rows == 0 ||
        columns == 0)
        raise(error_code::mismatch, "lift",
              "a photo H x W x 3 and a disparity map H x W x 1 of the same size, at least one pixel",
              shape_text(color) + " and " + shape_text(disparity));
    const pinhole_camera& camera = facts.camera;
    if ((camera.width != 0 || camera.height != 0) &&
        (static_cast<std::size_t>(camera.width) != columns || static_cast<std::size_t>(camera.height) != rows))
        raise(error_code::mismatch, "lift", "a camera of " + std::to_string(columns) + " x " + std::to_string(rows) + " pixels",
              std::to_string(camera.width) + " x " + std::to_string(camera.height));
    if (!(facts.surface.max_step >= 0))
        raise(error_code::invalid_option, "surface_rule::max_step", "0 or more", to_text(facts.surface.max_step));
    if (rows > std::size_t{(std::numeric_limits<std::int32_t>::max)()} / columns || (std::max)(rows, columns) > max_lattice_side)
        raise(error_code::too_large, "lift", "fewer than 2^31 pixels, at most " + std::to_string(max_lattice_side) + " per side",
              std::to_string(columns) + " x " + std::to_string(rows));

    buffer<typename Color::scalar> colors;
    colors.reserve(3 * rows * columns);
    for (std::size_t y = 0; y < rows; ++y) colors.append(color.row(y), color.row(y) + 3 * columns);
    buffer<float> disparities = checked_disparity(disparity);
    graph_builder g(static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows), rows * columns, unset);
    const image_view<const float> checked(disparities.data(), rows, columns, 1);
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y) place_row(checked, static_cast<std::int32_t>(y), facts.surface, g);
    });
    buffer<std::uint8_t> known(rows * columns, 1), matte(rows * columns, 0);
    using layers = layered_image<Color, disparity_column, known_column, matte_column>;
    return single_layer<Color, disparity_column, known_column, matte_column>(layers(
        std::move(g).build(detail::unchecked), std::move(colors), std::move(disparities), std::move(known), std::move(matte)));
}

}  // namespace detail

/// Lifts a photo to a single layer. Pixels are in canonical order, and every color is known.
///
/// color      H x W x 3
/// disparity  H x W x 1, in [0, 1], larger is nearer
/// facts      properties of the photo; their surface rule decides which neighbors are linked. The camera's width and height
///            must be those of the photo, or both 0
///
/// Raises mismatch if an image is empty, or if the images and the camera differ in size. Raises invalid_option for a threshold
/// that is negative or NaN, invalid_data for a disparity outside [0, 1] by more than a rounding error (1e-5), and too_large for
/// 2^31 pixels or more, or a side above max_lattice_side. Runs in linear time and uses 29 bytes per pixel.
template <executor Executor = const serial_executor>
photo_layer lift(image_view<const std::uint8_t> color, image_view<const float> disparity, const photo_facts& facts = {},
                 Executor&& threads = {}) {
    return detail::lift_colors<color_column>(color, disparity, facts, threads);
}
/// Lifts a photo with 16 bits per channel. The parameters and errors are the same. Uses 32 bytes per pixel.
template <executor Executor = const serial_executor>
single_layer<color16_column, disparity_column, known_column, matte_column> lift(image_view<const std::uint16_t> color,
                                                                                image_view<const float> disparity,
                                                                                const photo_facts& facts = {},
                                                                                Executor&& threads = {}) {
    return detail::lift_colors<color16_column>(color, disparity, facts, threads);
}

}}  // namespace ldi
