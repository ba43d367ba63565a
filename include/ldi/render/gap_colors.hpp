// Fills gaps with color. Gaps occur where a surface does not extend far enough, and beyond the photo's border. In a gap, the
// picture continues the colors of the surfaces beside the gap instead of showing a background color.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/image.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Whether the background is visible anywhere.
inline bool has_gaps(const rendering& seen) {
    return std::any_of(seen.coverage.begin(), seen.coverage.end(), [](std::uint8_t share) { return share < 255; });
}

/// Returns the picture, H x W x 3, with a new color for every incompletely covered pixel. The result can be used as
/// raster_options::backdrop. Diffusion fills each gap from its outline. A gap inside the picture uses the colors of the far
/// outline pixels: those in the lower half of the outline's range of inverse depth. A gap at the picture's edge lies beyond the
/// photo's border, where near surfaces continue as well, and uses its whole outline. A rendering without a covered pixel becomes
/// black. Raises mismatch unless the three images have the shapes that `rendering` documents.
inline image<std::uint8_t> gap_colors(rendering seen);

// ------------------------------------------------------------------------------------------------------------------------

namespace detail {

class gap_filler {
public:
    explicit gap_filler(rendering& seen) : seen_(seen) {}

    void fill() {
        find_gaps();
        find_outlines();
        diffuse();
    }

private:
    struct cell {
        std::size_t place;
        std::int32_t above;  // cell of the pixel above, or no_cell
    };
    struct outline {
        float nearest = 0, farthest = std::numeric_limits<float>::infinity();  // inverse depths
    };
    static constexpr std::int32_t no_cell = -1;

    std::size_t width() const { return seen_.color.width(); }
    bool is_gap(std::size_t place) const { return seen_.coverage.data()[place] < 255; }
    bool has_left(std::size_t place) const { return place % width() > 0 && is_gap(place - 1); }
    bool is_at_edge(std::size_t place) const {
        const std::size_t x = place % width();
        return x == 0 || x + 1 == width() || place < width() || place + width() >= seen_.coverage.size();
    }
    float inverse_depth(std::size_t place) const { return 1 / seen_.depth.data()[place]; }

    /// Creates a cell for every pixel of a gap, and merges the sets of adjacent cells.
    void find_gaps() {
        buffer<std::int32_t> above(width(), no_cell);
        for (std::size_t place = 0; place < seen_.coverage.size(); ++place) {
            std::int32_t& of_column = above[place % width()];
            const std::int32_t upper = of_column;
            of_column = no_cell;
            if (!is_gap(place)) continue;
            of_column = gaps_.add();
            cells_.push_back({place, upper});
            if (has_left(place)) gaps_.merge(of_column, of_column - 1);
            if (upper != no_cell) gaps_.merge(of_column, upper);
        }
    }

    /// Calls `visit(index)` for each covered pixel next to the pixel with index `place`.
    template <class Visit>
    void for_each_covered(std::size_t place, Visit&& visit) const {
        const auto look = [&](bool is_inside, std::size_t other) {
            if (is_inside && !is_gap(other)) visit(other);
        };
        look(place % width() > 0, place - 1);
        look(place >= width(), place - width());
        look((place + 1) % width() > 0, place + 1);
        look(place + width() < seen_.coverage.size(), place + width());
    }

    void find_outlines() {
        outlines_.resize(cells_.size());
        for (std::int32_t i = 0; i < cells_.count(); ++i) {
            outline& around = outlines_[gaps_.find(i)];
            if (is_at_edge(cells_[i].place)) around.nearest = std::numeric_limits<float>::infinity();
            for_each_covered(cells_[i].place, [&](std::size_t other) {
                around.nearest = (std::max)(around.nearest, inverse_depth(other));
                around.farthest = (std::min)(around.farthest, inverse_depth(other));
            });
        }
    }

    void diffuse() {
        constexpr int rounds = 8;
        diffusion<3> solver;  // numbers its cells from 1
        for (std::int32_t i = 0; i < cells_.count(); ++i) {
            const auto [place, above] = cells_[i];
            const std::int32_t number =
                solver.add_cell(static_cast<std::int32_t>(place % width()), static_cast<std::int32_t>(place / width()));
            if (has_left(place)) solver.link_left(number, number - 1);
            if (above != no_cell) solver.link_up(number, above + 1);
            const outline around = outlines_[gaps_.find(i)];
            const float middle = 0.5F * (around.nearest + around.farthest);
            for_each_covered(place, [&](std::size_t other) {
                if (inverse_depth(other) <= middle) solver.add_known_neighbor(number, seen_.color.data() + 3 * other);
            });
        }
        solver.solve(rounds);
        for (std::int32_t i = 0; i < cells_.count(); ++i)
            for (std::size_t c = 0; c < 3; ++c)
                seen_.color.data()[3 * cells_[i].place + c] = rounded_mean(solver.value(i + 1)[c]);
    }

    rendering& seen_;
    buffer<cell> cells_;
    disjoint_sets gaps_;        // sets of adjacent cells
    buffer<outline> outlines_;  // outline of each gap, at the index of its first cell
};

}  // namespace detail

inline image<std::uint8_t> gap_colors(rendering seen) {
    const auto is_sound = [&](const auto& picture, std::size_t channels) {
        return picture.height() == seen.color.height() && picture.width() == seen.color.width() &&
               (picture.height() == 0 || picture.width() == 0 || picture.channels() == channels);
    };
    if (!is_sound(seen.color, 3) || !is_sound(seen.depth, 1) || !is_sound(seen.coverage, 1))
        raise(
            error_code::mismatch, "gap_colors", "color H x W x 3, depth and coverage H x W x 1",
            detail::shape_text(seen.color) + ", " + detail::shape_text(seen.depth) + " and " + detail::shape_text(seen.coverage));
    detail::gap_filler(seen).fill();
    return std::move(seen.color);
}

}}  // namespace ldi
