// The graph of a real photo at the paper's size, for the benchmarks of core.
#pragma once

#include "tests/support/sketched_graph.hpp"

#include <ldi/core/graph.hpp>
#include <ldi/io/depth_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace ldi::benchmarks {

inline constexpr std::int32_t photo_width = 1152, photo_height = 1536;

/// Makes a single layer of photo_width x photo_height pixels, linked except where the disparity of the sample differs by more
/// than 0.05.
inline graph photo_graph() {
    const image<float> disparity = load_depth_map(LDI_SOURCE_DIR "/examples/photo3d/sample_depth.png");
    const float largest = *std::max_element(disparity.begin(), disparity.end());
    testing::sketched_graph g(make_grid(photo_width, photo_height));
    const auto value = [&](std::int32_t pixel) {
        const std::size_t x = static_cast<std::size_t>(pixel % photo_width) * disparity.width() / photo_width;
        const std::size_t y = static_cast<std::size_t>(pixel / photo_width) * disparity.height() / photo_height;
        return disparity(y, x) / largest;
    };
    for (std::int32_t i = 0; i < photo_width * photo_height; ++i)
        for (const side s : {side::up, side::left})
            if (g.neighbor(i, s) != no_pixel && std::abs(value(i) - value(g.neighbor(i, s))) > 0.05F) g.unlink(i, s);
    return g;
}

}  // namespace ldi::benchmarks
