// Halves the resolution of a graph, as a convolution of stride 2 halves an image, and returns the map from fine to coarse pixels
// that nearest-neighbor upsampling uses (paper, section "Mapping the PConv Network to LDI", Downscaling and Upscaling).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Result of coarsen() for a graph.
struct coarsened {
    graph topology;  ///< the coarse graph, on a lattice of half the size, rounded up
    level_map map;   ///< relates the pixels of both graphs
};

/// Treatment of orphans. The coarse graph keeps the pixels at even x and even y. An orphan is a pixel that cannot reach a kept
/// pixel along links inside its 2 x 2 group, because it lies on a thin strip or behind a silhouette.
enum class orphan_rule : std::uint8_t {
    /// an orphan adopts the parent of the nearest pixel with a parent. Distance is counted in links; breadth-first exploration in
    /// the order up, down, left, right breaks ties
    adopt_nearest,
    stay,  ///< an orphan has no parent
};

namespace detail {
/// Explores a pixel's 2 x 2 group breadth-first, in the order up, down, left, right. Returns the first pixel that it finds at
/// even x and even y, or no_pixel.
inline std::int32_t corner_of_group(const graph_view& g, std::int32_t pixel) {
    const auto follow = [&](std::initializer_list<side> path) {
        std::int32_t at = pixel;
        for (side s : path)
            if ((at = g.neighbor(at, s)) == no_pixel) break;
        return at;
    };
    const auto first = [](std::int32_t a, std::int32_t b) { return a != no_pixel ? a : b; };
    const bool odd_x = g.x()[pixel] % 2 == 1, odd_y = g.y()[pixel] % 2 == 1;
    if (odd_x && odd_y) return first(follow({side::up, side::left}), follow({side::left, side::up}));
    if (odd_x) return first(follow({side::left}), follow({side::down, side::left, side::up}));
    if (odd_y) return first(follow({side::up}), follow({side::right, side::up, side::left}));
    return pixel;
}

/// Returns the first kept pixel of a run in an even row; `last` if there is none.
inline std::int32_t first_kept(const graph_view& g, const pixel_run& run) { return run.first + (g.x()[run.first] & 1); }

/// Both columns of a level_map under construction.
struct level_columns {
    buffer<std::int32_t> kept, parent;
};

/// Sets `kept`, and the parents of kept pixels. Returns the coarse graph with positions, but uninitialized links.
inline graph_builder keep_even_pixels(const graph_view& g, std::span<const pixel_run> runs, level_columns& result) {
    const auto is_even_row = [&](const pixel_run& run) { return (g.y()[run.first] & 1) == 0; };
    std::size_t count = 0;
    for (const pixel_run& run : runs)
        if (is_even_row(run)) count += static_cast<std::size_t>(run.last - first_kept(g, run) + 1) / 2;
    result.kept.resize(count);
    graph_builder coarse(half_rounded_up(g.width()), half_rounded_up(g.height()), count, unset);
    result.parent.assign(g.size(), no_pixel);
    std::int32_t n = 0;
    for (const pixel_run& run : runs) {
        if (!is_even_row(run)) continue;
        const std::int32_t y = g.y()[run.first] / 2;
        std::int32_t x = (g.x()[run.first] + 1) / 2;
        for (std::int32_t i = first_kept(g, run); i < run.last; i += 2, ++n, ++x) {
            result.kept[n] = i;
            coarse.set_position(n, x, y);
            result.parent[i] = n;
        }
    }
    return coarse;
}

/// Links kept pixels that are connected by a straight path of two links.
inline void link_kept_pixels(const graph_view& g, const level_columns& result, graph_builder& made) {
    for (const side s : {side::down, side::right}) {
        const array_view<const std::int32_t> fine = g.neighbors(s);
        for (std::int32_t i = 0; i < made.count(); ++i) made.set_neighbor(i, opposite(s), no_pixel);
        for (std::int32_t i = 0; i < result.kept.count(); ++i) {
            const std::int32_t between = fine[result.kept[i]];
            const std::int32_t other = between == no_pixel ? no_pixel : fine[between];
            const std::int32_t there = other == no_pixel ? no_pixel : result.parent[other];
            made.set_neighbor(i, s, there);
            if (there != no_pixel) made.set_neighbor(there, opposite(s), i);
        }
    }
}

/// Finds parents for the pixels of a run that are not kept. Tries the first path of corner_of_group() itself before it calls
/// that function, because the links on this path almost always exist.
inline void find_parents(const graph_view& g, const pixel_run& run, buffer<std::int32_t>& parent) {
    const auto by_corner = [&](std::int32_t pixel) {
        const std::int32_t corner = corner_of_group(g, pixel);
        return corner == no_pixel ? no_pixel : parent[corner];
    };
    const std::int32_t odd = first_kept(g, run) ^ 1;  // parity of the indices of pixels at odd x
    if ((g.y()[run.first] & 1) == 0) {
        if ((run.first ^ odd) % 2 == 0) parent[run.first] = by_corner(run.first);
        for (std::int32_t i = first_kept(g, run) + 1; i < run.last; i += 2) parent[i] = parent[i - 1];
        return;
    }
    for (std::int32_t i = run.first; i < run.last; ++i) {
        std::int32_t corner = g.up()[i];
        if (corner != no_pixel && (i ^ odd) % 2 == 0) corner = g.left()[corner];
        parent[i] = corner == no_pixel ? by_corner(i) : parent[corner];
    }
}

/// Assigns a parent to every pixel without one: the parent of the nearest pixel that has a parent. Distance is counted in links;
/// breadth-first exploration in the order up, down, left, right breaks ties. Leaves no_pixel if no pixel with a parent is
/// reachable.
///
/// Linear time: assigns parents ring by ring. A ring consists of all pixels at the same distance from the nearest pixel with a
/// parent. A pixel adopts the parent of its first neighbor, in the order up, down, left, right, that is one link closer:
/// breadth-first exploration from the pixel would find the path through this neighbor.
inline void adopt_nearest_parent(const graph_view& g, buffer<std::int32_t>& parent) {
    constexpr std::int32_t pending = no_pixel - 1;  // marks pixels that are already in the next ring
    const auto parent_beside = [&](std::int32_t pixel) {
        for (side s : all_sides) {
            const std::int32_t n = g.neighbor(pixel, s);
            if (n != no_pixel && parent[n] >= 0) return parent[n];
        }
        return no_pixel;
    };
    struct adoption {
        std::int32_t pixel, parent;
    };
    buffer<adoption> ring, next;
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (parent[i] != no_pixel) continue;
        const std::int32_t found = parent_beside(i);
        if (found != no_pixel) ring.push_back({i, found});
    }
    while (!ring.empty()) {
        // Assigns the parents of a whole ring at once, because pixels at the same distance must not adopt from each other.
        for (const adoption& a : ring) parent[a.pixel] = a.parent;
        next.clear();
        for (const adoption& a : ring)
            for (side s : all_sides) {
                const std::int32_t n = g.neighbor(a.pixel, s);
                if (n == no_pixel || parent[n] != no_pixel) continue;
                next.push_back({n, parent_beside(n)});
                parent[n] = pending;
            }
        std::swap(ring, next);
    }
}

