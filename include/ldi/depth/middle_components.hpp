// Removes artifacts of the weighted median: isolated features at middle values, between a foreground and a background (paper,
// section "Depth Pre-processing", connected components).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/detail/check_map.hpp>
#include <ldi/depth/detail/image_components.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of merge_middle_components().
struct middle_component_options {
    /// Only components with fewer pixels than this are merged.
    std::int32_t min_size = 20;
};

/// Merges small components at middle values with a neighboring surface. Returns the number of merged components.
///
/// disparity  H x W x 1, changed in place
/// surface    rule that decides whether neighboring pixels belong to one surface
///
/// A component of fewer than `min_size` pixels that touches both nearer and farther pixels gets the disparities of the group
/// with which it shares more pixel sides, or of the farther pixels in case of a tie. These disparities spread inward from the
/// shared pixel sides. A component that touches only nearer or only farther pixels is a small hole or a small foreground
/// object, not a middle value, and does not change. Time is linear, except that each pixel of a small component requires binary
/// searches among the runs of a row. Memory is up to 60 bytes per pixel. Raises mismatch for another number of channels,
/// too_large for 2^31 pixels or more.
inline std::size_t merge_middle_components(image_view<float> disparity, surface_rule surface = {},
                                           const middle_component_options& options = {}) {
    detail::check_map(disparity, "merge_middle_components");
    detail::check_pixel_count(disparity, "merge_middle_components");
    const detail::image_components components = detail::find_components(disparity, surface);
    const buffer<std::int32_t> size = detail::component_sizes(components);
    const detail::chosen_components small_ones =
        detail::choose_components(components, size.count(), [&](std::int32_t label) { return size[label] < options.min_size; });
    detail::component_merger merger(components, small_ones, disparity);
    std::size_t merged = 0;
    constexpr auto any = [](std::int32_t) { return true; };
    for (std::size_t c = 0; c < small_ones.labels.size(); ++c) {
        detail::contacts touched;
        merger.for_each_contact(
            c, [&](std::int32_t x, std::int32_t y, float other, std::int32_t) { touched.add(other > disparity(y, x)); });
        if (touched.nearer == 0 || touched.farther == 0) continue;
        merger.merge(c, touched.nearer > touched.farther, any), ++merged;
    }
    return merged;
}

}}  // namespace ldi
