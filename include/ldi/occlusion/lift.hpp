// Lifting: a photo and its disparity become a layered image with one layer (paper, section "Lifting to Layered Depth Image").
// Neighbors are linked except across discontinuities.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi {

struct lift_options {
    /// Neighbors that differ by more than this in disparity are on different surfaces (the paper's tau_disp).
    float discontinuity_threshold = 0.05F;
};

/// color     H x W x 3
/// disparity  H x W x 1, in [0, 1], larger is nearer
///
/// Pixel (x, y) of the result has index y * W + x, which is canonical order; every color is known. Raises error_code::mismatch
/// if the images differ in size or have no pixel, error_code::too_large if they have 2^31 or more.
template <executor Executor = const serial_executor>
photo_layers lift(const image<std::uint8_t>& color, const image<float>& disparity, const lift_options& options = {},
                  Executor&& threads = {}) {
    const std::size_t rows = disparity.height(), columns = disparity.width();
    if (color.height() != rows || color.width() != columns || color.channels() != 3 || disparity.channels() != 1 || rows == 0 ||
        columns == 0)
        raise(error_code::mismatch, "lift", "a photo H x W x 3 and a disparity map H x W x 1 of the same size",
              std::to_string(color.height()) + " x " + std::to_string(color.width()) + " x " + std::to_string(color.channels()) +
                  " and " + std::to_string(rows) + " x " + std::to_string(columns) + " x " + std::to_string(disparity.channels()));
    if (rows > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()) / columns)
        raise(error_code::too_large, "lift", "fewer than 2^31 pixels", std::to_string(columns) + " x " + std::to_string(rows));

    photo_layers layers;
    graph& g = layers.topology;
    g.width = static_cast<std::int32_t>(columns), g.height = static_cast<std::int32_t>(rows);
    g.resize(rows * columns);
    layers.column<color_column>().assign(color.data(), color.data() + 3 * rows * columns);
    layers.column<disparity_column>().assign(disparity.data(), disparity.data() + rows * columns);
    layers.column<known_column>().assign(rows * columns, 1);

    const float threshold = options.discontinuity_threshold;
    const std::int32_t stride = g.width;
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y) {
            const float* here = disparity.row(y);
            const float* above = y > 0 ? disparity.row(y - 1) : nullptr;
            const float* below = y + 1 < rows ? disparity.row(y + 1) : nullptr;
            const std::size_t start = y * columns;
            const std::int32_t index = static_cast<std::int32_t>(start);
            for (std::int32_t x = 0; x < stride; ++x) {
                g.x[start + static_cast<std::size_t>(x)] = x;
                g.y[start + static_cast<std::size_t>(x)] = static_cast<std::int32_t>(y);
            }
            const auto link_vertically = [&](std::int32_t* links, const float* other, std::int32_t step) {
                for (std::int32_t x = 0; x < stride; ++x)
                    links[x] = other != nullptr && std::abs(here[x] - other[x]) <= threshold ? index + x + step : no_pixel;
            };
            link_vertically(g.up.data() + start, above, -stride);
            link_vertically(g.down.data() + start, below, stride);
            std::int32_t* left = g.left.data() + start;
            std::int32_t* right = g.right.data() + start;
            left[0] = no_pixel;
            for (std::int32_t x = 0; x + 1 < stride; ++x) {
                const bool linked = std::abs(here[x] - here[x + 1]) <= threshold;
                right[x] = linked ? index + x + 1 : no_pixel;
                left[x + 1] = linked ? index + x : no_pixel;
            }
            right[stride - 1] = no_pixel;
        }
    });
    return layers;
}

}  // namespace ldi
