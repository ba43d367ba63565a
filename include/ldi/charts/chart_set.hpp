// Charts: flat pieces of a layered image (charts/charts.hpp divides one), and their positions in an atlas.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A chart: connected by links, with at most one pixel at each lattice position of its bounding box.
struct chart {
    std::int32_t x = 0, y = 0;           ///< top left lattice position of the bounding box
    std::int32_t width = 0, height = 0;  ///< size of the bounding box in pixels
    buffer<std::int32_t> pixels;         ///< indices in the layered image, ascending
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

/// Raises mismatch unless the charts are a partition of the graph's pixels, and each pixel lies in the bounding box of its chart.
inline void check_charts(const chart_set& charts, const graph_view& g, const char* where) {
    std::size_t count = 0;
    bool fits = charts.chart_of.size() == g.size();
    for (std::int32_t c = 0; fits && c < charts.charts.count(); ++c) {
        const chart& box = charts.charts[c];
        count += box.pixels.size();
        const auto is_inside = [](std::int32_t value, std::int32_t first, std::int32_t length) {
            return static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(first) < static_cast<std::uint32_t>(length);
        };
        const std::int32_t *const x = g.x().data(), *const y = g.y().data(), *const chart_of = charts.chart_of.data();
        std::int32_t previous = no_pixel;
        if (g.size() == 0) break;
        for (const std::int32_t pixel : box.pixels) {  // without branches, because this runs over all pixels
            const bool is_pixel = is_inside(pixel, 0, g.count());
            const std::int32_t p = is_pixel ? pixel : 0;
            fits &= is_pixel & (pixel > previous) & (chart_of[p] == c) & is_inside(x[p], box.x, box.width) &
                    is_inside(y[p], box.y, box.height);
            previous = pixel;
        }
    }
    if (!fits || count != g.size())
        raise(error_code::mismatch, where, "charts of these " + std::to_string(g.size()) + " pixels", "charts of other pixels");
}

}  // namespace detail

}}  // namespace ldi
