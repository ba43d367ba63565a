// Lattice positions whose pixels the constraints of charts/charts.hpp may exclude from a chart.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>

#include <algorithm>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Maximum of chart_options::filter_range, in pixels.
inline constexpr std::int32_t max_filter_range = 8;

/// Returns H x W values, row-major: 1 at lattice positions with several pixels, and within `range` rows and columns of the end of
/// a surface; 0 elsewhere. In a photo, almost all values are 0. Around a position with value 0, all pixels within `range` rows
/// and columns belong to one surface, so constraint 3 holds there.
///
/// range  1 to max_filter_range
inline buffer<std::uint8_t> contested_positions(const graph_view& g, std::int32_t range) {
    constexpr std::uint8_t taken = 1, contested = 2;
    buffer<std::uint8_t> positions(g.position_count(), 0);
    const auto row_of = [&](std::int32_t y) { return positions.data() + g.position(0, y); };
    const auto has_all_links = [&](std::int32_t i) {
        return (g.up()[i] | g.down()[i] | g.left()[i] | g.right()[i]) >= 0;  // negative if any link is no_pixel
    };
    for_each_run(g, [&](pixel_run r) {
        std::uint8_t* const row = row_of(g.y()[r.first]) + g.x()[r.first];
        for (std::int32_t k = 0; k < r.size(); ++k) row[k] |= (row[k] & taken) == 0 ? taken : contested;
    });
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (has_all_links(i)) continue;
        const std::int32_t x = g.x()[i], y = g.y()[i];
        const bool ends = (g.up()[i] == no_pixel && y > 0) || (g.down()[i] == no_pixel && y + 1 < g.height()) ||
                          (g.left()[i] == no_pixel && x > 0) || (g.right()[i] == no_pixel && x + 1 < g.width());
        if (!ends) continue;
        const std::int32_t left = std::max<std::int32_t>(x - range, 0), right = std::min<std::int32_t>(x + range, g.width() - 1);
        const std::int32_t last = std::min<std::int32_t>(y + range, g.height() - 1);
        for (std::int32_t v = std::max<std::int32_t>(y - range, 0); v <= last; ++v)
            for (std::int32_t u = left; u <= right; ++u) row_of(v)[u] |= contested;
    }
    for (std::uint8_t& p : positions) p = static_cast<std::uint8_t>(p >> 1);
    return positions;
}

}}}  // namespace ldi::detail
