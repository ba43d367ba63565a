// Levels the dips beside the steps of a depth map. Depth networks often place the background too far away in a narrow ring
// around an object. The outer edge of this ring is a second step. No object ends at this step, but it tears the background
// apart.
//
// Uses a morphological closing, which raises every valley that is narrower than the filter window to the lower of the valley's
// sides (Serra, "Image Analysis and Mathematical Morphology", 1982). Only shallow valleys are raised: a gap between two parts
// of an object is much deeper, and remains.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <cstddef>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The defaults were chosen on a few photographs with depth estimated by a network.
struct level_options {
    /// Maximum distance of a raised sample from the step, in samples, 0 to 64. Also half the width of the widest dip that is
    /// leveled. 0 disables leveling.
    int radius = 4;
    /// Maximum depth of a dip, relative to the step beside it, from 0 to 1.
    float max_depth = 0.35F;
};

namespace detail::leveling {

/// Computes the maximum or the minimum over the samples within `radius` rows and columns of every sample. `pick` returns the
/// larger or the smaller of two values.
template <class Pick>
image<float> combined(image_view<const float> map, std::size_t radius, Pick pick) {
    const std::size_t rows = map.height(), columns = map.width();
    image<float> across(rows, columns, 1, unset), result(rows, columns, 1, unset);
    for (std::size_t y = 0; y < rows; ++y) {
        const float* const from = map.row(y);
        float* const to = across.row(y);
        std::copy_n(from, columns, to);
        for (std::size_t d = 1; d <= (std::min)(radius, columns - 1); ++d) {
            for (std::size_t x = 0; x + d < columns; ++x) to[x] = pick(to[x], from[x + d]);
            for (std::size_t x = d; x < columns; ++x) to[x] = pick(to[x], from[x - d]);
        }
    }
    for (std::size_t y = 0; y < rows; ++y) {
        float* const to = result.row(y);
        const std::size_t first = y - (std::min)(radius, y), last = (std::min)(y + radius + 1, rows);
        std::copy_n(across.row(first), columns, to);
        for (std::size_t v = first + 1; v < last; ++v) {
            const float* const from = across.row(v);
            for (std::size_t x = 0; x < columns; ++x) to[x] = pick(to[x], from[x]);
        }
    }
    return result;
}

/// Repeats the samples at the border `margin` times, so that a slope toward the border is not mistaken for a dip.
inline image<float> padded(image_view<const float> map, std::size_t margin) {
    const std::size_t rows = map.height(), columns = map.width();
    image<float> result(rows + 2 * margin, columns + 2 * margin, 1, unset);
    for (std::size_t y = 0; y < result.height(); ++y) {
        const float* const from = map.row((std::min)((std::max)(y, margin) - margin, rows - 1));
        float* const to = result.row(y);
        std::fill_n(to, margin, from[0]);
        std::copy_n(from, columns, to + margin);
        std::fill_n(to + margin + columns, margin, from[columns - 1]);
    }
    return result;
}

}  // namespace detail::leveling

/// Levels dips. Returns h x w x 1; no value is lower than before.
///
/// disparity  h x w x 1, finite, larger is nearer
///
/// Raises mismatch for another number of channels, invalid_data for values that are not finite, and invalid_option if the radius
/// is not in [0, 64], or max_depth not in [0, 1]. Time is proportional to the number of samples times the radius. Memory is 16
/// bytes per sample.
inline image<float> level_dips(image_view<const float> disparity, const level_options& options = {}) {
    detail::check_map(disparity, "level_dips");
    detail::check_finite(disparity, "level_dips");
    if (options.radius < 0 || options.radius > 64)
        raise(error_code::invalid_option, "level_options::radius", "0 to 64", std::to_string(options.radius));
    if (!(options.max_depth >= 0.0F && options.max_depth <= 1.0F))
        raise(error_code::invalid_option, "level_options::max_depth", "0 to 1", detail::to_text(options.max_depth));
    image<float> result(disparity);
    if (options.radius == 0 || disparity.empty()) return result;
    const std::size_t radius = static_cast<std::size_t>(options.radius);
    const auto larger = [](float a, float b) { return a < b ? b : a; };
    const auto smaller = [](float a, float b) { return b < a ? b : a; };
    const image<float> high = detail::leveling::combined(detail::leveling::padded(disparity, radius), radius, larger);
    const image<float> closed = detail::leveling::combined(high, radius, smaller);
    for (std::size_t y = 0; y < result.height(); ++y) {
        const float *const closed_row = closed.row(y + radius) + radius, *const high_row = high.row(y + radius) + radius;
        float* const to = result.row(y);
        for (std::size_t x = 0; x < result.width(); ++x)
            if (closed_row[x] - to[x] <= options.max_depth * (high_row[x] - to[x])) to[x] = closed_row[x];
    }
    return result;
}

}}  // namespace ldi
