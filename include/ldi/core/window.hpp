// Breadth-first k x k neighborhoods over the graph: selects the pixel under each element of a convolution kernel (paper, section
// "Mapping the PConv Network to LDI", Convolution). Exploration follows links around silhouettes, never across them.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Maximum kernel size of gather_window().
inline constexpr std::int32_t max_kernel_size = 15;

namespace detail {

/// Same as gather_window() for a kernel of 3 x 3 centered on a pixel with four neighbors; returns false for other pixels. If
/// the center has four neighbors, exploration reaches each corner of the window by one of only two paths, both of two links.
inline bool gather_small_window(const graph_view& g, std::int32_t pixel, std::span<std::int32_t> window) {
    const std::int32_t up = g.up()[pixel], down = g.down()[pixel], left = g.left()[pixel], right = g.right()[pixel];
    if (up == no_pixel || down == no_pixel || left == no_pixel || right == no_pixel) return false;
    const auto first = [](std::int32_t a, std::int32_t b) { return a != no_pixel ? a : b; };
    window[0] = first(g.left()[up], g.up()[left]), window[2] = first(g.right()[up], g.up()[right]);
    window[6] = first(g.left()[down], g.down()[left]), window[8] = first(g.right()[down], g.down()[right]);
    window[1] = up, window[3] = left, window[4] = pixel, window[5] = right, window[7] = down;
    return true;
}

[[noreturn]] inline void refuse_kernel_size(std::int32_t kernel_size) {
    raise(error_code::invalid_option, "gather_window", "an odd kernel size from 1 to " + std::to_string(max_kernel_size),
          std::to_string(kernel_size));
}

}  // namespace detail

/// Fills `window` with the pixels under a kernel centered on `pixel`.
///
/// g            graph whose invariants hold (check_topology()); gather_window() does not check them, because the check would
///              take far longer than the exploration
/// kernel_size  odd, 1 to max_kernel_size; raises invalid_option for any other size
/// window       kernel_size x kernel_size, row-major; element (row, column) becomes the index of a pixel at (column -
///              kernel_size / 2, row - kernel_size / 2) from `pixel`, or no_pixel if no path of links inside the window leads
///              there
///
/// Exploration is breadth-first from the center. It processes elements in the order in which they were reached, and follows the
/// links up, down, left, right in this order. The first pixel that reaches an element occupies it; exploration skips all other
/// pixels at that position. If equally long paths lead to different layers, the first step at which the paths differ therefore
/// decides: up precedes down, then left, then right. The relation is not symmetric: the window of i may contain j although the
/// window of j does not contain i.
inline void gather_window(const graph_view& g, std::int32_t pixel, std::int32_t kernel_size, std::span<std::int32_t> window) {
    if (kernel_size < 1 || kernel_size > max_kernel_size || kernel_size % 2 == 0) detail::refuse_kernel_size(kernel_size);
    const std::size_t count = static_cast<std::size_t>(kernel_size * kernel_size);
    LDI_ASSERT(window.size() == count);
    LDI_ASSERT(pixel >= 0 && pixel < g.count());
    if (kernel_size == 3 && detail::gather_small_window(g, pixel, window)) return;

    // The window, with a border of elements that count as reached. Exploration ends at this border.
    constexpr std::int32_t border = 0;
    const std::int32_t width = kernel_size + 2, center = (kernel_size / 2 + 1) * (width + 1);
    std::array<std::int32_t, std::size_t{max_kernel_size + 2} * (max_kernel_size + 2)> found;
    std::array<std::int32_t, std::size_t{max_kernel_size} * max_kernel_size> reached;  // elements in the order of exploration
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
