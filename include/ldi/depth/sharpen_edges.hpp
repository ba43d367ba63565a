// Sharpens blurred depth edges into steps at the resolution of the depth map. Depth networks and phones spread a step over many
// samples, so that neighbors differ too little to count as a discontinuity.
//
// Uses a shock filter in its morphological form (Kramer and Bruckner, "Iterations of a non-linear transformation for
// enhancement of digital images", 1975; Osher and Rudin, "Feature-oriented image enhancement using shock filters", 1990):
// concave regions get the largest value around them, convex regions the smallest, until both meet where the edge was steepest.
// The filter changes only edges: places where disparity changes a lot within a few samples and little beyond them. Slopes
// remain.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The defaults were tuned on ground-truth depth maps that were blurred to resemble a network's depth maps.
struct sharpen_options {
    /// Maximum blur of an edge, in samples on either side, 0 to 64. 0 disables sharpening.
    int radius = 3;
    /// Minimum change in disparity within the radius, as a multiple of surface_rule::max_step, at least 0.
    float min_change = 3.0F;
    /// Minimum ratio of the change within the radius to the change within twice the radius, at least 0. A uniform slope has a
    /// ratio of one half.
    float min_share = 0.7F;
};

namespace detail::sharpen {

// Minimum and maximum within `radius` rows and columns of every sample.
struct extremes {
    image<float> low, high;
};

template <executor Executor>
extremes extremes_around(const image<float>& map, std::size_t radius, Executor& threads) {
    const std::size_t rows = map.height(), columns = map.width();
    extremes across{image<float>(rows, columns, 1, unset), image<float>(rows, columns, 1, unset)};
    extremes result{image<float>(rows, columns, 1, unset), image<float>(rows, columns, 1, unset)};
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y)
            for (std::size_t x = 0; x < columns; ++x) {
                const float* from = map.row(y);
                const std::size_t begin = x < radius ? 0 : x - radius, end = (std::min)(x + radius + 1, columns);
                across.low(y, x) = *std::min_element(from + begin, from + end);
                across.high(y, x) = *std::max_element(from + begin, from + end);
            }
    });
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y) {
            const std::size_t begin = y < radius ? 0 : y - radius, end = (std::min)(y + radius + 1, rows);
            float *low = result.low.row(y), *high = result.high.row(y);
            std::copy_n(across.low.row(begin), columns, low), std::copy_n(across.high.row(begin), columns, high);
            for (std::size_t v = begin + 1; v < end; ++v)
                for (std::size_t x = 0; x < columns; ++x) {
                    low[x] = (std::min)(low[x], across.low(v, x));
                    high[x] = (std::max)(high[x], across.high(v, x));
                }
        }
    });
    return result;
}

// Marks with 1 the samples within `radius` of edges. Ignores edges within 2 * `radius` samples of the border, because a network's
// depth map is unreliable there. Samples in this margin copy the mark of the nearest sample farther inside.
template <executor Executor>
image<float> edge_zone(const image<float>& map, surface_rule surface, const sharpen_options& options, Executor& threads) {
    const std::size_t radius = static_cast<std::size_t>(options.radius), margin = 2 * radius;
    image<float> zone(map.height(), map.width());
    if (map.height() <= 2 * margin || map.width() <= 2 * margin) return zone;
    const extremes inner = extremes_around(map, radius, threads), outer = extremes_around(map, 2 * radius, threads);
    for (std::size_t y = margin; y + margin < map.height(); ++y)
        for (std::size_t x = margin; x + margin < map.width(); ++x) {
            const float change = inner.high(y, x) - inner.low(y, x), beyond = outer.high(y, x) - outer.low(y, x);
            const bool is_edge = change > options.min_change * surface.max_step && change > options.min_share * beyond;
            zone(y, x) = is_edge ? 1.0F : 0.0F;
        }
    const image<float> wide = extremes_around(zone, radius, threads).high;
    for (std::size_t y = 0; y < map.height(); ++y)
        for (std::size_t x = 0; x < map.width(); ++x)
            zone(y, x) = wide(std::clamp(y, margin, map.height() - 1 - margin), std::clamp(x, margin, map.width() - 1 - margin));
    return zone;
}

