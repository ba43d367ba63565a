// Isotropic diffusion over the links of a layered image, from known to unknown pixels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/other_bytes.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Diffuses values into all unknown pixels.
///
/// g               in canonical order
/// known           K, 0 for unknown pixels
/// rounds          Gauss-Seidel rounds on each level of the multigrid
/// value           value(pixel, s) returns the channels of a known pixel, which is the neighbor on side `s` of an unknown pixel
/// before_solving  called after all calls of value()
/// store           store(pixel, diffusion<Channels>::value_type): called last, for every unknown pixel, in ascending order
///
/// Raises mismatch if an unknown pixel precedes its left or its upper neighbor, which is impossible in canonical order. If no
/// link path connects a surface to a known pixel, it gets the mean of the known values that border unknown pixels of other
/// surfaces.
template <std::size_t Channels, class Value, class BeforeSolving, class Store>
void diffuse_unknown(const graph_view& g, array_view<const std::uint8_t> known, int rounds, Value&& value,
                     BeforeSolving&& before_solving, Store&& store) {
    diffusion<Channels> solver;
    solver.reserve(static_cast<std::size_t>(std::count(known.begin(), known.end(), std::uint8_t{0})));
    constexpr std::int32_t no_cell = 0;  // cells count from 1
    buffer<std::int32_t> cell_of(g.size(), no_cell);
    for_each_unknown(known, [&](std::int32_t i) {
        const std::int32_t cell = cell_of[i] = solver.add_cell(g.x()[i], g.y()[i]);
        for (side s : all_sides) {
            const std::int32_t neighbor = g.neighbor(i, s);
            if (neighbor == no_pixel) continue;
            if (known[neighbor] != 0)
                solver.add_known_neighbor(cell, value(neighbor, s));
            else if ((s == side::left || s == side::up) && cell_of[neighbor] == no_cell)
                raise(error_code::mismatch, "diffusion", "pixels in canonical order",
                      "pixel " + std::to_string(i) + " before its neighbor " + std::to_string(neighbor));
            else if (s == side::left)
                solver.link_left(cell, cell_of[neighbor]);
            else if (s == side::up)
                solver.link_up(cell, cell_of[neighbor]);
        }
    });
    before_solving();
    solver.solve(rounds);
    std::int32_t cell = 0;
    for_each_unknown(known, [&](std::int32_t i) { store(i, solver.value(++cell)); });
}

}}}  // namespace ldi::detail
