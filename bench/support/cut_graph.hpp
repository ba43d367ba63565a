// Graphs with a given density of silhouettes, and stacks of layers.
#pragma once

#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph_builder.hpp>

#include <cstdint>
#include <utility>

namespace ldi_bench {

/// Makes an image without links between its squares of `side` x `side` pixels. With side 0, the image is whole.
inline ldi::graph cut_graph(std::int32_t width, std::int32_t height, std::int32_t side) {
    ldi::graph_builder b(ldi::make_grid(width, height));
    for (std::int32_t i = 0; side > 0 && i < width * height; ++i) {
        if (i % width != 0 && i % width % side == 0) b.unlink(i, ldi::side::left);
        if (i >= width && i / width % side == 0) b.unlink(i, ldi::side::up);
    }
    return std::move(b).build();
}

/// Makes `layers` images, one behind the other, in canonical order.
inline ldi::graph stacked_graph(std::int32_t width, std::int32_t height, std::int32_t layers) {
    ldi::graph_builder b(width, height);
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t layer = 0; layer < layers; ++layer)
            for (std::int32_t x = 0; x < width; ++x) {
                const std::int32_t pixel = (y * layers + layer) * width + x;
                b.add_pixel(x, y);
                if (x > 0) b.link(pixel, ldi::side::left, pixel - 1);
                if (y > 0) b.link(pixel, ldi::side::up, pixel - layers * width);
            }
    return std::move(b).build();
}

}  // namespace ldi_bench
