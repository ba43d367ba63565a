// Where depth is coarser than the photo, silhouettes are up to a few samples off, and something of the foreground stays on the
// background beside them: fuzz, hair, a rim. Inpainting would continue it over all of the hidden surface. But most of these
// pixels are the background's own, and in sight: refilled, they would blur what everybody sees. So they are set aside, unknown
// while hidden surfaces get their colors, and put back afterwards, if they don't look like what is in front of them.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/occlusion/mixed_colors.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION {

/// Pixels of a photo that are set aside, by their positions in it, ascending.
struct uncertain_rims {
    buffer<std::size_t> positions;
    buffer<float> disparity;      ///< which of the pixels at a position it is
    buffer<std::uint8_t> colors;  ///< 3 each
    buffer<float> foreground;     ///< 3 each: the color of what is in front of it, 0 to 255, where one can tell
    buffer<std::uint8_t> can_tell;
};

namespace detail {

/// How far a color lies on the way from one to another, 0 to 1 and beyond; 0 where those look alike.
inline float share_of_way(const std::uint8_t* color, const std::uint8_t* from, const float* to) {
    constexpr float least_contrast = 40.0F;  // as in mixed_color_options
    float along = 0, squared = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const float start = static_cast<float>(from[c]), way = to[c] - start;
        along += (static_cast<float>(color[c]) - start) * way, squared += way * way;
    }
    return squared < least_contrast * least_contrast ? 0.0F : along / squared;
}

}  // namespace detail

/// Marks the known pixels of the background within `width` pixels of silhouettes as unknown, but for those that would have no
/// known pixel behind them. Call it after unmix_colors() and before expand().
///
/// layers  every pixel with a missing link inside the photo lies on a silhouette
///
/// Linear time, whatever the width; up to 150 bytes per pixel, where all lie within it.
template <payload_column... Columns>
uncertain_rims set_aside_rims(single_layer<Columns...>& layers, int width) {
    static_assert(has_columns<single_layer<Columns...>, color_column, disparity_column, known_column>);
    uncertain_rims rims;
    if (width <= 0) return rims;
    const graph& g = layers.topology;
    const buffer<float>& disparity = layers.template column<disparity_column>();
    buffer<std::uint8_t>& known = layers.template column<known_column>();
    detail::silhouette_band band(g, disparity, width);
    band.sample(layers.template column<color_column>(), 0.0F);
    buffer<std::int32_t> edge;
    for (const detail::silhouette_side& s : band.sides()) edge.push_back(s.back);
    // What was unmixed or refilled at the silhouette itself is unknown already: the margin begins behind it.
    const buffer<std::uint8_t> before = known;
    std::fill(known.begin(), known.end(), std::uint8_t{1});
    detail::mark_margin(layers, edge, width);
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (before[i] != 0 && known[i] == 0) {
            rims.positions.push_back(g.position_of(i));
            rims.disparity.push_back(disparity[i]);
            const auto color = layers.template at<color_column>(i);
            rims.colors.append(color.begin(), color.end());
            const detail::silhouette_band::place& nearest = band.places()[band.find(i)];
            const detail::silhouette_side& s = band.sides()[nearest.side];
            rims.foreground.append(s.foreground.begin(), s.foreground.end());
            // A narrow surface between two others may be the near one at the nearest silhouette.
            rims.can_tell.push_back(s.can_tell && !nearest.in_front ? 1 : 0);
        }
        known[i] = known[i] != 0 ? before[i] : std::uint8_t{0};
    }
    return rims;
}

/// Gives the pixels their colors back, which are known again, unless those have an eighth of what is in front, by trial: on the
/// way from the colors that they got meanwhile, which continue the background, to the foreground's.
template <payload_column... Columns>
void put_back(layered_image<Columns...>& layers, const uncertain_rims& rims) {
    const graph& g = layers.topology;
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (layers.template column<known_column>()[i] != 0) continue;
        const std::size_t* const at = std::lower_bound(rims.positions.begin(), rims.positions.end(), g.position_of(i));
        const std::size_t n = static_cast<std::size_t>(at - rims.positions.begin());
        if (at == rims.positions.end() || *at != g.position_of(i) ||
            rims.disparity[n] != layers.template column<disparity_column>()[i])
            continue;
        std::uint8_t* const color = layers.template at<color_column>(i).data();
        if (rims.can_tell[n] != 0 &&
            detail::share_of_way(rims.colors.data() + 3 * n, color, rims.foreground.data() + 3 * n) > 0.125F)
            continue;
        layers.template column<known_column>()[i] = 1;
        std::copy_n(rims.colors.begin() + 3 * n, 3, color);
    }
}

}  // namespace ldi
