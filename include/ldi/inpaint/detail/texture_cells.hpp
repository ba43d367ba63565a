// The part of a layered image that texture transfer processes: the unknown pixels, and a strip of known pixels around them on
// the same surfaces. These pixels are a small part of a photo, so they have their own numbers, as cells.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/other_bytes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Cells are in the order of the pixels, so that a linked run of cells is contiguous.
struct texture_cells {
    enum class kind : std::uint8_t {
        unknown,
        source,  ///< known, and a source of texture
        margin,  ///< known; not a source, but read as the surroundings of sources
    };
    static constexpr int max_steps = 255;  ///< maximum number of steps in walk()
    static constexpr int stride = 4;

    buffer<std::int32_t> pixel;                    ///< per cell: index in the graph
    buffer<kind> kinds;                            ///< per cell
    buffer<std::uint8_t> left_steps, right_steps;  ///< per cell: number of linked cells on that side, at most max_steps
    buffer<std::int32_t> above, below;             ///< per cell: the linked cell above or below; the cell itself if there is none
    buffer<std::int32_t> far_above, far_below;     ///< per cell: the cell `stride` steps away, or the last linked one

    std::int32_t count() const { return pixel.count(); }
    bool is_unknown(std::int32_t cell) const { return kinds[cell] == kind::unknown; }
    bool is_source(std::int32_t cell) const { return kinds[cell] == kind::source; }
    /// Returns the neighboring cell, or no_pixel.
    std::int32_t neighbor(std::int32_t cell, side s) const {
        const std::int32_t n = walk(cell, s, 1);
        return n == cell ? no_pixel : n;
    }

    /// Returns the cell `steps` steps away, or the last linked cell if fewer cells are linked on that side.
    ///
    /// steps  at most max_steps
    std::int32_t walk(std::int32_t cell, side s, int steps) const {
        LDI_ASSERT(steps <= max_steps);
        switch (s) {
            case side::left: return cell - (std::min<int>)(steps, left_steps[cell]);
            case side::right: return cell + (std::min<int>)(steps, right_steps[cell]);
            case side::up: return follow(above, far_above, cell, steps);
            case side::down: break;
        }
        return follow(below, far_below, cell, steps);
    }

    /// Divides the unknown cells into parts that no link connects, ascending in each part. Distributes the connected groups of
    /// unknown cells, the largest first, each to the smallest part so far.
    ///
    /// threads  number of threads that will process the parts; one thread gets a single part
    buffer<buffer<std::int32_t>> independent_parts(std::size_t threads) const {
        constexpr std::size_t parts_per_thread = 4;
        buffer<buffer<std::int32_t>> parts(threads > 1 ? parts_per_thread * threads : 1);
        if (threads <= 1) {
            parts[0].reserve(static_cast<std::size_t>(std::count(kinds.begin(), kinds.end(), kind::unknown)));
            for (std::int32_t cell = 0; cell < count(); ++cell)
                if (is_unknown(cell)) parts[0].push_back(cell);
            return parts;
        }
        const buffer<std::int32_t> groups = linked_groups();
        buffer<std::int32_t> sizes(groups.size()), largest_first;
        for (const std::int32_t group : groups)
            if (group != no_pixel && ++sizes[group] == 1) largest_first.push_back(group);
        std::sort(largest_first.begin(), largest_first.end(),
                  [&](std::int32_t a, std::int32_t b) { return sizes[a] != sizes[b] ? sizes[a] > sizes[b] : a < b; });
        using load = std::pair<std::int32_t, std::int32_t>;  // number of cells in a part, and the part
        buffer<load> loads(parts.size());
        for (std::int32_t part = 0; part < parts.count(); ++part) loads[part] = {0, part};  // a heap, the smallest part first
        buffer<std::int32_t> part_of = sizes;
        for (const std::int32_t group : largest_first) {
            std::pop_heap(loads.begin(), loads.end(), std::greater<load>());
            part_of[group] = loads.back().second;
            loads.back().first += sizes[group];
            std::push_heap(loads.begin(), loads.end(), std::greater<load>());
        }
        for (std::int32_t cell = 0; cell < count(); ++cell)
            if (is_unknown(cell)) parts[part_of[groups[cell]]].push_back(cell);
        return parts;
    }

private:
    /// Returns the first cell of each unknown cell's group, the unknown cells that links connect; no_pixel for other cells.
    buffer<std::int32_t> linked_groups() const {
        buffer<std::int32_t> first(pixel.size(), no_pixel);
        const auto group_of = [&](std::int32_t cell) {
            while (first[cell] != cell) cell = first[cell] = first[first[cell]];
            return cell;
        };
        for (std::int32_t cell = 0; cell < count(); ++cell) {
            if (!is_unknown(cell)) continue;
            first[cell] = cell;
            for (const side s : {side::left, side::up}) {
                const std::int32_t n = neighbor(cell, s);
                if (n == no_pixel || !is_unknown(n)) continue;
                const std::int32_t a = group_of(cell), b = group_of(n);
                first[(std::max)(a, b)] = (std::min)(a, b);
            }
        }
        for (std::int32_t cell = 0; cell < count(); ++cell)
            if (is_unknown(cell)) first[cell] = group_of(cell);
        return first;
    }

