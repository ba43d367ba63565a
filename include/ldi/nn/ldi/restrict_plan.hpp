// Restricts the plan of a convolution to some of its outputs, so that the convolution computes only these, and lists the pixels
// that a plan reads. Networks use both functions to compute, layer by layer, only the values on which the requested pixels
// depend.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Restricts a plan to some outputs, and renumbers them.
///
/// for_each_run  for_each_run(see) calls see(first, count, row) for each run of consecutive outputs: first, first + 1, ...
///               `row` is the number of outputs in all previous runs
/// number        number(output, row) returns the new number of an output, which is the output number `row` of all runs
template <class ForEachRun, class Number>
plan_parts restrict_and_number(const convolution_plan& plan, ForEachRun&& for_each_run, Number&& number) {
    plan_parts result;
    result.kernel_size = plan.kernel_size(), result.stride = plan.stride();
    result.input_count = plan.input_count(), result.output_count = plan.output_count();
    const array_view<const plan_segment> segments = plan.segments();
    const array_view<const std::int32_t> all_irregular = plan.irregular();
    std::int32_t next = 0;
    const auto refuse = [](std::int32_t output) {
        raise(error_code::mismatch, "restrict_to", "ascending outputs of the plan",
              "an output out of order or not in the plan: " + std::to_string(output));
    };
    std::size_t s = 0, irregular = 0;
    for_each_run([&](std::int32_t first, std::int32_t run_count, std::int32_t row) {
        if (first < next || static_cast<std::size_t>(first) >= plan.output_count()) refuse(first);
        next = first + run_count;
        for (std::int32_t output = first; output < next;) {
            const std::int32_t to = number(output, row + output - first);
            while (s < segments.size() && segments[s].first + segments[s].count <= output) ++s;
            if (s == segments.size() || segments[s].first > output) {
                while (irregular < all_irregular.size() && all_irregular[irregular] < output) ++irregular;
                if (irregular == all_irregular.size() || all_irregular[irregular] != output) refuse(output);
                result.irregular.push_back(to);
                const std::span<const std::int32_t> window = plan.window_of(irregular);
                result.windows.append(window.begin(), window.end());
                ++output;
                continue;
            }
            const plan_segment from = segments[s];
            const std::int32_t count = (std::min)(next, from.first + from.count) - output;
            const std::int32_t shift = result.stride * (output - from.first);
            const std::span<const std::int32_t> rows = plan.rows_of(s);
            if (count >= min_segment)
                add_segment(result, {to, count}, rows, shift);
            else
                for (std::int32_t o = 0; o < count; ++o) {
                    result.irregular.push_back(to + o);
                    for (const std::int32_t r : rows)
                        for (std::int32_t x = 0; x < result.kernel_size; ++x)
                            result.windows.push_back(r + shift + result.stride * o + x - result.kernel_size / 2);
                }
            output += count;
        }
    });
    return result;
}

/// Returns the runs of ascending outputs, for restrict_and_number().
inline auto runs_of_outputs(std::span<const std::int32_t> outputs) {
    return [outputs](auto&& see) {
        for (std::size_t i = 0, last = 0; i < outputs.size(); i = last) {
            for (last = i + 1; last < outputs.size() && outputs[last] == std::int64_t{outputs[last - 1]} + 1;) ++last;
            see(outputs[i], static_cast<std::int32_t>(last - i), static_cast<std::int32_t>(i));
        }
    };
}

}  // namespace detail

/// Returns the plan restricted to some outputs.
///
/// outputs  ascending outputs of the plan; raises mismatch for others
inline convolution_plan restrict_to(const convolution_plan& plan, std::span<const std::int32_t> outputs) {
    return detail::plan_of(detail::restrict_and_number(plan, detail::runs_of_outputs(outputs),
                                                       [](std::int32_t output, std::int32_t) { return output; }));
}
/// The same for a subset of the plan's outputs. Raises mismatch if the subset belongs to a graph with a different number of
/// pixels, or contains a pixel that is not an output of the plan.
inline convolution_plan restrict_to(const convolution_plan& plan, const pixel_subset& outputs) {
    detail::check_graph_of(outputs, plan.output_count());
    return detail::plan_of(detail::restrict_and_number(
        plan, [&](auto&& see) { outputs.for_each_run(see); }, [](std::int32_t output, std::int32_t) { return output; }));
}

/// Restricts a plan to some outputs and renumbers them: outputs[i] becomes output i.
///
/// outputs  as in restrict_to()
inline convolution_plan restrict_and_renumber(const convolution_plan& plan, std::span<const std::int32_t> outputs) {
    detail::plan_parts result =
        detail::restrict_and_number(plan, detail::runs_of_outputs(outputs), [](std::int32_t, std::int32_t row) { return row; });
    result.output_count = outputs.size();
    return detail::plan_of(std::move(result));
}

/// Marks all pixels that the plan's outputs read.
///
/// marks  plan.input_count(); the function sets marks to 1 and clears none
inline void mark_needed_inputs(const convolution_plan& plan, std::span<std::uint8_t> marks) {
    LDI_ASSERT(marks.size() == plan.input_count());
    for (std::size_t s = 0; s < plan.segments().size(); ++s)
        for (const std::int32_t row : plan.rows_of(s)) {
            std::uint8_t* const first = marks.data() + (row - plan.kernel_size() / 2);
            const std::int32_t count = plan.stride() * (plan.segments()[s].count - 1) + plan.kernel_size();
            // Windows of a segment overlap or touch, except 1 x 1 windows with stride 2.
            if (plan.kernel_size() > 1 || plan.stride() == 1)
                std::fill_n(first, count, std::uint8_t{1});
            else
                for (std::int32_t i = 0; i < count; i += 2) first[i] = 1;
        }
    for (const std::int32_t pixel : plan.windows())
        if (pixel != no_pixel) marks[static_cast<std::size_t>(pixel)] = 1;
}

/// Lists all pixels that the plan's outputs read, ascending.
inline buffer<std::int32_t> needed_inputs(const convolution_plan& plan) {
    buffer<std::uint8_t> marks(plan.input_count(), 0);
    mark_needed_inputs(plan, marks);
    buffer<std::int32_t> pixels;
    for (std::int32_t i = 0; i < marks.count(); ++i)
        if (marks[i] != 0) pixels.push_back(i);
    return pixels;
}

}}  // namespace ldi
