// Charts: the flat pieces into which charts/charts.hpp divides a layered image, and their positions in an atlas.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/charts/chart_pixels.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Maximum width and height of a chart's bounding box, in pixels: the default maximum side of an atlas
/// (atlas_options::max_side). Also bounds the polygons of charts (mesh/polygon.hpp).
inline constexpr std::int32_t max_chart_box = 8192;

/// A chart: a set of pixels connected by links, with at most one pixel at each lattice position of its bounding box.
struct chart {
    std::int32_t x = 0, y = 0;           ///< top left lattice position of the bounding box
    std::int32_t width = 0, height = 0;  ///< size of the bounding box in pixels
    chart_pixels pixels;                 ///< indices in the layered image
};

/// A partition of all pixels into charts.
struct chart_set {
    buffer<std::int32_t> chart_of;  ///< K: the chart of each pixel
    buffer<chart> charts;
};

/// Position of a chart in the atlas: the texel of the top left lattice position of its bounding box. Pixel i of chart c has the
/// texel (g.x()[i] - chart.x + placement.x, g.y()[i] - chart.y + placement.y).
struct chart_placement {
    std::int32_t x = 0, y = 0;
};

namespace detail {

/// Whether all pixels of a chart exist, are assigned to chart `c`, and lie in its bounding box.
inline bool fits_box(const chart& box, std::int32_t c, array_view<const std::int32_t> chart_of, const graph_view& g) {
    const auto last_of = [](std::int32_t first, std::int32_t length, std::int32_t lattice) {
        return static_cast<std::int32_t>(std::clamp(std::int64_t{first} + length, std::int64_t{0}, std::int64_t{lattice}) - 1);
    };
    const std::int32_t left = (std::max)(box.x, 0), right = last_of(box.x, box.width, g.width());
    const std::int32_t top = (std::max)(box.y, 0), bottom = last_of(box.y, box.height, g.height());
    const lattice_coordinate *const x = g.x().data(), *const y = g.y().data();
    std::int32_t different = 0, outside = 0;  // `outside` becomes negative if a pixel lies outside
    for (const chart_pixels::run& r : box.pixels.runs()) {
        if (r.count > g.count() - r.first) return false;
        for (std::int32_t p = r.first; p < r.first + r.count; ++p) {  // vectorized, because this runs over all pixels
            different |= chart_of[p] ^ c;
            outside |= (x[p] - left) | (right - x[p]) | (y[p] - top) | (bottom - y[p]);
        }
    }
    return different == 0 && outside >= 0;
}

}  // namespace detail

/// Raises mismatch unless the charts are a partition of the graph's pixels, and each pixel lies in the bounding box of its chart.
/// Raises too_large for a box with a side above max_chart_box.
///
/// where  place of the error, for the message
inline void check_charts(const chart_set& charts, const graph_view& g, const char* where) {
    const auto refuse = [&](const std::string& found) {
        raise(error_code::mismatch, where, "a partition of " + std::to_string(g.size()) + " pixels into charts", found);
    };
    if (charts.chart_of.size() != g.size()) refuse("chart_of for " + std::to_string(charts.chart_of.size()) + " pixels");
    std::size_t count = 0;
    for (std::int32_t c = 0; c < charts.charts.count(); ++c) {
        const chart& box = charts.charts[c];
        if (box.width > max_chart_box || box.height > max_chart_box)
            raise(error_code::too_large, where,
                  "charts of at most " + std::to_string(max_chart_box) + " x " + std::to_string(max_chart_box) + " pixels",
                  std::to_string(box.width) + " x " + std::to_string(box.height));
        count += box.pixels.size();
        if (!detail::fits_box(box, c, charts.chart_of, g))
            refuse("chart " + std::to_string(c) + ", whose pixels are not all in the graph, not all in its box of " +
                   std::to_string(box.width) + " x " + std::to_string(box.height) + " at (" + std::to_string(box.x) + ", " +
                   std::to_string(box.y) + "), or not all assigned to it by chart_of");
    }
    if (count != g.size()) refuse("charts with " + std::to_string(count) + " pixels in total");
}

}}  // namespace ldi
