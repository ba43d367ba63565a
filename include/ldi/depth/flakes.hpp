// Merges flakes: specks, and narrow surfaces between a nearer and a farther surface, which no scene contains. They remain where
// a silhouette_decider (depth/decided_depth.hpp) assigns pixels to a front or a back surface whose own disparity was blurred,
// for example in the notch between two petals. Each flake would get its own curves, hidden surfaces and charts. A mesh does not
// represent a speck inside a surface either, so the surfaces behind it would show a hole there.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/detail/check_map.hpp>
#include <ldi/depth/detail/image_components.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of merge_flakes(), for a depth map whose samples are one pixel wide. The defaults were tuned on forty photographs.
struct flake_options {
    /// Connected components with fewer pixels than this are flakes.
    std::int32_t min_size = 20;
    /// A larger component is a flake if it touches a nearer and a farther surface, each along at least an eighth of its border,
    /// and if its mean width, which is twice its size divided by the length of its border, is below this many pixels; 0 or more.
    float min_width = 4.0F;
};

namespace detail {

/// Counts the contacts of every component.
inline buffer<contacts> contacts_of_all(const image_components& components, std::int32_t count,
                                        image_view<const float> disparity) {
    buffer<contacts> result(static_cast<std::size_t>(count));
    const auto touch = [&](std::int32_t a, std::int32_t b, float of_a, float of_b) {
        if (a == b) return;
        ++(of_a > of_b ? result[a].farther : result[a].nearer);
        ++(of_a > of_b ? result[b].nearer : result[b].farther);
    };
    for (std::int32_t y = 0; y + 1 < components.row_start.count(); ++y) {
        const float* const here = disparity.row(y);
        const std::int32_t row = y * components.columns, first = components.row_start[y], last = components.row_start[y + 1];
        for (std::int32_t r = first + 1; r < last; ++r) {
            const std::int32_t x = components.runs[r].first - row;
            touch(components.label[r - 1], components.label[r], here[x - 1], here[x]);
        }
        if (y == 0) continue;
        const float* const over = disparity.row(y - 1);
        for (std::int32_t above = components.row_start[y - 1], run = first; above < first && run < last;) {
            const pixel_run &a = components.runs[above], &b = components.runs[run];
            if (components.label[above] != components.label[run])
                for (std::int32_t x = (std::max)(a.first + components.columns, b.first) - row;
                     x < (std::min)(a.last + components.columns, b.last) - row; ++x)
                    touch(components.label[above], components.label[run], over[x], here[x]);
            const bool above_ends = a.last + components.columns <= b.last, here_ends = b.last <= a.last + components.columns;
            above += above_ends ? 1 : 0, run += here_ends ? 1 : 0;
        }
    }
    return result;
}

/// Whether a component is narrow and lies between a nearer and a farther surface.
inline bool is_narrow_middle(std::int32_t size, contacts touched, float min_width) {
    const std::int32_t border = touched.nearer + touched.farther;
    return border > 0 && (std::min)(touched.nearer, touched.farther) >= (border + 7) / 8 &&
           2.0F * nearest_float(size) < min_width * nearest_float(border);
}

/// A flake, in the order of merging.
struct flake {
    std::size_t component;  // index in chosen_components
    bool is_front;          // most of its decided pixels belong to the front surface
    bool is_decided;        // has decided pixels
    float disparity;        // of its first pixel

    /// Flakes of the back come first, the farthest of them first; then those of the front, the nearest first. Each flake then
    /// takes the disparity of a surface, not the disparity of another flake that has yet to be merged.
    friend bool operator<(const flake& a, const flake& b) {
        if (a.is_front != b.is_front) return b.is_front;
        if (a.disparity != b.disparity) return (a.disparity < b.disparity) != a.is_front;
        return a.component < b.component;
    }
};

}  // namespace detail

/// Merges flakes with a neighboring surface. Returns their number.
///
/// disparity  H x W x 1, changed in place
/// shares     H x W x 1, decided_depth::shares: whether pixels belong to the front or the back surface
/// surface    rule that decides whether neighboring pixels belong to one surface
///
/// A flake gets the disparities of its nearer neighbors if most of its decided pixels belong to the front surface, and those of
/// its farther neighbors otherwise. If it has only nearer or only farther neighbors, it gets their disparities. If none of its
/// pixels is decided, it gets the disparities of the group with which it shares more pixel sides. The disparities spread inward
/// from the shared sides.
///
/// Time is linear, except for sorting the flakes and for binary searches, for each of their pixels, among the runs of a row.
/// Memory is up to 70 bytes per pixel. Raises mismatch if an image has another shape, too_large for 2^31 pixels or more, and
/// invalid_option for a min_width below 0.
inline std::size_t merge_flakes(image_view<float> disparity, image_view<const std::uint8_t> shares, surface_rule surface = {},
                                const flake_options& options = {}) {
    detail::check_map(disparity, "merge_flakes");
    detail::check_pixel_count(disparity, "merge_flakes");
    if (shares.height() != disparity.height() || shares.width() != disparity.width() || shares.channels() != disparity.channels())
        raise(error_code::mismatch, "merge_flakes, shares", detail::shape_text(disparity), detail::shape_text(shares));
    if (!(options.min_width >= 0.0F))
        raise(error_code::invalid_option, "flake_options::min_width", "0 or more", detail::to_text(options.min_width));
    const detail::image_components components = detail::find_components(disparity, surface);
    const buffer<std::int32_t> size = detail::component_sizes(components);
    const buffer<detail::contacts> touched = detail::contacts_of_all(components, size.count(), disparity);
    const detail::chosen_components chosen = detail::choose_components(components, size.count(), [&](std::int32_t label) {
        return size[label] < options.min_size || detail::is_narrow_middle(size[label], touched[label], options.min_width);
    });

    buffer<detail::flake> flakes;
    for (std::size_t c = 0; c < chosen.labels.size(); ++c) {
        std::int32_t front = 0, back = 0;
        chosen.for_each_pixel(c, [&](std::int32_t i) {
            const std::uint8_t share = shares.row(i / components.columns)[i % components.columns];
            if (share != 0) ++(share >= 128 ? front : back);
        });
        const std::int32_t first = chosen.runs[chosen.first_run[c]].first;
        flakes.push_back({c, front > back, front + back > 0, disparity(first / components.columns, first % components.columns)});
    }
    std::sort(flakes.begin(), flakes.end());
    detail::component_merger merger(components, chosen, disparity);
    std::size_t merged = 0;
    for (const detail::flake& f : flakes) {
        const detail::contacts now = merger.contacts_of(f.component);
        if (now.nearer + now.farther == 0) continue;  // the flake is the whole photo
        const bool prefers_nearer = f.is_decided ? f.is_front : now.nearer > now.farther;
        merger.merge(f.component, now.farther == 0 || (prefers_nearer && now.nearer > 0)), ++merged;
    }
    return merged;
}

}}  // namespace ldi
