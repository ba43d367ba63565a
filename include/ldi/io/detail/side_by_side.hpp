// Recognizes PNG files with a color photo in the left half and its depth map in the right half. The depth map is gray, and white
// is near. Programs for 3D displays write such files.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/io/detail/correlation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Whether the left half is a color photo and the right half its depth map. The left half must have more than 1 % colored
/// pixels. The right half must have no colored pixel and at least 16 shades of gray, and must not be a gray copy of the left
/// half. At least 85 % of its pixels must differ by at most two shades from their left neighbors: this holds for most depth
/// maps, and for few gray photos. No shade may cover more than 75 % of the half, as white does on a page of text. Among 607
/// depth maps, only two from a laser scanner exceed this share: four fifths of their pixels are unknown.
inline bool is_side_by_side(const image<std::uint8_t>& color) {
    constexpr double min_share_of_colored = 0.01, max_correlation = 0.95, min_share_of_smooth = 0.85, max_share_of_shade = 0.75;
    const std::size_t half = color.width() / 2;
    if (color.width() % 2 != 0 || half == 0) return false;
    std::array<double, 256> shades{};
    double colored = 0, smooth = 0;
    correlation halves;
    for (std::size_t y = 0; y < color.height(); ++y)
        for (std::size_t x = 0; x < half; ++x) {
            const std::uint8_t *const left = color.row(y) + 3 * x, *const right = left + 3 * half;
            if (right[0] != right[1] || right[0] != right[2]) return false;
            ++shades[right[0]];
            if (x == 0 || std::abs(right[0] - right[-3]) <= 2) ++smooth;
            const auto [low, high] = std::minmax({left[0], left[1], left[2]});
            if (high - low > 8) ++colored;
            halves.add(left[0] + left[1] + left[2], right[0]);
        }
    return colored > min_share_of_colored * halves.count() && smooth >= min_share_of_smooth * halves.count() &&
           std::count(shades.begin(), shades.end(), 0.0) <= 240 &&
           *std::max_element(shades.begin(), shades.end()) <= max_share_of_shade * halves.count() &&
           std::abs(halves.value()) < max_correlation;
}

/// Copies the first `channels` channels of `width` columns, starting at column `begin`.
template <class Scalar>
image<Scalar> take_columns(const image<std::uint8_t>& color, std::size_t begin, std::size_t width, std::size_t channels) {
    image<Scalar> part(color.height(), width, channels, unset);
    for (std::size_t y = 0; y < color.height(); ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < channels; ++c) part(y, x, c) = color(y, begin + x, c);
    return part;
}

}}}  // namespace ldi::detail
