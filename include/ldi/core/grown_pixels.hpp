// Result of the function that layered_image::grow() calls: a graph with added pixels, and the source of each of its pixels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A contiguous range of the pixels of a layered image after grow(): either all old or all new.
struct grown_piece {
    std::int32_t first;  ///< old pixels: index of the first before grow(); new pixels: index of the first entry in `origins`
    std::int32_t count;
    bool is_new;
};

/// Result of the function that grow() calls.
struct grown_pixels {
    graph topology;                ///< graph of all pixels, old and new
    buffer<grown_piece> pieces;    ///< sources of all pixels, in the order of the new indices; every old pixel occurs once
    buffer<std::int32_t> origins;  ///< per new pixel: the old pixel whose surface it continues
};

namespace detail {

/// Whether every pixel has one source: every old pixel occurs once, and every new pixel continues an old one.
inline bool is_complete(const grown_pixels& grown, std::size_t old_count) {
    const std::size_t new_count = grown.origins.size();
    if (grown.topology.size() != old_count + new_count) return false;
    for (const std::int32_t origin : grown.origins)
        if (origin < 0 || static_cast<std::size_t>(origin) >= old_count) return false;
    buffer<bool> seen(old_count + new_count);  // one entry per old pixel, then one per entry of `origins`
    std::size_t total = 0;
    for (const grown_piece& p : grown.pieces) {
        if (p.first < 0 || p.count < 0 ||
            static_cast<std::size_t>(p.first) + static_cast<std::size_t>(p.count) > (p.is_new ? new_count : old_count))
            return false;
        for (std::int32_t i = p.first; i < p.first + p.count; ++i, ++total)
            if (std::exchange(seen[static_cast<std::size_t>(i) + (p.is_new ? old_count : 0)], true)) return false;
    }
    return total == seen.size();
}

}  // namespace detail

}}  // namespace ldi