    static std::int32_t follow(const buffer<std::int32_t>& one_step, const buffer<std::int32_t>& strides, std::int32_t cell,
                               int steps) {
        for (; steps >= stride; steps -= stride) cell = strides[cell];
        for (; steps > 0; --steps) cell = one_step[cell];
        return cell;
    }
};

/// Counts the steps along links from each pixel to the nearest unknown pixel, up to `max_steps`. Pixels that are farther away
/// get 255.
inline buffer<std::uint8_t> steps_to_unknown(const graph_view& g, array_view<const std::uint8_t> known, int max_steps) {
    buffer<std::uint8_t> steps(g.size(), unset);
    for (std::int32_t i = 0; i < g.count(); ++i) steps[i] = known[i] == 0 ? 0 : 255;
    buffer<std::int32_t> wave, further;
    const auto visit_around = [&](std::int32_t pixel, int distance, buffer<std::int32_t>& reached) {
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(pixel, s);
            if (n == no_pixel || steps[n] != 255) continue;
            steps[n] = static_cast<std::uint8_t>(distance);
            reached.push_back(n);
        }
    };
    for_each_unknown(known, [&](std::int32_t i) { visit_around(i, 1, wave); });
    for (int distance = 2; distance <= max_steps && !wave.empty(); ++distance) {
        further.clear();
        for (std::int32_t pixel : wave) visit_around(pixel, distance, further);
        wave.swap(further);
    }
    return steps;
}

/// Returns for each cell the cell two steps away along `links`.
inline buffer<std::int32_t> doubled(const buffer<std::int32_t>& links) {
    buffer<std::int32_t> result(links.size(), unset);
    for (std::size_t cell = 0; cell < links.size(); ++cell) result[cell] = links[links[cell]];
    return result;
}

/// Sets left_steps and right_steps.
///
/// is_linked  is_linked(cell): whether the previous cell is its left neighbor
template <class IsLinked>
void count_steps(texture_cells& cells, IsLinked&& is_linked) {
    const auto one_more = [](std::uint8_t steps) {
        return static_cast<std::uint8_t>((std::min)(steps + 1, texture_cells::max_steps));
    };
    cells.left_steps = buffer<std::uint8_t>(cells.pixel.size());
    cells.right_steps = buffer<std::uint8_t>(cells.pixel.size());
    for (std::int32_t cell = 1; cell < cells.count(); ++cell)
        if (is_linked(cell)) cells.left_steps[cell] = one_more(cells.left_steps[cell - 1]);
    for (std::int32_t cell = cells.count() - 1; cell > 0; --cell)
        if (cells.left_steps[cell] > 0) cells.right_steps[cell - 1] = one_more(cells.right_steps[cell]);
}

/// Selects and numbers the cells.
///
/// g       in canonical order
/// reach   maximum steps from a source to the nearest unknown pixel
/// margin  width of the margin around sources; reach + margin must be less than 255
inline texture_cells find_texture_cells(const graph_view& g, array_view<const std::uint8_t> known, int reach, int margin) {
    const buffer<std::uint8_t> steps = steps_to_unknown(g, known, reach + margin);
    const std::size_t count = g.size() - static_cast<std::size_t>(std::count(steps.begin(), steps.end(), 255));
    texture_cells cells;
    cells.pixel.resize(count, unset), cells.kinds.resize(count, unset);
    buffer<std::int32_t> cell_of(g.size(), unset);  // set only for pixels with a cell
    std::int32_t next = 0;
    for_each_other_byte(steps, 255, [&](std::int32_t i) {
        cells.pixel[next] = i;
        cells.kinds[next] = steps[i] == 0       ? texture_cells::kind::unknown
                            : steps[i] <= reach ? texture_cells::kind::source
                                                : texture_cells::kind::margin;
        cell_of[i] = next++;
    });
    count_steps(cells, [&](std::int32_t cell) {
        const std::int32_t left = g.left()[cells.pixel[cell]];
        LDI_ASSERT(left == no_pixel || left == cells.pixel[cell] - 1);
        return left != no_pixel && left == cells.pixel[cell - 1];
    });
    const auto links = [&](array_view<const std::int32_t> neighbors) {
        buffer<std::int32_t> result(count, unset);
        for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
            const std::int32_t n = neighbors[cells.pixel[cell]];
            result[cell] = n != no_pixel && steps[n] != 255 ? cell_of[n] : cell;
        }
        return result;
    };
    cells.above = links(g.up()), cells.below = links(g.down());
    cells.far_above = doubled(doubled(cells.above)), cells.far_below = doubled(doubled(cells.below));
    return cells;
}

}}}  // namespace ldi::detail
