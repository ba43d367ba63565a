// Colors that may be missing, and their averages in 3 x 3 windows over the links of a layered image.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/four_floats.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A known color: red, green, blue, and 1. An unknown color is four zeros.
using masked_color = lanes::four_floats;

/// A contiguous array of masked colors.
class masked_colors {
public:
    masked_colors() = default;
    explicit masked_colors(std::size_t count) : values_(count * lanes::wide) {}

    std::int32_t count() const { return static_cast<std::int32_t>(values_.size() / lanes::wide); }
    masked_color operator[](std::int32_t i) const noexcept { return lanes::load(at(i)); }
    void set(std::int32_t i, masked_color color) noexcept { lanes::store(at(i), color); }
    bool has(std::int32_t i) const { return at(i)[3] != 0.0F; }
    const float* at(std::int32_t i) const { return values_.data() + first_value(i); }
    float* at(std::int32_t i) { return values_.data() + first_value(i); }

private:
    static std::size_t first_value(std::int32_t i) { return static_cast<std::size_t>(i) * lanes::wide; }

    buffer<float> values_;
};

/// Returns the average of known colors, given their sum. sum[3] is the number of colors, at most 9; if it is 0, the average is
/// unknown.
inline masked_color average_of(masked_color sum) noexcept {
    static constexpr std::array<float, 10> reciprocals{0.0F,     1.0F,     1.0F / 2, 1.0F / 3, 1.0F / 4,
                                                       1.0F / 5, 1.0F / 6, 1.0F / 7, 1.0F / 8, 1.0F / 9};
    const float reciprocal = reciprocals[static_cast<std::size_t>(sum[3])];
    masked_color average = sum * reciprocal;
    average[3] = reciprocal > 0.0F ? 1.0F : 0.0F;
    return average;
}

/// Calls `store(output, average)` for every output of a plan of 3 x 3 windows. `value(pixel)` returns the color of a pixel; the
/// average covers the known colors of the window. Adds up every window column by column, in segments and irregular windows
/// alike, so results do not depend on the plan.
template <executor Executor, class Value, class Store>
void average_windows(const convolution_plan& plan, Executor& threads, Value&& value, Store&& store) {
    LDI_ASSERT(plan.kernel_size() == 3);
    parallel_for(threads, plan.segments().size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
            const std::span<const std::int32_t> rows = plan.rows_of(s);
            const std::int32_t upper = rows[0], middle = rows[1], lower = rows[2];
            const auto column = [&](std::int32_t x) noexcept {
                return (value(upper + x) + value(middle + x)) + value(lower + x);
            };
            const convolution_plan::segment segment = plan.segments()[s];
            masked_color left = column(-1);
            if (plan.stride() == 2) {
                for (std::int32_t i = 0; i < segment.count; ++i) {
                    const masked_color center = column(2 * i), right = column(2 * i + 1);
                    store(segment.first + i, average_of((left + center) + right));
                    left = right;
                }
                continue;
            }
            masked_color center = column(0);
            for (std::int32_t i = 0; i < segment.count; ++i) {
                const masked_color right = column(i + 1);
                store(segment.first + i, average_of((left + center) + right));
                left = center, center = right;
            }
        }
    });
    parallel_for(threads, plan.irregular().size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t o = begin; o < end; ++o) {
            const std::span<const std::int32_t> window = plan.window_of(o);
            const auto at = [&](std::size_t element) noexcept {
                return window[element] == no_pixel ? masked_color{} : value(window[element]);
            };
            const auto column = [&](std::size_t x) noexcept { return (at(x) + at(3 + x)) + at(6 + x); };
            store(plan.irregular()[o], average_of((column(0) + column(1)) + column(2)));
        }
    });
}

}}}  // namespace ldi::detail
