// A subset of a graph's pixels, numbered from 0. A network that needs values only at some pixels stores one row of values for
// each of these pixels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Pixels of a subset, and the index of each pixel in the subset: its row. Subsets are immutable, so their rows stay valid.
/// Memory: a quarter of a byte per pixel of the graph.
class pixel_subset {
public:
    pixel_subset() = default;
    pixel_subset(const pixel_subset&) = default;
    pixel_subset(pixel_subset&& other) noexcept { swap(other); }
    pixel_subset& operator=(pixel_subset other) noexcept {
        swap(other);
        return *this;
    }

    /// Collects the pixels of a graph for which has(pixel) is true.
    template <class Has>
    static pixel_subset where(std::size_t pixel_count, Has&& has) {
        pixel_subset subset;
        subset.pixel_count_ = pixel_count;
        subset.blocks_.resize((pixel_count + block_size - 1) / block_size);
        std::int32_t row = 0;
        for (std::size_t b = 0; b < subset.blocks_.size(); ++b) {
            const std::size_t first = b * block_size, count = (std::min)(pixel_count - first, block_size);
            std::uint64_t bits = 0;
            for (std::size_t i = 0; i < count; ++i)
                bits |= static_cast<std::uint64_t>(has(static_cast<std::int32_t>(first + i)) ? 1 : 0) << i;
            subset.blocks_[b] = {bits, row};
            row += std::popcount(bits);
        }
        subset.size_ = static_cast<std::size_t>(row);
        return subset;
    }
    /// Collects the pixels with nonzero marks.
    static pixel_subset marked(std::span<const std::uint8_t> marks) {
        return where(marks.size(), [&](std::int32_t pixel) { return marks[static_cast<std::size_t>(pixel)] != 0; });
    }

    /// Number of pixels in the subset.
    std::size_t size() const { return size_; }
    /// Number of pixels of the graph.
    std::size_t pixel_count() const { return pixel_count_; }
    /// Returns the row of a pixel of the graph, or no_pixel if the subset does not contain it.
    std::int32_t row_of(std::int32_t pixel) const noexcept {
        LDI_ASSERT(pixel >= 0 && static_cast<std::size_t>(pixel) < pixel_count_);
        const block& here = blocks_[static_cast<std::size_t>(pixel) / block_size];
        const std::size_t i = static_cast<std::size_t>(pixel) % block_size;
        // Most blocks of the pixels that a network reads are complete. Without an instruction for it, popcount is a function
        // call.
        if (here.bits == ~std::uint64_t{0}) return here.first_row + static_cast<std::int32_t>(i);
        const std::uint64_t bit = std::uint64_t{1} << i;
        return (here.bits & bit) == 0 ? no_pixel : here.first_row + std::popcount(here.bits & (bit - 1));
    }
    /// Calls see(first, count, row) for each run of consecutive pixels, in ascending order. `row` is the row of pixel `first`.
    template <class See>
    void for_each_run(See&& see) const {
        std::int32_t first = 0, count = 0, row = 0;  // a run that may continue in the next block
        for (std::size_t b = 0; b < blocks_.size(); ++b) {
            std::uint64_t bits = blocks_[b].bits;
            for (std::int32_t pixel = static_cast<std::int32_t>(b * block_size); bits != 0;) {
                const int skipped = std::countr_zero(bits), found = std::countr_one(bits >> skipped);
                pixel += skipped;
                if (pixel != first + count) {
                    if (count > 0) see(first, count, row);
                    row += count, first = pixel, count = 0;
                }
                count += found, pixel += found;
                bits = skipped + found < static_cast<int>(block_size) ? bits >> (skipped + found) : 0;
            }
        }
        if (count > 0) see(first, count, row);
    }
    /// Returns the pixels, ascending.
    buffer<std::int32_t> pixels() const {
        buffer<std::int32_t> result(size_, unset);
        for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t row) {
            std::iota(result.begin() + row, result.begin() + row + count, first);
        });
        return result;
    }

    friend bool operator==(const pixel_subset&, const pixel_subset&) = default;

private:
    static constexpr std::size_t block_size = 64;
    /// `block_size` pixels of the graph.
    struct block {
        std::uint64_t bits = 0;      ///< bit i: whether the subset contains the block's pixel i
        std::int32_t first_row = 0;  ///< number of the subset's pixels in the blocks before this one
        friend bool operator==(const block&, const block&) = default;
    };

    void swap(pixel_subset& other) noexcept {
        blocks_.swap(other.blocks_);
        std::swap(size_, other.size_), std::swap(pixel_count_, other.pixel_count_);
    }

    buffer<block> blocks_;
    std::size_t size_ = 0, pixel_count_ = 0;
};

namespace detail {

inline void check_graph_of(const pixel_subset& subset, std::size_t pixels) {
    if (subset.pixel_count() != pixels)
        raise(error_code::mismatch, "pixel_subset", "a subset of the plan's " + std::to_string(pixels) + " pixels",
              "a subset of " + std::to_string(subset.pixel_count()) + " pixels");
}

/// Returns the row of the first of `count` consecutive pixels. Raises mismatch unless the subset contains all of them.
inline std::int32_t row_of_run(std::int32_t first, std::int32_t count, const pixel_subset& subset) {
    const std::int32_t last = first + count - 1, row = subset.row_of(first), last_row = subset.row_of(last);
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
