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

    // The window with a border of elements that count as reached, so that exploration ends there.
    constexpr std::int32_t border = 0;
    const std::int32_t width = kernel_size + 2, center = (kernel_size / 2 + 1) * (width + 1);
    std::array<std::int32_t, std::size_t{largest_kernel_size + 2} * (largest_kernel_size + 2)> found;
    std::array<std::int32_t, std::size_t{largest_kernel_size} * largest_kernel_size> reached;  // elements, in order
    std::fill_n(found.begin(), width * width, border);
    for (std::int32_t row = 1; row <= kernel_size; ++row) std::fill_n(found.begin() + row * width + 1, kernel_size, no_pixel);
    const auto at = [&](std::int32_t element) -> std::int32_t& { return found[static_cast<std::size_t>(element)]; };
    at(center) = pixel, reached[0] = center;
    std::size_t reached_count = 1;
    for (std::size_t next = 0; next < reached_count && reached_count < count; ++next) {
        const std::int32_t from = reached[next];
        for (side s : all_sides) {
            const std::int32_t to = from + step_y(s) * width + step_x(s);
            if (at(to) != no_pixel) continue;
            const std::int32_t neighbor = g.neighbor(at(from), s);
            if (neighbor != no_pixel) at(to) = neighbor, reached[reached_count++] = to;
        }
    }
    for (std::int32_t row = 0; row < kernel_size; ++row)
        std::copy_n(found.begin() + (row + 1) * width + 1, kernel_size, window.begin() + row * kernel_size);
}

}}  // namespace ldi
