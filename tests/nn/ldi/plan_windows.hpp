// Lists the windows of a plan, for comparison with a reference.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ldi::testing {

/// Returns the windows of all outputs of a plan; empty for outputs outside the plan.
inline std::vector<buffer<std::int32_t>> windows_of(const convolution_plan& plan) {
    std::vector<buffer<std::int32_t>> windows(plan.output_count());
    const std::size_t k = static_cast<std::size_t>(plan.kernel_size());
    const auto add = [&](std::int32_t output, buffer<std::int32_t> window) {
        buffer<std::int32_t>& there = windows.at(static_cast<std::size_t>(output));
        REQUIRE(there.empty());  // nothing is computed twice
        there = std::move(window);
    };
    for (std::size_t s = 0; s < plan.segments().size(); ++s) {
        if (s > 0) REQUIRE(plan.segments()[s].first >= plan.segments()[s - 1].first + plan.segments()[s - 1].count);
        for (std::int32_t i = 0; i < plan.segments()[s].count; ++i) {
            buffer<std::int32_t> window;
            for (std::size_t r = 0; r < k; ++r)
                for (std::int32_t x = 0; x < plan.kernel_size(); ++x)
                    window.push_back(plan.rows_of(s)[r] + plan.stride() * i + x - plan.kernel_size() / 2);
            add(plan.segments()[s].first + i, std::move(window));
        }
    }
    REQUIRE(std::is_sorted(plan.irregular().begin(), plan.irregular().end()));
    REQUIRE(plan.windows().size() == plan.irregular().size() * plan.elements());
    for (std::size_t i = 0; i < plan.irregular().size(); ++i) {
        const auto window = plan.windows().begin() + i * plan.elements();
        add(plan.irregular()[i], buffer<std::int32_t>(window, window + plan.elements()));
    }
    return windows;
}

}  // namespace ldi::testing
