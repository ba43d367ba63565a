// Pixels of a lifted photo within a few steps of its silhouettes. Each pixel refers to its nearest silhouette side, which has
// unmixed color samples of both surfaces.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

using float_color = std::array<float, 3>;

inline float squared_distance(const float_color& a, const float_color& b) {
    const float red = a[0] - b[0], green = a[1] - b[1], blue = a[2] - b[2];
    return red * red + green * green + blue * blue;
}

/// Maximum reach of a silhouette_band: distances fit in 16 bits.
inline constexpr int max_band_width = 32767;

/// A pixel side that lies on a silhouette, and unmixed colors of the surfaces in front and behind.
struct silhouette_side {
    std::int32_t front, back;  ///< pixels on the near and on the far side
    side toward_front;         ///< direction from `back` to `front`
    float_color foreground{}, background{};
    bool can_tell = false;  ///< whether both colors are known and differ by at least the contrast of sample()
};

class silhouette_band {
public:
    struct place {
        std::int32_t pixel;
        std::int32_t side;      ///< index of the nearest silhouette side in sides()
        std::int16_t distance;  ///< steps along links to that side: 0 for pixels that touch it
        bool in_front;          ///< whether the pixel belongs to the nearer of the two surfaces
    };

    /// g      in the order of a photo; every missing link inside the photo is a silhouette
    /// reach  exclusive upper limit of place::distance; at most max_band_width
    silhouette_band(const graph_view& g, array_view<const float> disparity, int reach) : graph_(g), reach_(reach) {
        const auto add = [&](std::int32_t a, std::int32_t b, side from_a) {
            const bool a_is_nearer = disparity[a] > disparity[b];
            sides_.push_back({a_is_nearer ? a : b, a_is_nearer ? b : a, a_is_nearer ? opposite(from_a) : from_a});
        };
        for (std::int32_t i = 0; i < g.count(); ++i) {
            if (g.right()[i] == no_pixel && g.x()[i] + 1 < g.width()) add(i, i + 1, side::right);
            if (g.down()[i] == no_pixel && g.y()[i] + 1 < g.height()) add(i, i + g.width(), side::down);
        }
        if (!sides_.empty()) grow();
    }

    const buffer<silhouette_side>& sides() const { return sides_; }
    /// All pixels of the band; the pixels that touch a silhouette come first.
    const buffer<place>& places() const { return places_; }
    /// Returns the index of a pixel in places(), or -1 outside the band.
    std::int32_t find(std::int32_t pixel) const { return place_of_.empty() ? -1 : place_of_[pixel]; }

    /// Samples the colors of both surfaces at every side.
    ///
    /// colors    K x 3, the column of a photo with this graph
    /// contrast  minimum Euclidean distance between distinguishable colors, in gray levels
    void sample(array_view<const std::uint8_t> colors, float contrast) {
        for (silhouette_side& s : sides_) {
            const bool has_both = sample(colors, s.front, s.toward_front, s.foreground) &&
                                  sample(colors, s.back, opposite(s.toward_front), s.background);
            s.can_tell = has_both && squared_distance(s.foreground, s.background) >= contrast * contrast;
        }
    }

private:
    void grow() {
        place_of_.assign(graph_.size(), -1);
        const auto visit = [&](const place& p) {
            if (place_of_[p.pixel] >= 0) return;
            place_of_[p.pixel] = places_.count();
            places_.push_back(p);
        };
        for (std::int32_t s = 0; s < sides_.count(); ++s)
            visit({sides_[s].front, s, 0, true}), visit({sides_[s].back, s, 0, false});
        for (std::int32_t i = 0; i < places_.count() && places_[i].distance + 1 < reach_; ++i) {
            place p = places_[i];
            ++p.distance;
            for (const side s : all_sides) {
                const std::int32_t neighbor = graph_.neighbor(places_[i].pixel, s);
                if (neighbor != no_pixel) p.pixel = neighbor, visit(p);
            }
        }
    }

    /// Samples the color of one surface: walks away from the silhouette to the first pixel beyond the band. On a surface narrower
    /// than the band, walks to the pixel farthest from all silhouettes. Returns false if that pixel is less than two steps from a
    /// silhouette, where colors are mixed.
    bool sample(array_view<const std::uint8_t> colors, std::int32_t from, side away, float_color& color) const {
        place best = places_[find(from)];
        bool is_behind = false;
        // At a corner of the silhouette, a pixel may have no neighbor that is farther away. The walk then continues straight.
        for (int steps = 0; steps < 2 * reach_ + 2 && !is_behind; ++steps) {
            const place here = best;
            const auto step = [&](side s) {
                const std::int32_t pixel = graph_.neighbor(here.pixel, s);
                if (pixel == no_pixel || is_behind) return;
                const std::int32_t there = find(pixel);
                is_behind = there < 0;
                if (is_behind)
                    best.pixel = pixel;
                else if (places_[there].in_front == here.in_front && places_[there].distance > best.distance)
                    best = places_[there];
            };
            step(away);
            for (const side s : all_sides) step(s);
            if (best.pixel != here.pixel) continue;
            const std::int32_t next = graph_.neighbor(here.pixel, away);
            if (next == no_pixel || places_[find(next)].in_front != here.in_front || places_[find(next)].distance < here.distance)
                break;
            best = places_[find(next)];
        }
        for (std::size_t c = 0; c < 3; ++c) color[c] = static_cast<float>(colors[3 * static_cast<std::size_t>(best.pixel) + c]);
        return is_behind || best.distance >= 2;
    }

    graph_view graph_;
    int reach_;
    buffer<silhouette_side> sides_;
    buffer<place> places_;
    buffer<std::int32_t> place_of_;  // per pixel: its index in places(), or -1
};

}}}  // namespace ldi::detail