// Smooths with a 5 x 5 binomial filter of variance 1, so that noise does not determine the position of an edge.
inline image<float> smoothed(const image<float>& map) {
    const std::size_t rows = map.height(), columns = map.width();
    const auto filter = [](auto&& at, std::size_t i, std::size_t count) {
        const auto clamped = [&](std::size_t k) { return at((std::min)((std::max)(k, std::size_t{2}) - 2, count - 1)); };
        return (clamped(i) + clamped(i + 4) + 4.0F * (clamped(i + 1) + clamped(i + 3)) + 6.0F * clamped(i + 2)) * (1.0F / 16.0F);
    };
    image<float> across(rows, columns, 1, unset), result(rows, columns, 1, unset);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) across(y, x) = filter([&](std::size_t k) { return map(y, k); }, x, columns);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) result(y, x) = filter([&](std::size_t k) { return across(k, x); }, y, rows);
    return result;
}

// One iteration: every sample of the zone becomes the maximum or the minimum of itself and its four neighbors.
template <executor Executor>
image<float> shock(const image<float>& map, const image<float>& zone, Executor& threads) {
    const std::size_t rows = map.height(), columns = map.width();
    const image<float> smooth = smoothed(smoothed(map));
    image<float> result = map;
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y)
            for (std::size_t x = 0; x < columns; ++x) {
                if (zone(y, x) == 0.0F) continue;
                const std::size_t above = y > 0 ? y - 1 : y, below = (std::min)(y + 1, rows - 1);
                const std::size_t left = x > 0 ? x - 1 : x, right = (std::min)(x + 1, columns - 1);
                const float curvature =
                    smooth(above, x) + smooth(below, x) + smooth(y, left) + smooth(y, right) - 4.0F * smooth(y, x);
                const std::array<float, 5> around{map(y, x), map(above, x), map(below, x), map(y, left), map(y, right)};
                result(y, x) = curvature < 0.0F   ? *std::max_element(around.begin(), around.end())
                               : curvature > 0.0F ? *std::min_element(around.begin(), around.end())
                                                  : around[0];
            }
    });
    return result;
}

}  // namespace detail::sharpen

/// Sharpens depth edges. Returns h x w x 1.
///
/// disparity  h x w x 1, finite, for example the output of a network or a phone
/// surface    rule that decides whether neighboring samples belong to one surface
///
/// Raises mismatch for another number of channels, invalid_data for values that are not finite, invalid_option if an option is
/// out of range. Time is proportional to the number of samples times the radius. Memory is 40 bytes per sample.
template <executor Executor = const serial_executor>
image<float> sharpen_edges(image_view<const float> disparity, surface_rule surface = {}, const sharpen_options& options = {},
                           Executor&& threads = {}) {
    detail::check_map(disparity, "sharpen_edges");
    detail::check_finite(disparity, "sharpen_edges");
    if (options.radius < 0 || options.radius > 64)
        raise(error_code::invalid_option, "sharpen_options::radius", "0 to 64", std::to_string(options.radius));
    for (const float limit : {options.min_change, options.min_share})
        if (!(limit >= 0.0F))
            raise(error_code::invalid_option, "sharpen_options", "min_change and min_share of at least 0",
                  detail::to_text(limit));
    image<float> map(disparity);
    if (options.radius == 0 || map.empty()) return map;
    const image<float> zone = detail::sharpen::edge_zone(map, surface, options, threads);
    for (int pass = 0; pass < 2 * options.radius; ++pass) map = detail::sharpen::shock(map, zone, threads);
    return map;
}

}}  // namespace ldi
