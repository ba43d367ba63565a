// Result of the callback of layered_image::grow(): a graph with added pixels, and the source of each of its pixels.
// for_each_piece() visits these sources on several threads.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A contiguous range of the pixels of a layered image after grow(): either all old or all new.
struct grown_piece {
    std::int32_t first;  ///< old pixels: first pixel's index before grow(); new pixels: first pixel's index in `origins`
    std::int32_t count;
    bool is_new;
};

/// Result of the callback of layered_image::grow().
struct grown_pixels {
    /// Graph of all pixels, old and new. The lattice may grow. Old pixels keep their positions, or all move by the same offset.
    /// grow() does not check this, because it would need a copy of all positions.
    graph topology;
    buffer<grown_piece> pieces;    ///< sources of all pixels, in the order of the new indices; every old pixel occurs once
    buffer<std::int32_t> origins;  ///< per new pixel: the old pixel whose surface it continues
};

/// Calls body(piece, first) for every piece with pixels, for several pieces at the same time. `first` is the new index of the
/// piece's first pixel. Passes exceptions on like parallel_for().
///
/// pieces  in the order of the new indices, as in grown_pixels: counts of 0 or more, fewer than 2^31 pixels in total
template <executor Executor, class Body>
void for_each_piece(Executor& threads, std::span<const grown_piece> pieces, Body&& body) {
    constexpr std::size_t pieces_per_task = 1024;
    parallel_for(threads, pieces.size(), pieces_per_task, [&](std::size_t begin, std::size_t end) {
        std::int32_t first = 0;
        for (const grown_piece& p : pieces.first(begin)) first += p.count;
        for (const grown_piece& p : pieces.subspan(begin, end - begin)) {
            if (p.count > 0) body(p, first);
            first += p.count;
        }
    });
}

namespace detail {

/// Whether every pixel has one source: every old pixel occurs once, and every new pixel continues an old pixel.
inline bool is_complete(const grown_pixels& grown, std::size_t old_count) {
    const std::size_t new_count = grown.origins.size();
    if (grown.topology.size() != old_count + new_count) return false;
    for (const std::int32_t origin : grown.origins)
        if (origin < 0 || static_cast<std::size_t>(origin) >= old_count) return false;
    // `seen` marks the entries of `origins` that occur in pieces. Pieces usually contain the old pixels in ascending order. As
    // long as they do, `continued` counts the old pixels so far, and `seen` has no entries for old pixels. At the first piece out
    // of order, `seen` gets an entry for each old pixel, and marks the first `continued` of them.
    buffer<bool> seen(new_count);
    std::size_t total = 0, continued = 0;
    bool is_in_order = true;
    for (const grown_piece& p : grown.pieces) {
        if (p.first < 0 || p.count < 0) return false;
        const auto first = static_cast<std::size_t>(p.first), count = static_cast<std::size_t>(p.count);
        if (first + count > (p.is_new ? new_count : old_count)) return false;
        total += count;
        if (!p.is_new && is_in_order && first == continued) {
            continued += count;
            continue;
        }
        if (!p.is_new && is_in_order) {
            seen.resize(new_count + continued, true);
            seen.resize(new_count + old_count);
            is_in_order = false;
        }
        for (std::size_t i = first; i < first + count; ++i)
            if (std::exchange(seen[i + (p.is_new ? 0 : new_count)], true)) return false;
    }
    return total == old_count + new_count;
}

}  // namespace detail

}}  // namespace ldi
