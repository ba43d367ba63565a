// A subset of a graph's pixels, numbered from 0. A network that needs values only at some pixels stores rows for these alone.
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
        subset.row_of.resize(marks.size());
        subset.pixels.resize(marks.size() - static_cast<std::size_t>(std::count(marks.begin(), marks.end(), std::uint8_t{0})));
        std::int32_t pixel = 0, row = 0;
        for (const std::uint8_t mark : marks) {
            subset.row_of[pixel] = mark != 0 ? row : no_pixel;
            if (mark != 0) subset.pixels[row++] = pixel;
            ++pixel;
        }
        return subset;
    }
};

/// Renumbers a plan for tensors that store only the rows of subsets.
///
/// outputs  contains all outputs of the plan
/// inputs   contains all pixels of their windows
inline convolution_plan on_subsets(convolution_plan plan, const pixel_subset& outputs, const pixel_subset& inputs) {
    LDI_ASSERT(outputs.row_of.size() == plan.output_count && inputs.row_of.size() == plan.input_count);
    const auto renumber = [](std::int32_t& pixel, const pixel_subset& subset) {
        if (pixel == no_pixel) return;
        pixel = subset.row_of[pixel];
        LDI_ASSERT(pixel != no_pixel);
    };
    // Pixels of a segment and of its rows remain consecutive, because the subsets contain all of them.
    for (convolution_plan::segment& s : plan.segments) renumber(s.first, outputs);
    for (std::int32_t& pixel : plan.rows) renumber(pixel, inputs);
    for (std::int32_t& output : plan.irregular) renumber(output, outputs);
    for (std::int32_t& pixel : plan.windows) renumber(pixel, inputs);
    plan.output_count = outputs.size(), plan.input_count = inputs.size();
    return plan;
}

}}  // namespace ldi
