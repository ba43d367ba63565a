// Plans several convolutions on one graph. The plans share the search for pixels with ordinary windows, which takes most of the
// planning time.
#pragma once

#include <ldi/core/graph.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/detail/regular_pixels.hpp>

#include <cstdint>
#include <optional>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Returns the same plans as plan_convolution(). Consecutive plans with the same kernel size take less time.
class convolution_planner {
public:
    /// The graph must outlive the planner.
    explicit convolution_planner(const graph& g) : g_(g), strips_(g) {}
    explicit convolution_planner(const graph&&) = delete;
    /// The same for a view of a graph. Even in release builds, raises mismatch if an invariant of `graph` does not hold.
    explicit convolution_planner(const graph_view& g) : g_(detail::checked(g)), strips_(g) {}

    /// Same parameters and errors as plan_convolution().
    convolution_plan plan(std::int32_t kernel_size) { return detail::plan_all(g_, kernel_size, regular(kernel_size)); }
    convolution_plan plan(std::int32_t kernel_size, const level_map& map) {
        return detail::plan_kept(g_, kernel_size, map, regular(kernel_size));
    }

private:
    const detail::regular_pixels& regular(std::int32_t kernel_size) {
        detail::check_kernel_size(kernel_size);
        if (!regular_ || regular_->kernel_size() != kernel_size) regular_.emplace(g_, kernel_size, strips_);
        return *regular_;
    }

    graph_view g_;
    detail::link_strips strips_;
    std::optional<detail::regular_pixels> regular_;  // for the last kernel size
};

}}  // namespace ldi
