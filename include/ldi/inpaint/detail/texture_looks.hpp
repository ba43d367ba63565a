// Color features of texture cells: high frequencies, and blurred surroundings. The blur is a 3 x 3 binomial filter over links.
// High frequencies are the difference between a color and the color blurred once. Surroundings are blurred four times. The sums
// are not divided between passes: each pass adds four bits to the 8 bits of a color, so the sums have 24 bits.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/inpaint/detail/texture_cells.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Surroundings of a cell: blurred colors of the cell, and of the cells `tap_distance` steps away on each side. One zero byte
/// pads them to 16 bytes for vector instructions.
using texture_surroundings = std::array<std::uint8_t, 16>;

inline constexpr int tap_distance = 4;
inline constexpr int tap_values = 15;

/// Returns the sum of absolute differences.
inline int difference_of(const texture_surroundings& a, const texture_surroundings& b) {
    int sum = 0;
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC unroll 1  // GCC uses the instruction for sums of absolute differences only if the loop is not unrolled
#endif
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(int{a[i]} - int{b[i]});
    return sum;
}

/// Cells of one run whose neighbors above are contiguous, and whose neighbors below are contiguous.
struct cell_stretch {
    std::int32_t first, count;
    std::int32_t above, below;  ///< offset from a cell to its neighbor; 0 if there is none
};

inline buffer<cell_stretch> find_stretches(const texture_cells& cells) {
    buffer<cell_stretch> result;
    for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
        const std::int32_t above = cells.above[cell] - cell, below = cells.below[cell] - cell;
        if (cells.left_steps[cell] > 0 && result.back().above == above && result.back().below == below)
            ++result.back().count;
        else
            result.push_back({cell, 1, above, below});
    }
    return result;
}

/// Blurs one channel of colors with a binomial filter over links, first along x, then along y. The cell itself replaces a missing
/// neighbor.
template <executor Executor>
class cell_blur {
public:
    cell_blur(const texture_cells& cells, Executor& threads)
        : cells_(cells), stretches_(find_stretches(cells)), threads_(threads) {}

    /// Returns 16 times the blurred values.
    template <class To, class From>
    buffer<To> operator()(const buffer<From>& values) const {
        const buffer<To> across = blur_across<To>(values);
        buffer<To> result(values.size(), unset);
        for_each_stretch([&](const cell_stretch& s) {
            const To *const middle = across.data() + s.first, *const above = middle + s.above, *const below = middle + s.below;
            To* const to = result.data() + s.first;
            for (std::int32_t i = 0; i < s.count; ++i) to[i] = static_cast<To>(2U * middle[i] + above[i] + below[i]);
        });
        return result;
    }

private:
    template <class Blur>
    void for_each_stretch(Blur&& blur) const {
        parallel_for(threads_, stretches_.size(), 256, [&](std::size_t first, std::size_t last) {
            for (std::size_t s = first; s < last; ++s) blur(stretches_[s]);
        });
    }

    template <class To, class From>
    buffer<To> blur_across(const buffer<From>& values) const {
        buffer<To> result(values.size(), unset);
        for_each_stretch([&](const cell_stretch& s) {
            const std::int32_t last = s.first + s.count - 1;
            const std::int32_t left = cells_.left_steps[s.first] > 0 ? -1 : 0, right = cells_.right_steps[last] > 0 ? 1 : 0;
            const From* const from = values.data();
            To* const to = result.data();
            const auto blur = [&](std::int32_t i, std::int32_t before, std::int32_t after) {
                to[i] = static_cast<To>(2U * from[i] + from[i + before] + from[i + after]);
            };
            blur(s.first, left, s.count > 1 ? 1 : right);
            for (std::int32_t i = s.first + 1; i < last; ++i) blur(i, -1, 1);
            if (s.count > 1) blur(last, -1, right);
        });
        return result;
    }

    const texture_cells& cells_;
    buffer<cell_stretch> stretches_;
    Executor& threads_;
};

/// Features by which the search compares cells, and the detail to copy.
struct texture_looks {
    buffer<texture_surroundings> surroundings;   ///< per cell
    buffer<std::array<std::int16_t, 3>> detail;  ///< per cell: color minus blurred color, in sixteenths
};

inline texture_surroundings surroundings_of(std::int32_t cell, const texture_cells& cells,
                                            const buffer<std::array<std::uint8_t, 3>>& blurred) {
    texture_surroundings result{};
    std::size_t at = 0;
    const auto put = [&](std::int32_t tap) {
        for (const std::uint8_t value : blurred[tap]) result[at++] = value;
    };
    put(cell);
    for (side s : all_sides) put(cells.walk(cell, s, tap_distance));
    return result;
}

/// Computes the features of all cells, one channel after another to save memory.
///
/// color  K x 3, the column of the cells' layered image
template <executor Executor = const serial_executor>
texture_looks look_at(const texture_cells& cells, array_view<const std::uint8_t> color, Executor&& threads = {}) {
    const cell_blur blur(cells, threads);
    const std::size_t count = cells.pixel.size();
    const auto for_each_cell = [&](auto&& see) {
        parallel_for(threads, count, 8192, [&](std::size_t first, std::size_t last) {
            for (std::size_t cell = first; cell < last; ++cell) see(cell);
        });
    };
    texture_looks result;
    result.detail.resize(count, unset);
    buffer<std::array<std::uint8_t, 3>> blurred(count, unset);
    buffer<std::uint8_t> channel(count, unset);
    for (std::size_t c = 0; c < 3; ++c) {
        for_each_cell(
            [&](std::size_t cell) { channel[cell] = color.data()[3 * static_cast<std::size_t>(cells.pixel[cell]) + c]; });
        buffer<std::uint16_t> once = blur.template operator()<std::uint16_t>(channel);
        for_each_cell(
            [&](std::size_t cell) { result.detail[cell][c] = static_cast<std::int16_t>(16 * channel[cell] - once[cell]); });
        const buffer<std::uint16_t> twice = blur.template operator()<std::uint16_t>(once);
        once = {};
        const buffer<std::uint32_t> sums =
            blur.template operator()<std::uint32_t>(blur.template operator()<std::uint32_t>(twice));
        for_each_cell([&](std::size_t cell) { blurred[cell][c] = static_cast<std::uint8_t>((sums[cell] + 0x8000) >> 16); });
    }
    result.surroundings.resize(count, unset);
    for_each_cell(
        [&](std::size_t cell) { result.surroundings[cell] = surroundings_of(static_cast<std::int32_t>(cell), cells, blurred); });
    return result;
}

}}}  // namespace ldi::detail
