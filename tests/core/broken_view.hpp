// Views of columns that violate an invariant of a graph.
#pragma once

#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>

#include <cstdint>

namespace ldi::testing {

/// Calls check(graph_view) with views of a grid of 8 x 8 in which one entry is wrong.
template <class Check>
void for_broken_views(Check&& check) {
    const graph g = make_grid(8, 8);
    const auto broken = [&](auto&& damage) {
        buffer<lattice_coordinate> at[] = {g.x().copy(), g.y().copy()};
        buffer<std::int32_t> neighbors[] = {g.up().copy(), g.down().copy(), g.left().copy(), g.right().copy()};
        damage(at, neighbors);
        check(graph_view(8, 8, at[0], at[1], neighbors[0], neighbors[1], neighbors[2], neighbors[3]));
    };
    for (int column = 0; column < 2; ++column)
        for (const lattice_coordinate value : {lattice_coordinate{8}, lattice_coordinate{65535}, lattice_coordinate{40}})
            broken([&](auto& at, auto&) { at[column][20] = value; });
    for (int column = 0; column < 4; ++column)
        for (const std::int32_t value : {1 << 24, -2, 40}) broken([&](auto&, auto& neighbors) { neighbors[column][20] = value; });
}

}  // namespace ldi::testing
