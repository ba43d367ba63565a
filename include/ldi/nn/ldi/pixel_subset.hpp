// A subset of a graph's pixels, numbered from 0. A network that needs values only at some pixels stores one row of values for
// each of these pixels.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Pixels of a subset, and the index of each pixel in the subset. Subsets are immutable, so their indices stay valid.
class pixel_subset {
public:
    pixel_subset() = default;
    pixel_subset(const pixel_subset&) = default;
    pixel_subset(pixel_subset&&) noexcept = default;
    pixel_subset& operator=(const pixel_subset& other) { return *this = pixel_subset(other); }  // unchanged if memory runs out
    pixel_subset& operator=(pixel_subset&&) noexcept = default;

    /// Collects the pixels with nonzero marks.
    static pixel_subset marked(std::span<const std::uint8_t> marks) {
        pixel_subset subset;
        const auto unmarked = static_cast<std::size_t>(std::count(marks.begin(), marks.end(), std::uint8_t{0}));
        subset.row_of_.resize(marks.size(), unset);
        subset.pixels_.resize(marks.size() - unmarked + 1, unset);  // one spare entry, so that the loop writes without a branch
        std::int32_t pixel = 0, row = 0;
        for (const std::uint8_t mark : marks) {
            subset.row_of_[pixel] = mark != 0 ? row : no_pixel;
            subset.pixels_[row] = pixel++;
            row += mark != 0 ? 1 : 0;
        }
        subset.pixels_.pop_back();
        return subset;
    }

    std::size_t size() const { return pixels_.size(); }
    /// The pixels, ascending.
    array_view<const std::int32_t> pixels() const& { return pixels_; }
    array_view<const std::int32_t> pixels() const&& = delete;  // the values would be destroyed with the subset
    /// Returns the pixels, and leaves the subset empty.
    buffer<std::int32_t> take_pixels() && {
        row_of_ = {};
        return std::move(pixels_);
    }
    /// Per pixel of the graph: its index in pixels(), or no_pixel.
    array_view<const std::int32_t> row_of() const& { return row_of_; }
    array_view<const std::int32_t> row_of() const&& = delete;

private:
    buffer<std::int32_t> pixels_, row_of_;
};

namespace detail {

inline void check_graph_of(const pixel_subset& subset, std::size_t pixels) {
    if (subset.row_of().size() != pixels)
        raise(error_code::mismatch, "pixel_subset", "a subset of the plan's " + std::to_string(pixels) + " pixels",
              "a subset of " + std::to_string(subset.row_of().size()) + " pixels");
}

/// Returns the row of the first of `count` consecutive pixels. Raises mismatch unless the subset contains all of them.
inline std::int32_t row_of_run(std::int32_t first, std::int32_t count, const pixel_subset& subset) {
    const std::int32_t last = first + count - 1, row = subset.row_of()[first], last_row = subset.row_of()[last];
    if (row == no_pixel || last_row == no_pixel || last_row - row != last - first)
        raise(error_code::mismatch, "pixel_subset",
              "a subset with pixels " + std::to_string(first) + " to " + std::to_string(last) + ", which the plan uses",
              "a subset that lacks some of these pixels");
    return row;
}

}  // namespace detail

/// Renumbers a plan's inputs for a tensor that stores only the rows of a subset.
///
/// inputs  pixels that the tensor stores: every pixel that the plan reads. With 1 x 1 windows and stride 2, they must also
///         include the pixels between the inputs of a segment, although the plan does not read them
///
/// Raises mismatch if the subset belongs to a graph with a different number of pixels, or lacks one of these pixels.
inline convolution_plan renumber_inputs(convolution_plan plan, const pixel_subset& inputs) {
    detail::plan_parts parts = detail::parts_of(std::move(plan));
    detail::check_graph_of(inputs, parts.input_count);
    const std::int32_t half = parts.kernel_size / 2;
    for (std::size_t i = 0; i < parts.rows.size(); ++i) {
        const std::int32_t span = parts.stride * (parts.segments[i / parts.k()].count - 1) + parts.kernel_size;
        parts.rows[i] = detail::row_of_run(parts.rows[i] - half, span, inputs) + half;
    }
    for (std::int32_t& pixel : parts.windows)
        if (pixel != no_pixel) pixel = detail::row_of_run(pixel, 1, inputs);
    parts.input_count = inputs.size();
    return detail::plan_of(std::move(parts));
}

/// Renumbers a plan's inputs and outputs for tensors that each store only the rows of one subset.
///
/// outputs  contains all outputs of the plan
/// inputs   as in renumber_inputs()
///
/// Raises mismatch as renumber_inputs() does, and if `outputs` belongs to a graph with a different number of pixels or lacks an
/// output of the plan.
inline convolution_plan on_subsets(convolution_plan plan, const pixel_subset& outputs, const pixel_subset& inputs) {
    detail::plan_parts parts = detail::parts_of(renumber_inputs(std::move(plan), inputs));
    detail::check_graph_of(outputs, parts.output_count);
    for (detail::plan_segment& s : parts.segments) s.first = detail::row_of_run(s.first, s.count, outputs);
    for (std::int32_t& output : parts.irregular) output = detail::row_of_run(output, 1, outputs);
    parts.output_count = outputs.size();
    return detail::plan_of(std::move(parts));
}

}}  // namespace ldi
