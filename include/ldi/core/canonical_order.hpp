// The canonical order of pixels. Pixels are sorted by scanline. Within a scanline, maximal runs of pixels linked from left to
// right are sorted by the x of their first pixel, then by disparity, nearest first. The pixels of a run are contiguous. In this
// order, most of an LDI consists of long runs, which kernels process like rows of an ordinary image.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Whether a run precedes another run of its scanline in canonical order. The index of the first pixel decides between runs whose
/// first pixels have the same x and the same disparity.
///
/// x, pixel              x and index of the run's first pixel
/// other_x, other_pixel  the same for the other run
/// disparity             disparity(pixel) returns the disparity of a first pixel; must not be NaN
template <class Disparity>
bool run_precedes(std::int32_t x, std::int32_t pixel, std::int32_t other_x, std::int32_t other_pixel, Disparity&& disparity) {
    if (x != other_x) return x < other_x;
    const float nearness = disparity(pixel), other_nearness = disparity(other_pixel);
    return nearness != other_nearness ? nearness > other_nearness : pixel < other_pixel;
}

namespace detail {

/// canonical_order() for a graph whose invariants hold.
inline buffer<std::int32_t> order_of_sound(const graph_view& g, std::span<const float> disparity) {
    if (!disparity.empty() && disparity.size() != g.size())
        raise(error_code::mismatch, "canonical_order", std::to_string(g.size()) + " disparities",
              std::to_string(disparity.size()));
    // Counts the runs of every scanline, then sorts their first pixels by scanline.
    buffer<std::size_t> first_run(static_cast<std::size_t>(g.height()) + 1, 0);
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (g.left()[i] == no_pixel) ++first_run[g.y()[i] + 1];
    for (std::size_t y = 1; y < first_run.size(); ++y) first_run[y] += first_run[y - 1];
    buffer<std::int32_t> starts(first_run.back());
    buffer<std::size_t> next(first_run.begin(), first_run.end() - 1);
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (g.left()[i] == no_pixel) starts[next[g.y()[i]]++] = i;

    const float* const nearness = disparity.empty() ? nullptr : disparity.data();
    const auto before = [&](std::int32_t a, std::int32_t b) {
        return run_precedes(g.x()[a], a, g.x()[b], b,
                            [&](std::int32_t pixel) { return nearness == nullptr ? 0.0F : nearness[pixel]; });
    };
    if (nearness != nullptr)
        for (const std::int32_t start : starts)
            if (std::isnan(nearness[start]))
                raise(error_code::invalid_data, "canonical_order", "disparities without NaN",
                      "NaN at pixel " + std::to_string(start));
    buffer<std::int32_t> order;
    order.reserve(g.size());
    for (std::size_t y = 0; y + 1 < first_run.size(); ++y) {
        const auto first = starts.begin() + first_run[y], last = starts.begin() + first_run[y + 1];
        std::sort(first, last, before);
        for (auto start = first; start != last; ++start)
            for (std::int32_t i = *start; i != no_pixel; i = g.right()[i]) order.push_back(i);
    }
    return order;
}

}  // namespace detail

/// Returns the canonical order of a graph's pixels: `order[new index] = old index`.
///
/// disparity  K values without NaN, larger is nearer; breaks ties between runs that start at the same position. If empty, the
///            old order breaks ties. Raises mismatch for any other number of values, invalid_data for NaN at the first pixel of a
///            run
///
/// While it runs, allocates 16 bytes per row of the lattice and 4 bytes per run.
inline buffer<std::int32_t> canonical_order(const graph& g, std::span<const float> disparity = {}) {
    return detail::order_of_sound(g, disparity);
}
/// Same, for a view of a graph. Raises mismatch if the view violates an invariant of `graph`, even in release builds.
inline buffer<std::int32_t> canonical_order(const graph_view& g, std::span<const float> disparity = {}) {
    check_topology(g, "canonical_order");
    return detail::order_of_sound(g, disparity);
}

/// Returns the column in a new order: pixel i gets the `channels` scalars of pixel `order[i]`. Raises mismatch if an
/// index is outside the column.
template <class Scalar>
buffer<Scalar> reordered(const buffer<Scalar>& column, std::span<const std::int32_t> order, std::size_t channels = 1) {
    LDI_ASSERT(channels > 0 && column.size() % channels == 0);
    buffer<Scalar> result(order.size() * channels);
    for (const std::int32_t old : order)
        if (old < 0 || static_cast<std::size_t>(old) >= column.size() / channels)
            raise(error_code::mismatch, "reorder", "indices below " + std::to_string(column.size() / channels),
                  "index " + std::to_string(old));
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t c = 0; c < channels; ++c)
            result[i * channels + c] = column[static_cast<std::size_t>(order[i]) * channels + c];
    return result;
}

/// Returns the graph with pixel `order[i]` moved to index i. Raises mismatch unless `order` is a permutation of all pixels.
inline graph reordered(const graph& g, std::span<const std::int32_t> order) {
    buffer<std::int32_t> new_index(g.size(), no_pixel);
    std::size_t wrong = 0;  // position in `order` of the first index that is out of range or repeated
    if (order.size() == g.size())
        for (; wrong < order.size(); ++wrong) {
            if (static_cast<std::size_t>(order[wrong]) >= g.size() || new_index[order[wrong]] != no_pixel) break;
            new_index[order[wrong]] = static_cast<std::int32_t>(wrong);
        }
    if (order.size() != g.size() || wrong < order.size())
        raise(error_code::mismatch, "reorder", "a permutation of " + std::to_string(g.size()) + " pixels",
              order.size() != g.size()
                  ? std::to_string(order.size()) + " indices"
                  : "a repeated or invalid index " + std::to_string(order[wrong]) + " at position " + std::to_string(wrong));
    graph_builder result(g.width(), g.height(), g.size(), unset);
    for (std::int32_t i = 0; i < g.count(); ++i) {
        const std::int32_t old = order[static_cast<std::size_t>(i)];
        result.set_position(i, g.x()[old], g.y()[old]);
        for (const side s : all_sides) {
            const std::int32_t neighbor = g.neighbor(old, s);
            result.set_neighbor(i, s, neighbor == no_pixel ? no_pixel : new_index[neighbor]);
        }
    }
    return std::move(result).build(detail::unchecked);
}

/// Checks the invariants of validate() and the canonical order. `disparity` breaks ties, with the same errors as in
/// canonical_order().
inline std::optional<violation> validate_canonical(const graph_view& g, std::span<const float> disparity = {}) {
    if (const std::optional<violation> broken = validate(g)) return broken;
    const buffer<std::int32_t> order = detail::order_of_sound(g, disparity);
    for (std::int32_t i = 0; i < order.count(); ++i)
        if (order[i] != i) return violation{invariant::canonical_order, i};
    return std::nullopt;
}

}}  // namespace ldi
