// Which columns of the stored rows a piece of a depthwise convolution's result reads.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION::detail {

/// Result pixels first .. first + count - 1 of a row. What they read is laid out in slots, one a stored column, in order; the
/// columns outside the image (-1 and `width`) have slots as well.
struct depthwise_columns {
    /// Few enough that the slots and the rows they are filled from share a first-level cache of 32 KiB.
    static constexpr std::size_t most_slots = 40, most_taps = 4 * most_slots;

    std::size_t first = 0, count = 0;
    std::size_t first_column = 0;  ///< that slot 0 holds, plus one
    std::size_t slot_count = 0;
    /// Of column first + i - 1 of the enlarged rows, at stride 1; a window takes three in a row.
    std::uint16_t slot_of[most_taps];

    /// So many result pixels fit whatever their position.
    static std::size_t most_pixels(std::size_t stride, std::size_t repeat) { return (most_slots - 3) * repeat / stride; }

    depthwise_columns(std::size_t first_pixel, std::size_t pixels, std::size_t stride, std::size_t repeat)
        : first(first_pixel), count(pixels) {
        const auto column = [repeat](std::size_t enlarged) { return (enlarged + repeat - 1) / repeat; };  // both plus one
        const std::size_t begin = first * stride, end = (first + count - 1) * stride + 2;
        first_column = column(begin);
        for (std::size_t i = begin; i <= end; ++i) slot_of[i - begin] = static_cast<std::uint16_t>(column(i) - first_column);
        slot_count = column(end) - first_column + 1;
    }
};

}  // namespace ldi::detail
