// The part of a layered image that texture transfer works on: the pixels that are not known, and a strip of known ones around
// them, on the same surfaces. Few of a photo's pixels, so they are numbered anew.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Three channels of color.
using texture_color = std::array<float, 3>;

/// Cells are in the order of the pixels.
struct texture_cells {
    enum class kind : std::uint8_t {
        unknown,
        source,  ///< known, and texture may come from here
        margin,  ///< known, there only so that a source is seen with its surroundings
    };
    buffer<std::int32_t> pixel;                ///< per cell: its index in the graph
    buffer<kind> kinds;                        ///< per cell
    std::array<buffer<std::int32_t>, 4> next;  ///< per side and cell: the neighboring cell, or no_pixel

    std::int32_t count() const { return pixel.count(); }
    bool is_unknown(std::int32_t cell) const { return kinds[cell] == kind::unknown; }
    bool is_source(std::int32_t cell) const { return kinds[cell] == kind::source; }
    std::int32_t neighbor(std::int32_t cell, side s) const { return next[static_cast<std::size_t>(s)][cell]; }

    /// The cell this many steps away, or the last one on the way there.
    std::int32_t walk(std::int32_t cell, side s, int steps) const {
        const buffer<std::int32_t>& links = next[static_cast<std::size_t>(s)];
        for (; steps > 0 && links[cell] != no_pixel; --steps) cell = links[cell];
        return cell;
    }
};

/// Steps over links from each pixel to the nearest unknown one, where they are `most` at most; otherwise 255.
inline buffer<std::uint8_t> steps_to_unknown(const graph_view& g, array_view<const std::uint8_t> known, int most) {
    buffer<std::uint8_t> steps(g.size(), 255);
    buffer<std::int32_t> wave, further;
    const auto visit_around = [&](std::int32_t pixel, int distance, buffer<std::int32_t>& reached) {
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(pixel, s);
            if (n == no_pixel || known[n] == 0 || steps[n] != 255) continue;
            steps[n] = static_cast<std::uint8_t>(distance);
            reached.push_back(n);
        }
    };
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (known[i] != 0) continue;
        steps[i] = 0;
        visit_around(i, 1, wave);
    }
    for (int distance = 2; distance <= most && !wave.empty(); ++distance) {
        further.clear();
        for (std::int32_t pixel : wave) visit_around(pixel, distance, further);
        wave.swap(further);
    }
    return steps;
}

/// reach, margin  how many steps from an unknown pixel sources lie at most, and how wide the margin around them is; together
///                less than 255
inline texture_cells find_texture_cells(const graph_view& g, array_view<const std::uint8_t> known, int reach, int margin) {
    const buffer<std::uint8_t> steps = steps_to_unknown(g, known, reach + margin);
    texture_cells cells;
    buffer<std::int32_t> cell_of(g.size(), unset);  // where there is a cell
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (steps[i] == 255) continue;
        cell_of[i] = cells.count();
        cells.pixel.push_back(i);
        cells.kinds.push_back(steps[i] == 0       ? texture_cells::kind::unknown
                              : steps[i] <= reach ? texture_cells::kind::source
                                                  : texture_cells::kind::margin);
    }
    for (side s : all_sides) {
        buffer<std::int32_t>& links = cells.next[static_cast<std::size_t>(s)];
        links = buffer<std::int32_t>(cells.pixel.size(), no_pixel);
        for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
            const std::int32_t n = g.neighbor(cells.pixel[cell], s);
            if (n != no_pixel && steps[n] != 255) links[cell] = cell_of[n];
        }
    }
    return cells;
}

/// Blurs with a binomial filter of 3 x 3 over links, `passes` times. A neighbor that is missing counts as the cell itself.
inline void blur_cells(const texture_cells& cells, buffer<texture_color>& values, int passes) {
    buffer<texture_color> blurred(values.size(), unset);
    for (int pass = 0; pass < passes; ++pass)
        for (const auto& [one, other] : {std::array{side::left, side::right}, std::array{side::up, side::down}}) {
            for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
                const std::int32_t before = cells.neighbor(cell, one), after = cells.neighbor(cell, other);
                const texture_color& middle = values[cell];
                const texture_color& a = before == no_pixel ? middle : values[before];
                const texture_color& b = after == no_pixel ? middle : values[after];
                for (std::size_t c = 0; c < 3; ++c) blurred[cell][c] = 0.5F * middle[c] + 0.25F * (a[c] + b[c]);
            }
            values.swap(blurred);
        }
}

}}}  // namespace ldi::detail
