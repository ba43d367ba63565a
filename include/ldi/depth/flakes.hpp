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
    /// Connected components with fewer pixels than this are flakes; with 0 or 1, none is for its size.
    std::int32_t min_size = 20;
    /// A larger component is a flake if it touches a nearer and a farther surface, each along at least an eighth of its border
    /// with other components, and if its mean width is below this many pixels; 0 or more. The mean width is twice the size
    /// divided by the length of that border.
    float min_width = 4.0F;
};

namespace detail {

/// Counts the contacts of every component.
inline buffer<contacts> contacts_of_all(const image_components& components, std::int32_t count,
                                        image_view<const float> disparity) {
    buffer<contacts> result(static_cast<std::size_t>(count));
    const auto touch = [&](std::int32_t a, std::int32_t b, float of_a, float of_b) {
        result[a].add(of_b > of_a), result[b].add(of_a > of_b);
    };
    for (std::int32_t y = 0; y + 1 < components.row_start.count(); ++y) {
        const float* const here = disparity.row(y);
        const std::int32_t row = y * components.columns, first = components.row_start[y], last = components.row_start[y + 1];
        for (std::int32_t r = first + 1; r < last; ++r) {
            const std::int32_t x = components.runs[r].first - row;
            if (components.label[r - 1] != components.label[r])
                touch(components.label[r - 1], components.label[r], here[x - 1], here[x]);
        }
        if (y == 0) continue;
        const float* const over = disparity.row(y - 1);
        for_each_overlap(components.runs, components.row_start, last, y, components.columns,
                         [&](std::int32_t above, std::int32_t run, std::int32_t left, std::int32_t right) {
                             const std::int32_t a = components.label[above], b = components.label[run];
                             for (std::int32_t x = left; x < right && a != b; ++x) touch(a, b, over[x], here[x]);
                         });
    }
    return result;
}

/// Whether a component is narrow and lies between a nearer and a farther surface.
inline bool is_narrow_middle(std::int32_t size, contacts touched, float min_width) {
    const std::int64_t border = std::int64_t{touched.nearer} + touched.farther;
    return border > 0 && 8 * std::int64_t{(std::min)(touched.nearer, touched.farther)} >= border &&
           2.0 * nearest_double(size) < double{min_width} * nearest_double(border);
}

/// A flake, in the order of merging.
struct flake {
    std::size_t component;  // index in chosen_components
    bool is_front;          // most of its decided pixels belong to the front surface
    bool is_decided;        // has decided pixels
    float disparity;        // of its first pixel

    /// Flakes of the back come first, the farthest of them first; then those of the front, the nearest first. In a stair of
    /// flakes, each one then follows the flake from which it gets its disparities.
    friend bool operator<(const flake& a, const flake& b) {
        if (a.is_front != b.is_front) return b.is_front;
        if (a.disparity != b.disparity) return (a.disparity < b.disparity) != a.is_front;
        return a.component < b.component;
    }
};

/// Merges flakes in their order. A flake whose neighbors on the chosen side are all flakes, too, waits until one of them has
/// been merged.
class flake_merger {
public:
    /// flakes  in order
    flake_merger(const image_components& components, std::int32_t component_count, const chosen_components& chosen,
                 const buffer<flake>& flakes, image_view<float> disparity)
        : chosen_(chosen),
          flakes_(flakes),
          disparity_(disparity),
          merger_(components, chosen, disparity),
          state_of_(static_cast<std::size_t>(component_count), merged),
          flake_of_(static_cast<std::size_t>(component_count), 0),
          attempts_(flakes.size(), 0) {
        for (std::int32_t f = 0; f < flakes.count(); ++f) flake_of_[label(f)] = f, state_of_[label(f)] = ready;
    }

