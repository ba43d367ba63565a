// Unmixes the colors of two surfaces next to a silhouette, where the lens, resampling, and inaccurate depth edges mix them. The
// paper marks a margin of the foreground for inpainting (Figure "atlas": the light blue pixels). Here, the colors themselves
// determine which pixels are mixed. Mixed foreground pixels get the foreground's own color, and mixed background pixels become
// unknown. A fixed margin of the background also becomes unknown, and so does a fixed margin of the foreground where both
// surfaces look alike.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/inpaint/detail/local_matte.hpp>
#include <ldi/inpaint/detail/silhouette_band.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Unmixing refills a pixel by marking it as unknown, so that inpainting replaces its color. Margins apply to photos with a
/// long side of up to 1536 pixels, the paper's size, and grow in proportion for larger photos.
struct mixed_color_options {
    /// Foreground colors are refilled within this many pixels of the silhouette where both surfaces look alike, at least 0.
    int foreground_margin = 2;
    /// Background colors are always refilled within this many pixels of the silhouette, at least 0. The paper marks only the
    /// foreground. Without this margin, the hidden surface would continue the lens blur on the background, and the foreground
    /// colors that an inaccurate depth edge leaves there. On the views of bench/quality, a margin of one pixel gains 0.08 dB
    /// compared to refilling only where colors look mixed. On six stereo pairs, a margin of two pixels costs 0.23 dB compared
    /// to one.
    int background_margin = 1;
    /// Maximum distance of mixed colors from a silhouette, as a share of the photo's long side, 0 to 1. The distance in pixels
    /// is clamped to [2, 32767]. Applies only where the colors of the two surfaces differ. 0 disables the search.
    float reach = 4.0F / 1536.0F;
    /// Minimum Euclidean RGB distance between colors that count as different, above 0. Each channel is in [0, 255].
    float contrast = 40.0F;
};

namespace detail {

// Marks the pixels that are within `margin` steps of `edge` along links as unknown. Pixels stay known if no known pixel farther
// from the edge could refill them. For example, a thin rod keeps its colors.
template <class Layers>
void mark_margin(Layers& layers, const buffer<std::int32_t>& edge, int margin) {
    const auto known = layers.template column<known_column>();
    const auto& g = layers.topology();
    enum class mark : std::uint8_t { none, visited, refillable };
    buffer<mark> marks(known.size());
    // rings[d]: known pixels at a distance of d steps from the edge
    buffer<buffer<std::int32_t>> rings(1);
    const auto visit = [&](std::int32_t pixel, buffer<std::int32_t>& ring) {
        if (known[pixel] == 0 || marks[pixel] != mark::none) return;
        marks[pixel] = mark::visited;
        ring.push_back(pixel);
    };
    for (std::int32_t pixel : edge) visit(pixel, rings[0]);
    for (int d = 0; d < margin; ++d) {
        if (rings.back().empty()) return;  // no known pixel is farther from the edge
        buffer<std::int32_t> next;
        for (std::int32_t pixel : rings.back())
            for (side s : all_sides)
                if (const std::int32_t neighbor = g.neighbor(pixel, s); neighbor != no_pixel) visit(neighbor, next);
        rings.push_back(std::move(next));
    }
    // The outermost ring stays known. From there toward the edge, a visited pixel is refillable if one of its neighbors in the
    // next outer ring is refillable. Refillable pixels of the inner rings become unknown.
    for (std::int32_t pixel : rings.back()) marks[pixel] = mark::refillable;
    for (std::size_t d = rings.size() - 1; d-- > 0;) {
        buffer<std::int32_t> accepted;
        for (std::int32_t outer : rings[d + 1])
            for (side s : all_sides) {
                const std::int32_t neighbor = g.neighbor(outer, s);
                if (neighbor == no_pixel || marks[neighbor] != mark::visited) continue;
                marks[neighbor] = mark::refillable;
                accepted.push_back(neighbor);
            }
        rings[d].swap(accepted);
    }
    for (std::size_t d = 0; d + 1 < rings.size(); ++d)
        for (std::int32_t pixel : rings[d]) known[pixel] = 0;
}

/// Scales a number of pixels to the size of the photo.
inline int scaled_to_photo(int pixels, const graph_view& g) {
    const float scale = nearest_float((std::max)(g.width(), g.height())) / 1536.0F;
    return scale > 1.0F ? static_cast<int>(std::lround(scale * nearest_float(pixels))) : pixels;
}

/// Width in pixels of the band that is searched for mixed colors, at most max_band_width.
inline int band_width(float reach, const graph_view& g) {
    const float pixels = reach * nearest_float((std::max)(g.width(), g.height()));
    return reach > 0 ? static_cast<int>(std::clamp(std::lround(pixels), 2L, long{max_band_width})) : 0;
}

/// Replaces each mixed color with an estimate of the surface's own color, and marks mixed background pixels as unknown.
template <class Layers>
class color_cleaner {
public:
    color_cleaner(Layers& layers, const silhouette_band& band, const buffer<mixture>& mixtures)
        : layers_(layers), band_(band), mixtures_(mixtures), known_(layers.template column<known_column>()) {}

