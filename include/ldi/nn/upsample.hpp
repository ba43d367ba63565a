// Nearest upsampling on layered depth images: which coarse pixel lies above each pixel (paper, section "Mapping the PConv Network
// to LDI", Upscaling). Convolutions read through this map, see convolution_source; nothing need be written out.
#pragma once

#include <ldi/core/coarsening.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ldi {

/// For each pixel of `g` the coarse pixel at the even/even corner of its own 2 x 2 group, or no_pixel where links inside the
/// group lead to none. coarsened::parent is the same with those filled in from their surroundings.
///
/// coarse  coarsen(g)
inline std::vector<std::int32_t> parents_in_group(const graph& g, const coarsened& coarse) {
    std::vector<std::int32_t> parents(g.size(), no_pixel);
    for (std::size_t i = 0; i < g.size(); ++i) {
        const std::int32_t corner = detail::corner_of_group(g, static_cast<std::int32_t>(i));
        if (corner != no_pixel) parents[i] = coarse.parent[static_cast<std::size_t>(corner)];
    }
    return parents;
}

/// The rows that some pixels take their values from, ascending, each once.
///
/// pixels  any, indices into `rows`
/// rows    for each pixel its row, or no_pixel
inline std::vector<std::int32_t> needed_rows(std::span<const std::int32_t> pixels, std::span<const std::int32_t> rows,
                                             std::size_t row_count) {
    std::vector<std::uint8_t> needed(row_count, 0);
    for (const std::int32_t pixel : pixels)
        if (rows[static_cast<std::size_t>(pixel)] != no_pixel)
            needed[static_cast<std::size_t>(rows[static_cast<std::size_t>(pixel)])] = 1;
    std::vector<std::int32_t> result;
    for (std::size_t i = 0; i < row_count; ++i)
        if (needed[i] != 0) result.push_back(static_cast<std::int32_t>(i));
    return result;
}

}  // namespace ldi
