// Checks the invariants of a topology, and returns the first violation and its pixel. graph_builder::build() raises an error if
// there is a violation. Call validate() to check a graph_view of your own memory.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Invariants in the order in which they are checked.
enum class invariant {
    inside_lattice,      ///< 0 <= x < width and 0 <= y < height
    neighbor_in_range,   ///< a neighbor is no_pixel or the index of a pixel
    mutual_links,        ///< the neighbor's neighbor on the opposite side is the pixel itself
    one_step_away,       ///< a neighbor is one step away, toward its side
    canonical_order,     ///< pixels are in canonical order; only validate_canonical() checks this
    disparity_in_range,  ///< disparities lie in [-1, 1]; only validate() of layers checks this
};

constexpr std::string_view to_string(invariant i) {
    switch (i) {
        case invariant::inside_lattice: return "positions inside the lattice";
        case invariant::neighbor_in_range: return "neighbor indices in range";
        case invariant::mutual_links: return "mutual links";
        case invariant::one_step_away: return "neighbors one step away";
        case invariant::canonical_order: return "pixels in canonical order";
        case invariant::disparity_in_range: return "disparities in [-1, 1]";
    }
    return "unknown invariant";
}

/// A violated invariant, and the pixel that violates it.
struct violation {
    invariant broken;
    std::int32_t pixel;

    /// Reports the violation as an error_code::mismatch.
    ///
    /// where  name of the function that requires the invariant
    [[noreturn]] void refuse(std::string_view where) const {
        raise(error_code::mismatch, where, to_string(broken), "a violation at pixel " + std::to_string(pixel));
    }
};

/// Checks all invariants of a topology. Returns the first violation, if any. Linear time.
inline std::optional<violation> validate(const graph_view& g) {
    const std::int32_t count = g.count();
    for (std::int32_t i = 0; i < count; ++i)
        if (g.x()[i] >= g.width() || g.y()[i] >= g.height()) return violation{invariant::inside_lattice, i};
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
            if (g.x()[n] != g.x()[i] + step_x(s) || g.y()[n] != g.y()[i] + step_y(s))
                return violation{invariant::one_step_away, i};
        }
    return std::nullopt;
}

/// Raises mismatch if a view violates an invariant of `graph`, even in release builds. Stages that follow the links of a view
/// call this function, because ldi does not own the view's memory. Functions for single pixels, such as gather_window(), do
/// not. Linear time.
///
/// where  name of the function that requires the invariants
inline void check_topology(const graph_view& g, std::string_view where) {
    if (const std::optional<violation> found = validate(g)) found->refuse(where);
}
/// Checks nothing, because the invariants of a graph always hold.
inline void check_topology(const graph&, std::string_view) {}

/// Raises invalid_data, with the first wrong value, if a disparity is not finite. Linear time.
///
/// where  name of the function that requires finite disparities
inline void check_disparities(array_view<const float> disparity, const char* where) {
    bool are_finite = true;  // vectorized, because several stages check all pixels
    for (const float d : disparity) are_finite &= std::abs(d) <= (std::numeric_limits<float>::max)();
    if (are_finite) return;
    const auto wrong = std::find_if_not(disparity.begin(), disparity.end(), [](float d) { return std::isfinite(d); });
    raise(error_code::invalid_data, where, "finite disparities", detail::to_text(*wrong));
}

}}  // namespace ldi
