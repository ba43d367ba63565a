// Views of index columns that violate an invariant of a graph.
#pragma once

#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>

#include <cstdint>

namespace ldi::testing {

/// Calls check(graph_view) with views of a grid of 8 x 8 in which one entry is wrong.
template <class Check>
void for_broken_views(Check&& check) {
    const graph g = make_grid(8, 8);
    const auto broken = [&](int column, std::int32_t value) {
        buffer<std::int32_t> columns[] = {g.x().copy(),    g.y().copy(),    g.up().copy(),
                                          g.down().copy(), g.left().copy(), g.right().copy()};
        columns[column][20] = value;
        check(graph_view(8, 8, columns[0], columns[1], columns[2], columns[3], columns[4], columns[5]));
    };
    for (int column = 0; column < 6; ++column)
        for (const std::int32_t value : {1 << 24, -2, 40}) broken(column, value);
}

}  // namespace ldi::testing