    /// Returns the number of merged flakes: all of them if any component is not a flake.
    std::size_t run() {
        for (const bool takes_any_side : {false, true}) {
            buffer<std::int32_t> queue;
            for (std::int32_t f = 0; f < flakes_.count(); ++f)
                if (state_of_[label(f)] != merged) state_of_[label(f)] = ready, attempts_[f] = 0, queue.push_back(f);
            for (std::int32_t i = 0; i < queue.count(); ++i) {
                if (merge(queue[i], takes_any_side))
                    wake_neighbors(queue[i], queue);
                else
                    state_of_[label(queue[i])] = waiting;
            }
        }
        return count_;
    }

private:
    enum state : std::uint8_t { merged, ready, waiting };  // `merged` is also the state of surfaces

    /// Maximum number of attempts to merge a flake with the chosen side. Keeps the time linear for large flakes among many small
    /// ones.
    static constexpr std::uint8_t max_attempts = 4;

    std::int32_t label(std::int32_t f) const { return chosen_.labels[flakes_[f].component]; }

    /// Returns false if the flake has no merged neighbor on the chosen side, or on any side if `takes_any_side`.
    bool merge(std::int32_t f, bool takes_any_side) {
        ++attempts_[f];
        const flake& it = flakes_[f];
        const auto is_merged = [&](std::int32_t other) { return state_of_[other] == merged; };
        contacts all, usable;
        merger_.for_each_contact(it.component, [&](std::int32_t x, std::int32_t y, float there, std::int32_t other) {
            const bool is_nearer = there > disparity_(y, x);
            all.add(is_nearer);
            if (is_merged(other)) usable.add(is_nearer);
        });
        const bool prefers_nearer = it.is_decided ? it.is_front : all.nearer > all.farther;
        bool to_nearer = all.farther == 0 || (prefers_nearer && all.nearer > 0);
        if ((to_nearer ? usable.nearer : usable.farther) == 0) {
            to_nearer = !to_nearer;
            if (!takes_any_side || (to_nearer ? usable.nearer : usable.farther) == 0) return false;
        }
        merger_.merge(it.component, to_nearer, is_merged);
        state_of_[label(f)] = merged, ++count_;
        return true;
    }

    void wake_neighbors(std::int32_t f, buffer<std::int32_t>& queue) {
        merger_.for_each_contact(flakes_[f].component, [&](std::int32_t, std::int32_t, float, std::int32_t other) {
            if (state_of_[other] != waiting || attempts_[flake_of_[other]] == max_attempts) return;
            state_of_[other] = ready, queue.push_back(flake_of_[other]);
        });
    }

    const chosen_components& chosen_;
    const buffer<flake>& flakes_;
    image_view<const float> disparity_;
    component_merger merger_;
    buffer<std::uint8_t> state_of_;  // per component of the photo
    buffer<std::int32_t> flake_of_;  // per component of the photo: index in flakes_, if it is a flake
    buffer<std::uint8_t> attempts_;  // per flake
    std::size_t count_ = 0;
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
/// from the shared sides. A flake inside another flake is merged after it. If the map consists of flakes only, it does not
/// change.
///
/// Time is linear, except for sorting the flakes and for binary searches, for each of their pixels, among the runs of a row.
/// Memory is up to 100 bytes per pixel. Raises mismatch if an image has another shape, invalid_data for disparities that are not
/// finite, too_large for 2^31 pixels or more, and invalid_option for a min_width below 0.
inline std::size_t merge_flakes(image_view<float> disparity, image_view<const std::uint8_t> shares, surface_rule surface = {},
                                const flake_options& options = {}) {
    detail::check_map(disparity, "merge_flakes");
    detail::check_pixel_count(disparity, "merge_flakes");
    detail::check_finite(disparity, "merge_flakes");
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

    if (chosen.labels.size() == size.size()) return 0;  // there is no surface to merge with
    buffer<detail::flake> flakes;
    flakes.reserve(chosen.labels.size());
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
    return detail::flake_merger(components, size.count(), chosen, flakes, disparity).run();
}

}}  // namespace ldi
