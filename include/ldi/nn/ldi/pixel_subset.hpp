// A subset of a graph's pixels, numbered from 0. A network that needs values only at some pixels stores one row for each of
// these pixels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Pixels of a subset, and the reverse lookup.
struct pixel_subset {
    buffer<std::int32_t> pixels;  ///< ascending
    buffer<std::int32_t> row_of;  ///< per pixel of the graph: its index in `pixels`, or no_pixel

    std::size_t size() const { return pixels.size(); }

    /// Collects the pixels with nonzero marks.
    static pixel_subset marked(std::span<const std::uint8_t> marks) {
        pixel_subset subset;
        const auto unmarked = static_cast<std::size_t>(std::count(marks.begin(), marks.end(), std::uint8_t{0}));
        subset.row_of.resize(marks.size(), unset);
        subset.pixels.resize(marks.size() - unmarked + 1, unset);  // one more, so that the loop writes without a branch
        std::int32_t pixel = 0, row = 0;
        for (const std::uint8_t mark : marks) {
            subset.row_of[pixel] = mark != 0 ? row : no_pixel;
            subset.pixels[row] = pixel++;
            row += mark != 0 ? 1 : 0;
        }
        subset.pixels.pop_back();
        return subset;
    }
};

namespace detail {

inline void renumber(std::int32_t& pixel, const pixel_subset& subset) {
    if (pixel == no_pixel) return;
    pixel = subset.row_of[pixel];
    LDI_ASSERT(pixel != no_pixel);
}

}  // namespace detail

/// Renumbers a plan's inputs for a tensor that stores only the rows of a subset.
///
/// inputs  must contain every pixel that the plan reads. With 1 x 1 windows and stride 2, segments also span the pixels between;
///         these must be included
inline convolution_plan renumber_inputs(convolution_plan plan, const pixel_subset& inputs) {
    detail::plan_parts parts = detail::parts_of(std::move(plan));
    LDI_ASSERT(inputs.row_of.size() == parts.input_count);
    // The pixels of a segment's row remain consecutive, because the subset contains all of them.
    for (std::int32_t& pixel : parts.rows) detail::renumber(pixel, inputs);
    for (std::int32_t& pixel : parts.windows) detail::renumber(pixel, inputs);
    parts.input_count = inputs.size();
    return detail::plan_of(std::move(parts));
}

/// Renumbers a plan for tensors that store only the rows of subsets.
///
/// outputs  contains all outputs of the plan
/// inputs   as in renumber_inputs()
inline convolution_plan on_subsets(convolution_plan plan, const pixel_subset& outputs, const pixel_subset& inputs) {
    detail::plan_parts parts = detail::parts_of(renumber_inputs(std::move(plan), inputs));
    LDI_ASSERT(outputs.row_of.size() == parts.output_count);
    for (detail::plan_segment& s : parts.segments) detail::renumber(s.first, outputs);
    for (std::int32_t& output : parts.irregular) detail::renumber(output, outputs);
    parts.output_count = outputs.size();
    return detail::plan_of(std::move(parts));
}

}}  // namespace ldi
