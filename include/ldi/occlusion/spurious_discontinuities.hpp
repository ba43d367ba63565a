// Closes discontinuities that belong to no curve. The paper removes "spurious (shorter than 20 pixels) groups from consideration"
// (section "Occluded Surface Hallucination"). Surfaces do not grow behind such groups, so the groups would open as cracks and cut
// charts into slivers. Therefore, this stage links the pixels on both sides of each such discontinuity, so that the mesh spans
// the step in depth.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Links all neighbors inside the photo, except across a curve. Returns the number of links made.
///
/// curves  the discontinuities to keep; raises mismatch for curves of another layer
template <payload_column... Columns>
std::size_t close_spurious_discontinuities(single_layer<Columns...>& layer, std::span<const discontinuity_curve> curves) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    detail::check_curves(curves, layer.topology(), layer.template column<disparity_column>(), "close_spurious_discontinuities");
    buffer<std::pair<std::int32_t, std::int32_t>> kept;  // pixels on both sides of a curve: left and right, or upper and lower
    for (const discontinuity_curve& c : curves)
        for (const discontinuity& d : c.sides) kept.emplace_back((std::min)(d.back, d.front), (std::max)(d.back, d.front));
    std::sort(kept.begin(), kept.end());

    struct open_link {
        std::int32_t pixel, other;
        side toward;
    };
    buffer<open_link> open;
    const graph_view g = layer.topology();
    const auto find = [&](std::int32_t pixel, side s, std::int32_t other) {
        if (g.neighbor(pixel, s) == no_pixel && !std::binary_search(kept.begin(), kept.end(), std::pair{pixel, other}))
            open.push_back({pixel, other, s});
    };
    for (std::int32_t y = 0, pixel = 0; y < g.height(); ++y)
        for (std::int32_t x = 0; x < g.width(); ++x, ++pixel) {
            if (x + 1 < g.width()) find(pixel, side::right, pixel + 1);
            if (y + 1 < g.height()) find(pixel, side::down, pixel + g.width());
        }
    layer.edit_links([&](link_editor& links) {
        for (const open_link& o : open) links.link(o.pixel, o.toward, o.other);
    });
    return open.size();
}

}}  // namespace ldi