/// coarsen() for a graph whose invariants hold.
inline coarsened coarsen_sound(const graph_view& g, orphan_rule orphans) {
    level_columns columns;
    const buffer<pixel_run> runs = runs_of(g);
    graph_builder coarse = keep_even_pixels(g, runs, columns);
    link_kept_pixels(g, columns, coarse);
    for (const pixel_run& run : runs) find_parents(g, run, columns.parent);
    if (orphans == orphan_rule::adopt_nearest) adopt_nearest_parent(g, columns.parent);
    return {std::move(coarse).build(unchecked), level_map(g, std::move(columns.kept), std::move(columns.parent))};
}
}  // namespace detail

/// Halves the resolution of a graph. Keeps all pixels at even x and even y in their order, even if several share a position. The
/// position of a kept pixel is halved.
///
/// Two kept pixels are linked if a path of two links connects them in the fine graph. This path is always straight, because both
/// pixels have even coordinates.
///
/// A kept pixel is its own parent. The parent of any other pixel is the kept pixel that it reaches along links inside its 2 x 2
/// group; from a pixel at odd x and odd y, the path up-left takes precedence over the path left-up. `orphans` is the rule for
/// pixels without such a path. With adopt_nearest, a parent is no_pixel only if the whole component contains no kept pixel.
inline coarsened coarsen(const graph& g, orphan_rule orphans = orphan_rule::stay) { return detail::coarsen_sound(g, orphans); }
/// Same, for a view of a graph. Raises mismatch if the view violates an invariant of `graph`, even in release builds.
inline coarsened coarsen(const graph_view& g, orphan_rule orphans = orphan_rule::stay) {
    check_topology(g, "coarsen");
    return detail::coarsen_sound(g, orphans);
}