    /// Cleans the mixed pixels that touch the silhouette, and those that are linked to them through other mixed pixels.
    /// Elsewhere, a color that looks mixed is the surface's own color.
    void clean() {
        const buffer<silhouette_band::place>& places = band_.places();
        buffer<std::uint8_t> reached(places.size(), 0);
        buffer<std::int32_t> lost;
        for (std::int32_t i = 0; i < places.count(); ++i) {
            const silhouette_band::place& p = places[i];
            if ((p.distance > 0 && reached[i] == 0) || !band_.sides()[p.side].can_tell || is_pure(i)) continue;
            clean(i);
            if (!p.in_front && known_[p.pixel] != 0) known_[p.pixel] = 0, lost.push_back(p.pixel);
            for (const side s : all_sides) {
                const std::int32_t neighbor = layers_.topology().neighbor(p.pixel, s);
                if (const std::int32_t other = neighbor == no_pixel ? -1 : band_.find(neighbor); other >= 0) reached[other] = 1;
            }
        }
        keep_without_source(lost);
    }

private:
    /// Foreground pixels are cleaned if the share of their own surface's color is below `pure_foreground`. Background pixels are
    /// refilled if the share of foreground color is above `pure_background`: refilling loses texture, and smaller shares are
    /// invisible. Both thresholds are tuned by experiment.
    static constexpr float pure_foreground = 0.8F, pure_background = 0.4F;

    bool is_pure(std::int32_t place) const {
        const float alpha = mixtures_[place].alpha;
        return band_.places()[place].in_front ? alpha >= pure_foreground : alpha <= pure_background;
    }

    /// Replaces a pixel's color C with an estimate O of its own surface's color. O minimizes
    /// |C - a O - (1 - a) other|^2 + |O - own|^2 / 4, where a is the share of the pixel's own surface, and `own` and `other` are
    /// the color samples of its own and the other surface.
    void clean(std::int32_t place) {
        const mixture& m = mixtures_[place];
        const bool in_front = band_.places()[place].in_front;
        const float_color &own = in_front ? m.foreground : m.background, &other = in_front ? m.background : m.foreground;
        const float share = in_front ? m.alpha : 1.0F - m.alpha, gain = share / (share * share + 0.25F);
        const auto color = layers_.template at<color_column>(band_.places()[place].pixel);
        for (std::size_t c = 0; c < 3; ++c) {
            const float error = static_cast<float>(color[c]) - share * own[c] - (1.0F - share) * other[c];
            color[c] = rounded_to_byte(own[c] + gain * error);
        }
    }

