// Charts: flat pieces of a layered image that can lie in one texture (paper, section "Texture Atlas Generation", Chart
// generation).
#pragma once

#include <ldi/core/graph.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace ldi {

/// One chart: at most one pixel at each lattice position of its bounding box.
struct chart {
    std::int32_t x = 0, y = 0;           ///< top left lattice position of the bounding box
    std::int32_t width = 0, height = 0;  ///< of the bounding box, in pixels
    std::vector<std::int32_t> pixels;    ///< its pixels' indices in the layered image, ascending
};

/// A partition of all pixels into charts.
struct chart_set {
    std::vector<std::int32_t> chart_of;  ///< K: the chart that a pixel belongs to
    std::vector<chart> charts;
};

/// Where a chart lies in the atlas: the texel of the top left lattice position of its bounding box. Pixel i of chart c has the
/// texel (g.x[i] - chart.x + placement.x, g.y[i] - chart.y + placement.y).
struct chart_placement {
    std::int32_t x = 0, y = 0;
};

}  // namespace ldi