/// The fine pixels of each coarse pixel: those of coarse pixel i are pixels[first[i]] to pixels[first[i + 1] - 1], ascending.
struct collapsed_pixels {
    buffer<std::size_t> first;
    buffer<std::int32_t> pixels;

    explicit collapsed_pixels(const level_map& by) : first(by.kept().size() + 1, 0) {
        const array_view<const std::int32_t> parents = by.parent();
        for (const std::int32_t parent : parents)
            if (parent != no_pixel) ++first[parent + 1];
        for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
        pixels.resize(first.back(), unset);
        buffer<std::size_t> next(first);
        for (std::int32_t i = 0; i < parents.count(); ++i)
            if (parents[i] != no_pixel) pixels[next[parents[i]]++] = i;
    }
};

namespace detail {

/// Returns a layered image on the coarse graph.
///
/// topology, map  result of coarsen() for the graph of `fine`
template <template <class...> class Layers, class... Columns>
layered_image<Columns...> coarser_columns(const Layers<Columns...>& fine, graph topology, const level_map& map) {
    collapsed_pixels children(map);
    const array_view<const std::int32_t> kept = map.kept();
    for (std::int32_t c = 0; c < kept.count(); ++c) {  // moves the kept pixel to the front
        std::int32_t* const first = children.pixels.data() + children.first[c];
        std::int32_t* const found = std::find(first, children.pixels.data() + children.first[c + 1], kept[c]);
        std::rotate(first, found, found + 1);
    }
    layered_image<Columns...> result(std::move(topology));
    const auto fill = [&]<class Column>(std::type_identity<Column>) {
        buffer<typename Column::scalar> values;
        for (std::int32_t c = 0; c < kept.count(); ++c) {
            values.clear();
            for (std::size_t k = children.first[c]; k < children.first[c + 1]; ++k)
                for (const auto& value : fine.template at<Column>(children.pixels[k])) values.push_back(value);
            const auto coarse = coarser_values<Column>({values});
            std::copy(coarse.begin(), coarse.end(), result.template at<Column>(c).begin());
        }
    };
    (fill(std::type_identity<Columns>{}), ...);
    return result;
}

}  // namespace detail

/// Result of coarsen() for a layered image.
template <payload_column... Columns>
struct coarsened_layers {
    layered_image<Columns...> layers;
    level_map map;  ///< relates the pixels of both images
};

/// Halves the resolution of a layered image. The column rule `coarser` (core/columns.hpp) combines the values of the fine pixels
/// that share a parent. It receives the kept pixel first, then the other pixels by ascending index.
template <payload_column... Columns>
coarsened_layers<Columns...> coarsen(const layered_image<Columns...>& fine, orphan_rule orphans = orphan_rule::stay) {
    coarsened level = coarsen(fine.topology(), orphans);
    return {detail::coarser_columns(fine, std::move(level.topology), level.map), std::move(level.map)};
}
/// Same, for a view of a layered image. Raises mismatch if its graph violates an invariant of `graph`, even in release builds.
template <payload_column... Columns>
coarsened_layers<Columns...> coarsen(const layered_view<Columns...>& fine, orphan_rule orphans = orphan_rule::stay) {
    coarsened level = coarsen(fine.topology(), orphans);
    return {detail::coarser_columns(fine, std::move(level.topology), level.map), std::move(level.map)};
}

}}  // namespace ldi
