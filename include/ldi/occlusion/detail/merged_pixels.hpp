// Merges the pixels of a layered image and new pixels into one graph.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Returns the index of each pixel in a merged graph: first of the K old pixels, then of the new ones.
///
/// pieces  all pixels, in the order of the merged graph
template <executor Executor>
buffer<std::int32_t> merged_indices(std::span<const grown_piece> pieces, std::int32_t old_count, std::int32_t new_count,
                                    Executor& threads) {
    buffer<std::int32_t> result(static_cast<std::size_t>(old_count) + static_cast<std::size_t>(new_count), unset);
    for_each_piece(threads, pieces, [&](const grown_piece& p, std::int32_t first) {
        std::int32_t* const to = result.data() + p.first + (p.is_new ? old_count : 0);
        std::iota(to, to + p.count, first);
    });
    return result;
}

/// Returns the graph of all pixels. Replaces one column of the old graph after another, so that at most one column exists twice.
///
/// old, added  the pixels; in links of both graphs, K + i is the new pixel i, where K is the number of old pixels
/// pieces      all pixels, in the order of the result; each pixel of a piece is the right neighbor of the pixel before it
/// index       merged_indices()
/// margin      the lattice grows by this width on each side, and all old pixels move by it. Positions in `added` include it
template <executor Executor>
graph merged_graph(graph_builder old, const graph_builder& added, std::span<const grown_piece> pieces,
                   const buffer<std::int32_t>& index, std::int32_t margin, Executor& threads) {
    const auto moved = [&](std::int32_t pixel) { return pixel == no_pixel ? no_pixel : index[pixel]; };
    // Returns a column of the result. fill(from, count, is_new, to, first) writes the values of a piece to `to`; `from` points to
    // the values of the piece's pixels in the column of their graph, and `first` is the piece's first index in the result.
    const auto merged = [&]<class T>(array_view<const T> of_old, array_view<const T> of_added, auto&& fill) {
        buffer<T> result(index.size(), unset);
        for_each_piece(threads, pieces, [&](const grown_piece& p, std::int32_t first) {
            fill((p.is_new ? of_added : of_old).data() + p.first, p.count, p.is_new, result.data() + first, first);
        });
        return result;
    };
    using coordinates = const lattice_coordinate*;
    const auto x = [&](coordinates from, std::int32_t count, bool is_new, lattice_coordinate* to, std::int32_t) {
        const std::int32_t start = *from + (is_new ? 0 : margin);
        for (std::int32_t i = 0; i < count; ++i) to[i] = static_cast<lattice_coordinate>(start + i);
    };
    const auto y = [&](coordinates from, std::int32_t count, bool is_new, lattice_coordinate* to, std::int32_t) {
        std::fill_n(to, count, static_cast<lattice_coordinate>(*from + (is_new ? 0 : margin)));
    };
    using values = const std::int32_t*;
    const auto vertical = [&](values from, std::int32_t count, bool, std::int32_t* to, std::int32_t) {
        for (std::int32_t i = 0; i < count; ++i) to[i] = moved(from[i]);
    };
    const auto left = [&](values from, std::int32_t count, bool, std::int32_t* to, std::int32_t first) {
        to[0] = moved(from[0]);
        for (std::int32_t i = 1; i < count; ++i) to[i] = first + i - 1;
    };
    const auto right = [&](values from, std::int32_t count, bool, std::int32_t* to, std::int32_t first) {
        for (std::int32_t i = 0; i + 1 < count; ++i) to[i] = first + i + 1;
        to[count - 1] = moved(from[count - 1]);
    };
    using view = array_view<const std::int32_t>;
    using coordinate_view = array_view<const lattice_coordinate>;
    old.replace_columns(
        unchecked, old.width() + 2 * margin, old.height() + 2 * margin,
        [&](coordinate_view from) { return merged(from, added.x(), x); },
        [&](coordinate_view from) { return merged(from, added.y(), y); },
        [&](side s, view from) {
            if (s == side::left) return merged(from, added.left(), left);
            if (s == side::right) return merged(from, added.right(), right);
            return merged(from, added.neighbors(s), vertical);
        });
    return std::move(old).build(unchecked);
}

}}}  // namespace ldi::detail
