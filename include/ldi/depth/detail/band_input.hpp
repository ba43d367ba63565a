// Computes the 8-bit input of the silhouette network (examples/training/silhouettes/README.md, "The band").
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/step_band.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The two samples beside a pixel's center along one axis, and the interpolation weight.
struct bilinear_place {
    std::int32_t first, second;
    float share;  ///< weight of `second`
};

/// For each photo pixel along one axis, returns the two map samples to interpolate between. `samples` and `pixels` are the sizes
/// of map and photo along this axis. The centers of samples and pixels are at 0.5, 1.5, ...
inline buffer<bilinear_place> bilinear_places(std::size_t samples, std::size_t pixels) {
    buffer<bilinear_place> places(pixels, unset);
    const float scale = nearest_float(samples) / nearest_float(pixels), last = nearest_float(samples - 1);
    for (std::size_t i = 0; i < pixels; ++i) {
        const float at = std::clamp((nearest_float(i) + 0.5F) * scale - 0.5F, 0.0F, last), whole = std::floor(at);
        const std::int32_t first = static_cast<std::int32_t>(whole);
        places[i] = {first, (std::min)(first + 1, static_cast<std::int32_t>(samples) - 1), at - whole};
    }
    return places;
}

/// Maps v from [-1, 1] to a byte.
inline std::uint8_t unit_to_byte(float v) { return static_cast<std::uint8_t>(std::clamp(127.0F * v + 128.5F, 0.0F, 255.0F)); }

/// Returns the network's input: K x 8 bytes, for the K pixels of the band's region.
inline buffer<std::uint8_t> band_input(const step_band& band, const undecided_depth& depth) {
    constexpr std::size_t channels = 8;
    const image_view<const float> map = depth.estimated;
    const buffer<bilinear_place> columns = bilinear_places(map.width(), depth.disparity.width()),
                                 rows = bilinear_places(map.height(), depth.disparity.height());
    std::array<std::uint8_t, 256> of_color;
    for (std::int32_t c = 0; c < 256; ++c) of_color[static_cast<std::size_t>(c)] = unit_to_byte(nearest_float(c) / 127.5F - 1.0F);
    std::array<std::uint8_t, step_region_radius * step_region_radius + 1> of_distance;
    for (std::size_t d = 0; d < of_distance.size(); ++d)
        of_distance[d] = unit_to_byte(std::sqrt(nearest_float(d)) / nearest_float(step_region_radius));
    const float ratio = nearest_float(depth.disparity.width()) / nearest_float(map.width());
    const std::uint8_t of_ratio = unit_to_byte((std::min)(ratio, 8.0F) / 4.0F - 1.0F);
    const auto of_share = [](float share) { return unit_to_byte(std::clamp(share, -0.5F, 1.5F) - 0.5F); };

    buffer<std::uint8_t> result(channels * band.region.size(), unset);
    std::uint8_t* to = result.data();
    std::int32_t i = 0;
    for (std::int32_t y = 0; y < band.region.height(); ++y) {
        const float *const above = map.row(rows[y].first), *const below = map.row(rows[y].second);
        for (const pixel_region::run& run : band.region.row(y))
            for (std::int32_t x = run.first; x < run.last; ++x, ++i, to += channels) {
                const std::uint8_t* const color = depth.photo.row(y) + 3 * static_cast<std::size_t>(x);
                const bilinear_place& at = columns[x];
                const float upper = above[at.first] + at.share * (above[at.second] - above[at.first]),
                            lower = below[at.first] + at.share * (below[at.second] - below[at.first]);
                const step_band::sides& sides = band.sides_of(i);
                const float prepared = band.share(i, depth.disparity(y, x));
                const std::uint8_t distance = of_distance[band.squared_distances[i]];
                for (std::size_t c = 0; c < 3; ++c) to[c] = of_color[color[c]];
                to[3] = of_share(band.share(i, upper + rows[y].share * (lower - upper)));
                to[4] = of_share(prepared);
                to[5] = unit_to_byte(4.0F * (std::min)(sides.front - sides.back, 0.5F) - 1.0F);
                to[6] = prepared > 0.5F ? distance : static_cast<std::uint8_t>(256 - distance);
                to[7] = of_ratio;
            }
    }
    return result;
}

inline buffer<std::uint8_t> channel_of(const buffer<std::uint8_t>& input, std::size_t channel) {
    constexpr std::size_t channels = 8;
    buffer<std::uint8_t> result(input.size() / channels, unset);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = input[channels * i + channel];
    return result;
}

}}}  // namespace ldi::detail
