// The k x k windows of an image laid out as the rows of a matrix, so that a dense convolution becomes a matrix product.
#pragma once

#include <ldi/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi {

/// An image and how a convolution looks at it: `side / 2` pixels of padding all round.
struct window_geometry {
    std::size_t height = 0, width = 0, channels = 0;  ///< of the image
    std::size_t side = 1;                             ///< k, odd
    std::size_t stride = 1;
    std::uint8_t padding = 0;  ///< the value of what lies outside the image

    std::size_t result_height() const { return (height - 1) / stride + 1; }
    std::size_t result_width() const { return (width - 1) / stride + 1; }
};

/// Writes the windows of result pixels (first_x .. first_x + count - 1, y), one after the other, each k x k x channels.
inline void window_rows(const window_geometry& g, const std::uint8_t* image, std::size_t y, std::size_t first_x,
                        std::size_t count, std::uint8_t* windows) {
    const std::size_t margin = g.side / 2;
    for (std::size_t x = first_x; x < first_x + count; ++x)
        for (std::size_t ky = 0; ky < g.side; ++ky)
            for (std::size_t kx = 0; kx < g.side; ++kx, windows += g.channels) {
                // One margin more than the position that is read, so that it never goes below zero.
                const std::size_t row = y * g.stride + ky, column = x * g.stride + kx;
                const bool inside = row >= margin && row < g.height + margin && column >= margin && column < g.width + margin;
                if (inside)
                    std::memcpy(windows, image + ((row - margin) * g.width + column - margin) * g.channels, g.channels);
                else
                    std::memset(windows, g.padding, g.channels);
            }
}

}  // namespace ldi
