// Breadth-first k x k neighborhoods over the graph: which pixel lies under each element of a convolution kernel (paper, section
// "Mapping the PConv Network to LDI", Convolution). Links are followed around silhouettes, never across them.
#pragma once

#include <ldi/core/graph.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The largest kernel that gather_window takes.
inline constexpr std::int32_t largest_kernel_size = 15;

namespace detail {
/// A kernel element that exploration has reached, and the pixel found there.
struct reached_element {
    std::int32_t pixel, row, column;
};
}  // namespace detail

/// Fills `window` with the pixels under a kernel centered on `pixel`.
///
/// kernel_size  odd, 1 to largest_kernel_size
/// window       kernel_size x kernel_size, row-major; element (row, column) becomes the index of a pixel that lies
///              (column - kernel_size / 2, row - kernel_size / 2) from `pixel`, or no_pixel where no link leads inside the window
///
/// Exploration is breadth-first from the center: elements are taken up in the order in which they were reached, and from each
/// the links up, down, left, right are followed in this order. The first pixel to reach an element keeps it; no other pixel at
/// that position is explored. So where equally long paths lead to different layers, the one that turns up first wins, then down.
/// The relation is not symmetric: j may lie under the kernel of i when i does not lie under that of j.
inline void gather_window(const graph_view& g, std::int32_t pixel, std::int32_t kernel_size, std::span<std::int32_t> window) {
    LDI_ASSERT(kernel_size >= 1 && kernel_size <= largest_kernel_size && kernel_size % 2 == 1);
    const std::size_t count = static_cast<std::size_t>(kernel_size * kernel_size);
    LDI_ASSERT(window.size() == count);
    LDI_ASSERT(pixel >= 0 && pixel < g.count());

    const auto element = [&](std::int32_t row, std::int32_t column) -> std::int32_t& {
        return window.data()[row * kernel_size + column];
    };
    std::array<detail::reached_element, std::size_t{largest_kernel_size} * std::size_t{largest_kernel_size}> reached;
    std::size_t reached_count = 0;
    const auto reach = [&](std::int32_t row, std::int32_t column, std::int32_t found) {
        element(row, column) = found;
        reached[reached_count++] = {found, row, column};
    };

    std::fill(window.begin(), window.end(), no_pixel);
    reach(kernel_size / 2, kernel_size / 2, pixel);
    for (std::size_t next = 0; next < reached_count && reached_count < count; ++next) {
        const detail::reached_element from = reached[next];
        for (side s : all_sides) {
            const std::int32_t row = from.row + step_y(s), column = from.column + step_x(s);
            if (row < 0 || row >= kernel_size || column < 0 || column >= kernel_size) continue;
            const std::int32_t neighbor = g.neighbor(from.pixel, s);
            if (neighbor != no_pixel && element(row, column) == no_pixel) reach(row, column, neighbor);
        }
    }
}

}}  // namespace ldi
