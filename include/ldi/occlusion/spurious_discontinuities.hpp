// Closes discontinuities that belong to no curve. The paper removes "spurious (shorter than 20 pixels) groups from consideration"
// (section "Occluded Surface Hallucination"). Surfaces do not grow behind such groups, so they would open as cracks and cut
// charts into slivers. Therefore, this stage links the pixels on both sides again, and the mesh spans the step.
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
    buffer<std::pair<std::int32_t, std::int32_t>> kept;  // pairs across curves: left or upper pixel, right or lower pixel
    for (const discontinuity_curve& c : curves)
        for (const discontinuity& d : c.sides) kept.emplace_back((std::min)(d.back, d.front), (std::max)(d.back, d.front));
    std::sort(kept.begin(), kept.end());

    std::size_t made = 0;
    const std::int32_t width = layer.topology().width(), height = layer.topology().height();
    layer.edit_links([&](link_editor& links) {
        const auto close = [&](std::int32_t pixel, side s, std::int32_t other) {
            if (links.neighbor(pixel, s) != no_pixel || std::binary_search(kept.begin(), kept.end(), std::pair{pixel, other}))
                return;
            links.link(pixel, s, other);
            ++made;
        };
        for (std::int32_t y = 0, pixel = 0; y < height; ++y)
            for (std::int32_t x = 0; x < width; ++x, ++pixel) {
                if (x + 1 < width) close(pixel, side::right, pixel + 1);
                if (y + 1 < height) close(pixel, side::down, pixel + width);
            }
    });
    return made;
}

}}  // namespace ldi
