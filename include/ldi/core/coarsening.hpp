// Halving the resolution of a graph, as stride 2 does to an image, and the map back that nearest upsampling follows (paper,
// section "Mapping the PConv Network to LDI", Downscaling and Upscaling).
#pragma once

#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

namespace ldi {

/// A graph at half resolution and how it hangs together with the one it comes from.
struct coarsened {
    graph topology;                    ///< the coarse graph, on a lattice of (width + 1) / 2 x (height + 1) / 2
    std::vector<std::int32_t> kept;    ///< one a coarse pixel: the index of the fine pixel that it is; ascending
    std::vector<std::int32_t> parent;  ///< one a fine pixel: the coarse pixel that it collapses to, or no_pixel
};

/// What becomes of a pixel whose 2 x 2 group has no kept pixel that links inside the group lead to: on a thin strip, or cut off by
/// a silhouette.
enum class orphan_rule {
    adopt_nearest,  ///< it shares the parent of the pixel nearest to it by links that has one, the first that breadth-first
                    ///< exploration in the order up, down, left, right finds
    stay,           ///< it has no parent
};

namespace detail {
/// The pixel at the even/even corner of a pixel's 2 x 2 group that breadth-first exploration inside the group, in the order up,
/// down, left, right, finds first; no_pixel if none.
inline std::int32_t corner_of_group(const graph& g, std::int32_t pixel) {
    const auto follow = [&](std::initializer_list<side> path) {
        std::int32_t at = pixel;
        for (side s : path)
            if ((at = g.neighbour(at, s)) == no_pixel) break;
        return at;
    };
    const auto first = [](std::int32_t a, std::int32_t b) { return a != no_pixel ? a : b; };
    const std::size_t i = static_cast<std::size_t>(pixel);
    const bool odd_x = g.x[i] % 2 == 1, odd_y = g.y[i] % 2 == 1;
    if (odd_x && odd_y) return first(follow({side::up, side::left}), follow({side::left, side::up}));
    if (odd_x) return first(follow({side::left}), follow({side::down, side::left, side::up}));
    if (odd_y) return first(follow({side::up}), follow({side::right, side::up, side::left}));
    return pixel;
}

/// Gives every pixel without a parent that of the nearest pixel with one, as breadth-first exploration from it in the order up,
/// down, left, right finds it; leaves no_pixel where there is none in reach.
///
/// Linear time, because the shortest path that exploration finds first starts with the first side that leads nearer, and goes on
/// as the neighbour's own path does: pixels can be settled in the order of their distance.
inline void adopt_nearest_parent(const graph& g, std::vector<std::int32_t>& parent) {
    const auto parent_beside = [&](std::int32_t pixel) {
        for (side s : all_sides) {
            const std::int32_t n = g.neighbour(pixel, s);
            if (n != no_pixel && parent[static_cast<std::size_t>(n)] != no_pixel) return parent[static_cast<std::size_t>(n)];
        }
        return no_pixel;
    };
    struct adoption {
        std::int32_t pixel, parent;
    };
    std::vector<adoption> ring, next;
    for (std::size_t i = 0; i < g.size(); ++i) {
        if (parent[i] != no_pixel) continue;
        const std::int32_t pixel = static_cast<std::int32_t>(i), found = parent_beside(pixel);
        if (found != no_pixel) ring.push_back({pixel, found});
    }
    while (!ring.empty()) {
        // A ring is settled as a whole before the next is looked at: pixels at one distance must not adopt from each other.
        for (const adoption& a : ring) parent[static_cast<std::size_t>(a.pixel)] = a.parent;
        next.clear();
        for (const adoption& a : ring)
            for (side s : all_sides) {
                const std::int32_t n = g.neighbour(a.pixel, s);
                if (n != no_pixel && parent[static_cast<std::size_t>(n)] == no_pixel) next.push_back({n, parent_beside(n)});
            }
        std::swap(ring, next);
    }
}
}  // namespace detail

/// Keeps the pixels at even x and even y, all of them where several share a position, in their order, at half their position.
///
/// Two kept pixels are linked if a path of two links joined them. They are two steps apart in one direction, so that the path can
/// only be the straight one.
///
/// A kept pixel is its own parent. Any other pixel collapses to the kept pixel of its 2 x 2 group that links inside the group
/// lead to; from the odd/odd pixel, up then left is tried before left then up. For a pixel that has none, `orphans` decides; where
/// they adopt, the parent is no_pixel only where a whole component has no kept pixel.
inline coarsened coarsen(const graph& g, orphan_rule orphans = orphan_rule::adopt_nearest) {
    const std::size_t count = g.size();
    const auto is_kept = [&](std::size_t i) { return ((g.x[i] | g.y[i]) & 1) == 0; };
    coarsened result;
    result.topology.width = (g.width + 1) / 2, result.topology.height = (g.height + 1) / 2;
    std::vector<std::int32_t>&kept = result.kept, &parent = result.parent;
    parent.assign(count, no_pixel);
    kept.reserve(count / 4 + static_cast<std::size_t>(g.width));
    for (std::size_t i = 0; i < count; ++i)
        if (is_kept(i)) {
            parent[i] = static_cast<std::int32_t>(kept.size());
            kept.push_back(static_cast<std::int32_t>(i));
        }

    graph& coarse = result.topology;
    coarse.resize(kept.size());
    for (std::size_t i = 0; i < kept.size(); ++i) {
        coarse.x[i] = g.x[static_cast<std::size_t>(kept[i])] / 2;
        coarse.y[i] = g.y[static_cast<std::size_t>(kept[i])] / 2;
    }
    for (side s : all_sides) {
        const std::vector<std::int32_t>& fine_links = g.neighbours(s);
        std::vector<std::int32_t>& coarse_links = coarse.neighbours(s);
        for (std::size_t i = 0; i < kept.size(); ++i) {
            const std::int32_t between = fine_links[static_cast<std::size_t>(kept[i])];
            const std::int32_t other = between == no_pixel ? no_pixel : fine_links[static_cast<std::size_t>(between)];
            coarse_links[i] = other == no_pixel ? no_pixel : parent[static_cast<std::size_t>(other)];
        }
    }

    for (std::size_t i = 0; i < count; ++i) {
        if (is_kept(i)) continue;
        // The first way of corner_of_group() is nearly always open.
        std::int32_t corner = (g.y[i] & 1) != 0 ? g.up[i] : static_cast<std::int32_t>(i);
        if (corner != no_pixel && (g.x[i] & 1) != 0) corner = g.left[static_cast<std::size_t>(corner)];
        if (corner == no_pixel) corner = detail::corner_of_group(g, static_cast<std::int32_t>(i));
        if (corner != no_pixel) parent[i] = parent[static_cast<std::size_t>(corner)];
    }
    if (orphans == orphan_rule::adopt_nearest) detail::adopt_nearest_parent(g, parent);
    return result;
}

}  // namespace ldi
