// Charts: flat pieces of a layered image, each of which fits in one texture (paper, section "Texture Atlas Generation", Chart
// generation). The algorithm visits pixels in order. Each pixel without a chart becomes the seed of a new one, which grows
// breadth-first along links under the paper's three constraints:
//     1. No overlap: a chart has at most one pixel per lattice position.
//     2. The size of the bounding box is limited, so that charts pack well.
//     3. Near the end of a surface, the chart must not contain pixels of other surfaces, so that texture filtering never mixes
//        two surfaces. Such pixels go to another chart.
// Constraints 1 and 3 can exclude only contested pixels: those near the end of a surface, and those at a position with several
// pixels. Contested pixels join a chart after all others, nearest first. This keeps the surface that the photo shows in one
// piece; only the surfaces behind it are divided. (In plain breadth-first order, the background's hidden part would reach the end
// of a silhouette before the front surface, and cut a piece out of the front surface.)
// The paper states constraint 3 only for the front side of depth edges. This code applies it wherever two surfaces of a chart
// would come close to each other. Otherwise, texture filtering would mix the end of a hidden surface with the surface that hides
// it.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/charts/detail/chart_grower.hpp>
#include <ldi/charts/detail/contested_positions.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of make_charts().
struct chart_options {
    /// Maximum width and height of a bounding box, in pixels; 16 to max_chart_box. The photo's width and height are divided
    /// evenly: with a limit of 1000, 1152 pixels become two charts of 576, not 1000 and 152. In a test with ten photos of
    /// 1152 x 1536, eight had the best atlas when the photo was not divided: their charts filled 0.58 to 0.89 of the atlas, and
    /// the atlas compressed 3 to 5 % smaller than with a limit of 512. The default therefore divides only larger photos.
    std::int32_t max_side = 2048;
    /// Range of the texture filter, 1 to 8: within this many rows and columns of a pixel, its chart has no pixel of a different
    /// surface.
    std::int32_t filter_range = 4;
    /// Maximum total area of all bounding boxes in pixels, three quarters of the largest atlas. If charts wind around each other,
    /// like rings, their boxes overlap and may exceed this area. make_charts() then reduces max_side, to 64 if necessary; charts
    /// of that size may exceed any limit.
    std::int64_t max_area = std::int64_t{3} << 24;
};

namespace detail {

/// Estimates the total area of the bounding boxes, in pixels, after charts are divided so that no side exceeds `side`. The result
/// is exact if no side exceeds this limit already. If the longer side L of a box exceeds the limit, multiplies the box's area by
/// `side` / L: about L / `side` pieces cover a winding chart, and each piece's box has (`side` / L)^2 of the area.
inline std::int64_t area_of_boxes(const chart_set& charts, std::int32_t side) {
    std::int64_t area = 0;
    for (const chart& c : charts.charts) {
        const std::int64_t longest = (std::max)(c.width, c.height);
        area += std::int64_t{c.width} * c.height * (std::min<std::int64_t>)(side, longest) / longest;
    }
    return area;
}

}  // namespace detail

/// Partitions all pixels of a layered image into charts. `surface` is the rule by which its pixels are linked. Raises
/// invalid_option if an option is outside its range, invalid_data for a disparity that is not finite, mismatch if `layers` is
/// a view whose graph violates an invariant, and too_large for a lattice of 2^31 positions or more. Time is linear in pixels and
/// positions. If the boxes exceed max_area, charts are grown again with a smaller limit: usually once, and at most five times
/// with the default max_side. Memory is up to 33 bytes per pixel, 6 per position of the lattice, and 120 per chart.
template <has_columns<disparity_column> Layers>
chart_set make_charts(const Layers& layers, surface_rule surface, const chart_options& options = {}) {
    if (options.max_side < 16 || options.max_side > max_chart_box)
        raise(error_code::invalid_option, "max_side", "16 to " + std::to_string(max_chart_box), std::to_string(options.max_side));
    if (options.filter_range < 1 || options.filter_range > detail::max_filter_range)
        raise(error_code::invalid_option, "filter_range", "1 to 8", std::to_string(options.filter_range));
    check_topology(layers.topology(), "make_charts");
    check_disparities(layers.template column<disparity_column>(), "make_charts");
    constexpr std::int32_t min_side = 64;
    const graph_view& g = layers.topology();
    if (g.position_count() > std::size_t{(std::numeric_limits<std::int32_t>::max)()})
        raise(error_code::too_large, "make_charts", "a lattice of fewer than 2^31 positions",
              std::to_string(g.width()) + " x " + std::to_string(g.height()));
    std::int32_t side = (std::min)(options.max_side, (std::max)({g.width(), g.height(), 16}));
    while (true) {
        chart_set charts =
            detail::chart_grower(g, layers.template column<disparity_column>(), surface, side, options.filter_range).grow_all();
        if (side <= min_side || detail::area_of_boxes(charts, side) <= options.max_area) return charts;
        do side = (std::max)(min_side, side / 2);
        while (side > min_side && detail::area_of_boxes(charts, side) > options.max_area);
    }
}

}}  // namespace ldi
