// Next to a silhouette the lens, the resampling and an edge of depth that is a pixel off mix the colours of two surfaces. Those
// colours are marked unknown, so that inpainting refills them (paper, Figure "atlas": the light blue pixels).
#pragma once

#include <ldi/core/layered_image.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ldi {

struct mixed_colour_options {
    /// How far from the silhouette the foreground's colours are refilled, in pixels.
    int foreground_margin = 2;
    /// How far from the silhouette the background's are. The paper marks the foreground only; without a margin here, what the
    /// lens smeared over the background is what the hidden surface is continued with. One pixel costs nothing: seen from the
    /// right camera, six stereo pairs measure 25.85 dB with it and 25.86 dB without; a second pixel costs 0.23 dB.
    int background_margin = 1;
};

namespace detail {

// Marks the pixels within `margin` steps of `edge` over links as unknown, except those that would have no known pixel behind them
// to be refilled from: a thin rod keeps its colours.
template <payload_column... Columns>
void mark_margin(layered_image<Columns...>& layers, const std::vector<std::int32_t>& edge, int margin) {
    std::vector<std::uint8_t>& known = layers.template column<known_column>();
    const graph& g = layers.topology;
    // rings[d]: the known pixels d steps away from the edge
    std::vector<std::vector<std::int32_t>> rings(1);
    constexpr std::uint8_t visited = 2;
    const auto visit = [&](std::int32_t pixel, std::vector<std::int32_t>& ring) {
        std::uint8_t& state = known[static_cast<std::size_t>(pixel)];
        if (state != 1) return;
        state = visited;
        ring.push_back(pixel);
    };
    for (std::int32_t pixel : edge) visit(pixel, rings[0]);
    for (int d = 0; d < margin; ++d) {
        std::vector<std::int32_t> next;
        for (std::int32_t pixel : rings.back())
            for (side s : all_sides)
                if (const std::int32_t neighbour = g.neighbour(pixel, s); neighbour != no_pixel) visit(neighbour, next);
        rings.push_back(std::move(next));
    }
    // The outermost ring is known for certain. Inwards, a pixel becomes unknown if one step outwards there is such a pixel.
    constexpr std::uint8_t refillable = 3;
    for (std::int32_t pixel : rings.back()) known[static_cast<std::size_t>(pixel)] = refillable;
    for (std::size_t d = rings.size() - 1; d-- > 0;) {
        std::vector<std::int32_t> accepted;
        for (std::int32_t outer : rings[d + 1]) {
            if (known[static_cast<std::size_t>(outer)] != refillable) continue;
            for (side s : all_sides) {
                const std::int32_t neighbour = g.neighbour(outer, s);
                if (neighbour != no_pixel && known[static_cast<std::size_t>(neighbour)] == visited) accepted.push_back(neighbour);
            }
        }
        for (std::int32_t pixel : accepted) known[static_cast<std::size_t>(pixel)] = refillable;
        rings[d].swap(accepted);
    }
    for (std::size_t d = 0; d + 1 < rings.size(); ++d)
        for (std::int32_t pixel : rings[d]) known[static_cast<std::size_t>(pixel)] = 0;
    for (std::uint8_t& state : known) state = state != 0 ? 1 : 0;
}

}  // namespace detail

/// layers  one layer, as lift() makes it; every pixel with a missing link inside the photo lies on a silhouette
///
/// Marks the colours within the margins as unknown. Call it before expand().
template <payload_column... Columns>
void mark_mixed_colours(layered_image<Columns...>& layers, const mixed_colour_options& options = {}) {
    const graph& g = layers.topology;
    const std::vector<float>& disparity = layers.template column<disparity_column>();
    std::vector<std::int32_t> foreground, background;
    const auto add = [&](std::int32_t a, std::int32_t b) {
        const bool a_is_nearer = disparity[static_cast<std::size_t>(a)] > disparity[static_cast<std::size_t>(b)];
        foreground.push_back(a_is_nearer ? a : b);
        background.push_back(a_is_nearer ? b : a);
    };
    const std::int32_t count = static_cast<std::int32_t>(g.size());
    for (std::int32_t i = 0; i < count; ++i) {
        if (g.right[static_cast<std::size_t>(i)] == no_pixel && g.x[static_cast<std::size_t>(i)] + 1 < g.width) add(i, i + 1);
        if (g.down[static_cast<std::size_t>(i)] == no_pixel && g.y[static_cast<std::size_t>(i)] + 1 < g.height)
            add(i, i + g.width);
    }
    detail::mark_margin(layers, foreground, options.foreground_margin);
    detail::mark_margin(layers, background, options.background_margin);
}

}  // namespace ldi