    /// Makes pixels of `lost` known again if no path of links connects them to a known pixel. They cannot be refilled, so they
    /// keep their unmixed color.
    void keep_without_source(buffer<std::int32_t>& lost) {
        buffer<std::uint8_t> refillable(lost.empty() ? 0 : layers_.size(), 0);
        buffer<std::int32_t> queue;
        const auto visit = [&](std::int32_t pixel) {
            if (known_[pixel] == 0 && refillable[pixel] == 0) refillable[pixel] = 1, queue.push_back(pixel);
        };
        for (const std::int32_t pixel : lost)
            for (const side s : all_sides)
                if (const std::int32_t n = layers_.topology().neighbor(pixel, s); n != no_pixel && known_[n] != 0) visit(pixel);
        for (std::size_t i = 0; i < queue.size(); ++i)
            for (const side s : all_sides)
                if (const std::int32_t n = layers_.topology().neighbor(queue[i], s); n != no_pixel) visit(n);
        for (const std::int32_t pixel : lost)
            if (refillable[pixel] == 0) known_[pixel] = 1;
    }

    Layers& layers_;
    const silhouette_band& band_;
    const buffer<mixture>& mixtures_;
    array_view<std::uint8_t> known_;
};

}  // namespace detail

/// Unmixes the colors beside silhouettes, or marks them as unknown. Call it before expand(). Sets matte_column if the layers have
/// it.
///
/// layers  every pixel with a missing link inside the photo lies on a silhouette
/// shares  H x W, known shares of the surface in front, in the units of decided_depth::shares; may be empty
///
/// Raises invalid_option for an option outside its range, and mismatch if `shares` is neither empty nor H x W. Time is linear,
/// except for sorting the pixels beside silhouettes. Memory: up to 150 bytes per pixel, if all pixels lie beside silhouettes.
template <payload_column... Columns, executor Executor = const serial_executor>
void unmix_colors(single_layer<Columns...>& layers, const mixed_color_options& options = {},
                  std::span<const std::uint8_t> shares = {}, Executor&& threads = {}) {
    static_assert(has_columns<single_layer<Columns...>, color_column, disparity_column, known_column>);
    if (options.foreground_margin < 0 || options.background_margin < 0 || !(options.reach >= 0 && options.reach <= 1) ||
        !(options.contrast > 0))
        raise(error_code::invalid_option, "mixed_color_options", "margins of 0 or more, a reach of 0 to 1, a contrast above 0",
              std::to_string(options.foreground_margin) + ", " + std::to_string(options.background_margin) + ", " +
                  detail::to_text(options.reach) + " and " + detail::to_text(options.contrast));
    if (!shares.empty() && shares.size() != layers.size())
        raise(error_code::mismatch, "unmix_colors", "no shares, or " + std::to_string(layers.size()) + " shares",
              std::to_string(shares.size()) + " shares");
    const auto& g = layers.topology();
    detail::silhouette_band band(g, layers.template column<disparity_column>(), detail::band_width(options.reach, g));
    if (options.reach > 0) band.sample(layers.template column<color_column>(), options.contrast);

    buffer<std::int32_t> foreground, background;
    for (const detail::silhouette_side& s : band.sides()) {
        if (!s.can_tell) foreground.push_back(s.front);
        background.push_back(s.back);
    }
    detail::mark_margin(layers, foreground, detail::scaled_to_photo(options.foreground_margin, g));
    detail::mark_margin(layers, background, detail::scaled_to_photo(options.background_margin, g));

    detail::local_matte mixed(g, band, layers.template column<color_column>(), shares, threads);
    mixed.smooth(2);
    detail::color_cleaner(layers, band, mixed.mixtures()).clean();
    if constexpr (has_column<single_layer<Columns...>, matte_column>)
        for (std::int32_t i = 0; i < band.places().count(); ++i)
            layers.template column<matte_column>()[band.places()[i].pixel] =
                detail::rounded_to_byte(255.0F * mixed.mixtures()[i].alpha);
}

}}  // namespace ldi
