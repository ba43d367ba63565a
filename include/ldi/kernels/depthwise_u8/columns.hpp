// Selects the columns of the stored rows on which a piece of a depthwise convolution's result depends.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The inputs of result pixels first to first + count - 1 of a row. Each stored column that they depend on occupies one slot,
/// in order. The columns outside the image (-1 and `width`) also have slots.
struct depthwise_columns {
    /// Limits with which the slots and the rows that fill them fit in a first-level cache of 32 KiB.
    static constexpr std::size_t max_slots = 40, max_taps = 4 * max_slots;

    std::size_t first = 0, count = 0;
    std::size_t first_column = 0;  ///< column of slot 0, plus one because columns start at -1
    std::size_t slot_count = 0;
    /// Entry i is the slot of column first * stride + i - 1 of the enlarged rows; a window reads three consecutive entries.
    std::uint16_t slot_of[max_taps];

    /// Maximum number of result pixels that fit at any position.
    static std::size_t max_pixels(std::size_t stride, std::size_t repeat) { return (max_slots - 3) * repeat / stride; }

    depthwise_columns(std::size_t first_pixel, std::size_t pixels, std::size_t stride, std::size_t repeat)
        : first(first_pixel), count(pixels) {
        // argument and result are column indices plus one
        const auto column = [repeat](std::size_t enlarged) { return (enlarged + repeat - 1) / repeat; };
        const std::size_t begin = first * stride, end = (first + count - 1) * stride + 2;
        first_column = column(begin);
        for (std::size_t i = begin; i <= end; ++i) slot_of[i - begin] = static_cast<std::uint16_t>(column(i) - first_column);
        slot_count = column(end) - first_column + 1;
    }
};

}}}  // namespace ldi::detail
