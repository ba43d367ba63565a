// Plans convolutions on a region of a single image. Windows ignore links: a window contains every pixel of the region inside
// its k x k square. Positions outside the region count as missing.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Columns first to last - 1.
struct column_range {
    std::int32_t first, last;
};

/// Finds the columns of row y whose windows lie completely in the region. Sets `result` to these columns, as ranges: in each
/// window row, a single run of the region covers all windows of a range. `next` is working memory.
inline void find_regular_columns(const pixel_region& region, std::int32_t y, std::int32_t radius, buffer<column_range>& result,
                                 buffer<column_range>& next) {
    result.assign(1, {0, region.width()});
    for (std::int32_t v = y - radius; v <= y + radius && !result.empty(); ++v) {
        const auto runs = region.row(v);
        next.clear();
        auto run = runs.begin();
        for (auto range = result.begin(); range != result.end() && run != runs.end();) {
            const std::int32_t first = (std::max)(range->first, run->first + radius),
                               last = (std::min)(range->last, run->last - radius);
            if (first < last) next.push_back({first, last});
            if (range->last < run->last)
                ++range;
            else
                ++run;
        }
        result.swap(next);
    }
}

class region_planner {
public:
    region_planner(const pixel_region& inputs, const pixel_region& outputs, std::int32_t kernel_size, std::int32_t stride)
        : inputs_(inputs), outputs_(outputs), radius_(kernel_size / 2) {
        plan_.kernel_size = kernel_size, plan_.stride = stride;
        plan_.input_count = inputs.size(), plan_.output_count = outputs.size();
    }

    convolution_plan run() {
        buffer<column_range> regular, scratch;
        for (std::int32_t y = 0; y < outputs_.height(); ++y) {
            const auto runs = outputs_.row(y);
            if (runs.empty()) continue;
            find_regular_columns(inputs_, plan_.stride * y, radius_, regular, scratch);
            auto range = regular.begin();
            for (const pixel_region::run& run : runs)
                for (std::int32_t x = run.first; x < run.last;) {
                    while (range != regular.end() && range->last <= plan_.stride * x) ++range;
                    const bool is_regular = range != regular.end() && range->first <= plan_.stride * x;
                    const std::int32_t end =
                        range == regular.end() ? run.last : output_from(is_regular ? range->last : range->first);
                    x = add(run, x, (std::min)(end, run.last), y, is_regular);
                }
        }
        return plan_of(std::move(plan_));
    }

private:
    /// Returns the column of the first output whose window is centered at or after input column `column`.
    std::int32_t output_from(std::int32_t column) const { return (column + plan_.stride - 1) / plan_.stride; }

    std::int32_t add(const pixel_region::run& run, std::int32_t first, std::int32_t last, std::int32_t y, bool is_regular) {
        const std::int32_t row = plan_.stride * y;
        if (is_regular && last - first >= min_segment) {
            plan_.segments.push_back({run.pixel_at(first), last - first});
            for (std::int32_t v = row - radius_; v <= row + radius_; ++v)
                plan_.rows.push_back(inputs_.number(plan_.stride * first, v));
            return last;
        }
        for (std::int32_t x = first; x < last; ++x) {
            plan_.irregular.push_back(run.pixel_at(x));
            plan_.windows.resize(plan_.windows.size() + plan_.elements());
            std::span<std::int32_t> window = std::span(plan_.windows).last(plan_.elements());
            for (std::int32_t v = row - radius_; v <= row + radius_; ++v, window = window.subspan(plan_.k())) {
                const std::int32_t x_first = plan_.stride * x - radius_, outside = (std::max)(-x_first, 0);
                std::fill_n(window.begin(), outside, no_pixel);
                inputs_.numbers(x_first + outside, v, window.first(plan_.k()).subspan(static_cast<std::size_t>(outside)));
            }
        }
        return last;
    }

    const pixel_region &inputs_, &outputs_;
    std::int32_t radius_;
    plan_parts plan_;
};

}  // namespace detail

/// Plans a convolution with stride 1.
///
/// kernel_size  odd, 1 to max_kernel_size
///
/// Raises invalid_option for any other kernel size.
inline convolution_plan plan_convolution(const pixel_region& region, std::int32_t kernel_size) {
    detail::check_kernel_size(kernel_size);
    return detail::region_planner(region, region, kernel_size, 1).run();
}

/// Plans a convolution with stride 2. Outputs are the pixels of `half`.
///
/// kernel_size  odd, 1 to max_kernel_size
/// half         halved(region)
///
/// Raises invalid_option for any other kernel size, and mismatch for any other `half`.
inline convolution_plan plan_convolution(const pixel_region& region, std::int32_t kernel_size, const pixel_region& half) {
    detail::check_kernel_size(kernel_size);
    if (half != halved(region))
        raise(error_code::mismatch, "plan_convolution",
              "the halved region of a lattice of " + std::to_string(region.width()) + " x " + std::to_string(region.height()),
              "a different region, of " + std::to_string(half.width()) + " x " + std::to_string(half.height()));
    return detail::region_planner(region, half, kernel_size, 2).run();
}

}}  // namespace ldi
