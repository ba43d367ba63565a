// Keeps traces of the foreground (fuzz, hair, a rim) off hidden surfaces. Silhouettes of coarse depth maps are inaccurate by up
// to a few samples, so such traces remain on the background beside silhouettes, and inpainting would continue the traces. Most
// pixels beside silhouettes have the background's own color, so refilling all of them would blur the photo. Instead,
// mark_uncertain_rims() marks these pixels as unknown while hidden surfaces are colored. restore_rims() then restores the pixels
// that show no trace of the surface in front.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/inpaint/mixed_colors.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A pixel's data for restore_rims().
struct uncertain_rim {
    std::int32_t position;              ///< index of the pixel on the photo's lattice, row-major
    std::array<std::uint8_t, 3> color;  ///< color of the pixel itself
    std::array<float, 3> foreground;    ///< color of the surface in front of it, 0 to 255
    bool is_distinguishable;            ///< whether `foreground` is reliable, an unmixed sample of a surface in front
};

/// 1 for a pixel that mark_uncertain_rims() marked, otherwise 0.
struct rim_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }
};

namespace detail {

/// Projects `color` onto the line through `from` (0) and `to` (1), and returns the position of the projection on the line,
/// which may be below 0 or above 1. Returns 0 if `from` and `to` differ by less than `min_contrast`.
inline float share_of_way(const std::uint8_t* color, const std::uint8_t* from, const float* to, float min_contrast) {
    float along = 0, squared = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const float start = static_cast<float>(from[c]), way = to[c] - start;
        along += (static_cast<float>(color[c]) - start) * way, squared += way * way;
    }
    return squared < min_contrast * min_contrast ? 0.0F : along / squared;
}

}  // namespace detail

/// Marks the known background pixels within `width` pixels of silhouettes as unknown. Pixels stay known if no pixel farther from
/// the silhouette could refill them. Call it after unmix_colors() and before expand(). Returns the data of the marked pixels in
/// the order of the pixels, and sets rim_column.
///
/// layers  every pixel with a missing link inside the photo lies on a silhouette
/// width   at most 32767, otherwise raises invalid_option; if 0 or less, no pixel is marked
///
/// Linear time for any width. Memory: up to 150 bytes per pixel, if all pixels lie within the width.
template <payload_column... Columns>
buffer<uncertain_rim> mark_uncertain_rims(single_layer<Columns...>& layers, int width) {
    static_assert(has_columns<single_layer<Columns...>, color_column, disparity_column, known_column, rim_column>);
    buffer<uncertain_rim> rims;
    const auto is_rim = layers.template column<rim_column>();
    std::fill(is_rim.begin(), is_rim.end(), std::uint8_t{0});
    if (width <= 0) return rims;
    if (width > detail::max_band_width)
        raise(error_code::invalid_option, "mark_uncertain_rims", "a width of at most " + std::to_string(detail::max_band_width),
              std::to_string(width));
    const graph& g = layers.topology();
    const auto known = layers.template column<known_column>();
    detail::silhouette_band band(g, layers.template column<disparity_column>(), width);
    band.sample(layers.template column<color_column>(), 0.0F);
    buffer<std::int32_t> edge;
    for (const detail::silhouette_side& s : band.sides()) edge.push_back(s.back);
    // unmix_colors() may have marked pixels at the silhouette as unknown. mark_margin() would not walk past them, so all pixels
    // count as known while it runs.
    const buffer<std::uint8_t> before(known.begin(), known.end());
    std::fill(known.begin(), known.end(), std::uint8_t{1});
    detail::mark_margin(layers, edge, width);
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (before[i] != 0 && known[i] == 0) {
            const detail::silhouette_band::place& nearest = band.places()[band.find(i)];
            const detail::silhouette_side& s = band.sides()[nearest.side];
            const auto color = layers.template at<color_column>(i);
            // A pixel of a narrow surface between two others may be in front at its nearest silhouette.
            rims.push_back({i, {color[0], color[1], color[2]}, s.foreground, s.can_tell && !nearest.in_front});
            is_rim[i] = 1;
        }
        known[i] = known[i] != 0 ? before[i] : std::uint8_t{0};
    }
    return rims;
}

/// Restores the colors of the pixels that mark_uncertain_rims() marked, and makes them known again. A pixel stays inpainted if
/// the foreground in front of it is distinguishable and makes up more than an eighth of the pixel's own color. This share is
/// measured on the line from the inpainted color, which continues the background, to the foreground's color. (The eighth was
/// tuned by experiment.)
///
/// layers    on the photo's lattice
/// rims      result of mark_uncertain_rims() for these layers. Raises mismatch, before any pixel changes, if `rims` lacks a pixel
///           that rim_column marks
/// contrast  mixed_color_options::contrast; raises invalid_option unless it is above 0. A pixel is restored if the foreground's
///           color and the inpainted color differ by less than this contrast
template <has_columns<color_column, known_column, rim_column> Layers>
void restore_rims(Layers& layers, std::span<const uncertain_rim> rims, float contrast = mixed_color_options{}.contrast) {
    if (!(contrast > 0)) raise(error_code::invalid_option, "restore_rims", "a contrast above 0", detail::to_text(contrast));
    struct rim_pixel {
        std::int32_t pixel;
        const uncertain_rim* rim;
    };
    buffer<rim_pixel> marked;
    for_each_other_byte(layers.template column<rim_column>(), 0, [&](std::int32_t i) {
        const auto position = static_cast<std::int32_t>(layers.topology().position_of(i));
        const auto rim =
            std::partition_point(rims.begin(), rims.end(), [&](const uncertain_rim& r) { return r.position < position; });
        if (rim == rims.end() || rim->position != position)
            raise(error_code::mismatch, "restore_rims", "a rim for position " + std::to_string(position),
                  std::to_string(rims.size()) + " rims, none at this position");
        marked.push_back({i, &*rim});
    });
    for (const auto& [pixel, rim] : marked) {
        std::uint8_t* const color = layers.template at<color_column>(pixel).data();
        if (rim->is_distinguishable && detail::share_of_way(rim->color.data(), color, rim->foreground.data(), contrast) > 0.125F)
            continue;
        layers.template column<known_column>()[pixel] = 1;
        std::copy_n(rim->color.data(), 3, color);
    }
}

}}  // namespace ldi
