// Pooling: each pixel of the coarser graph combines the fine pixels that collapse to it. On an image these are 2 x 2 pixels; at a
// silhouette, only those connected inside the 2 x 2 group (core/coarsening.hpp), so that surfaces do not mix.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi::inline LDI_CONFIGURATION {

namespace detail {

/// The fine pixels that collapse to each coarse one: coarse pixel i has those from first[i] to first[i + 1], ascending.
struct collapsed_pixels {
    buffer<std::size_t> first;
    buffer<std::int32_t> pixels;

    explicit collapsed_pixels(const coarsened& by) : first(by.kept.size() + 1, 0) {
        for (const std::int32_t parent : by.parent)
            if (parent != no_pixel) ++first[parent + 1];
        for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
        pixels.resize(first.back(), unset);
        buffer<std::size_t> next(first);
        for (std::int32_t i = 0; i < by.parent.count(); ++i)
            if (by.parent[i] != no_pixel) pixels[next[by.parent[i]]++] = i;
    }
};

/// combine  combines the values of two pixels
/// finish   maps a coarse pixel's combined value and number of fine pixels to the result
template <executor Executor, class Combine, class Finish>
feature_map pool(const feature_map& fine, const coarsened& by, Executor& threads, Combine combine, Finish finish) {
    LDI_ASSERT(fine.pixels() == by.parent.size());
    const collapsed_pixels collapsed(by);
    feature_map result(by.kept.size(), fine.channels);
    constexpr std::size_t grain = 1024;
    parallel_for(threads, result.pixels(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::span<float> to = result.at(i);
            const std::size_t first = collapsed.first[i], last = collapsed.first[i + 1];
            LDI_ASSERT(last > first);
            std::copy_n(fine.at(collapsed.pixels[first]).begin(), fine.channels, to.begin());
            for (std::size_t p = first + 1; p < last; ++p) {
                const std::span<const float> from = fine.at(collapsed.pixels[p]);
                for (std::size_t c = 0; c < fine.channels; ++c) to[c] = combine(to[c], from[c]);
            }
            finish(to, last - first);
        }
    });
    return result;
}

}  // namespace detail

/// Average over the fine pixels of each coarse pixel.
///
/// by  coarsen() of the graph of `fine`
template <executor Executor = const serial_executor>
feature_map average_pool(const feature_map& fine, const coarsened& by, Executor&& threads = {}) {
    return detail::pool(
        fine, by, threads, [](float a, float b) { return a + b; },
        [](std::span<float> sums, std::size_t count) {
            for (float& value : sums) value /= detail::nearest_float(count);
        });
}

/// Maximum of each channel over the fine pixels of each coarse pixel.
///
/// by  coarsen() of the graph of `fine`
template <executor Executor = const serial_executor>
feature_map max_pool(const feature_map& fine, const coarsened& by, Executor&& threads = {}) {
    return detail::pool(
        fine, by, threads, [](float a, float b) { return (std::max)(a, b); }, [](std::span<float>, std::size_t) {});
}

}  // namespace ldi
