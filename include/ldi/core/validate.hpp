// Checks every invariant of a graph or a layered image and says which is broken, and where. Tests call it after every stage; so
// may you.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace ldi::inline LDI_CONFIGURATION {

/// The invariants, in the order in which they are checked.
enum class invariant {
    equal_columns,       ///< all six columns have the same length
    inside_lattice,      ///< 0 <= x < width and 0 <= y < height
    neighbor_in_range,   ///< a neighbor is no_pixel or the index of a pixel
    mutual_links,        ///< the neighbor's neighbor on the opposite side is the pixel itself
    one_step_away,       ///< a neighbor lies one step to its side
    canonical_order,     ///< pixels stand in canonical order; only checked by validate_canonical
    a_row_a_pixel,       ///< every payload column has one row per pixel
    disparity_in_range,  ///< disparities lie in [0, 1]
};

constexpr std::string_view to_string(invariant i) {
    switch (i) {
        case invariant::equal_columns: return "columns of equal length";
        case invariant::inside_lattice: return "position inside the lattice";
        case invariant::neighbor_in_range: return "neighbor index in range";
        case invariant::mutual_links: return "mutual links";
        case invariant::one_step_away: return "neighbor one step away";
        case invariant::canonical_order: return "canonical order";
        case invariant::a_row_a_pixel: return "payload columns as long as the graph";
        case invariant::disparity_in_range: return "disparity in [0, 1]";
    }
    return "unknown invariant";
}

/// The first broken invariant and the pixel it is broken at (no_pixel where it is about the whole graph).
struct violation {
    invariant broken;
    std::int32_t pixel;
};

/// Nothing if the graph is sound.
inline std::optional<violation> validate(const graph& g) {
    for (side s : all_sides)
        if (g.neighbors(s).size() != g.size()) return violation{invariant::equal_columns, no_pixel};
    if (g.y.size() != g.size()) return violation{invariant::equal_columns, no_pixel};
    const std::int32_t count = g.count();
    for (std::int32_t i = 0; i < count; ++i)
        if (g.x[i] < 0 || g.x[i] >= g.width || g.y[i] < 0 || g.y[i] >= g.height) return violation{invariant::inside_lattice, i};
    for (std::int32_t i = 0; i < count; ++i)
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(i, s);
            if (n != no_pixel && (n < 0 || n >= count)) return violation{invariant::neighbor_in_range, i};
        }
    for (std::int32_t i = 0; i < count; ++i)
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(i, s);
            if (n != no_pixel && g.neighbor(n, opposite(s)) != i) return violation{invariant::mutual_links, i};
        }
    for (std::int32_t i = 0; i < count; ++i)
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(i, s);
            if (n == no_pixel) continue;
            if (g.x[n] != g.x[i] + step_x(s) || g.y[n] != g.y[i] + step_y(s)) return violation{invariant::one_step_away, i};
        }
    return std::nullopt;
}

/// The same for a layered image: its graph is sound, each column has one row per pixel, and disparities lie in [0, 1].
template <payload_column... Columns>
std::optional<violation> validate(const layered_image<Columns...>& layers) {
    if (const std::optional<violation> broken = validate(layers.topology)) return broken;
    if (!((layers.template column<Columns>().size() == layers.size() * Columns::channels) && ...))
        return violation{invariant::a_row_a_pixel, no_pixel};
    if constexpr (has_columns<layered_image<Columns...>, disparity_column>)
        for (std::int32_t i = 0; i < layers.topology.count(); ++i) {
            const float disparity = layers.template column<disparity_column>()[i];
            if (!(disparity >= 0.0F && disparity <= 1.0F)) return violation{invariant::disparity_in_range, i};
        }
    return std::nullopt;
}

/// validate(), and that pixels stand in canonical order. `disparity` as in canonical_order().
inline std::optional<violation> validate_canonical(const graph& g, std::span<const float> disparity = {}) {
    if (const std::optional<violation> broken = validate(g)) return broken;
    const buffer<std::int32_t> order = canonical_order(g, disparity);
    for (std::int32_t i = 0; i < order.count(); ++i)
        if (order[i] != i) return violation{invariant::canonical_order, i};
    return std::nullopt;
}

}  // namespace ldi
