// Pooling: each pixel of the coarser graph combines the fine pixels that collapse to it. On an image these are 2 x 2 pixels. At
// a silhouette, they are only the pixels that links connect inside the 2 x 2 group (core/coarsening.hpp), so that surfaces do
// not mix.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Applies `combine` to the fine pixels of each coarse pixel, then `finish`.
///
/// Sum      type of the combined values
/// combine  combines the values of two pixels
/// finish   maps a coarse pixel's combined value and its number of fine pixels to the result
template <class Sum, class Value, executor Executor, class Combine, class Finish>
basic_feature_map<Value> pool(const basic_feature_map<Value>& fine, const level_map& by, Executor& threads, Combine combine,
                              Finish finish) {
    if (fine.pixels() != by.parent().size())
        raise(error_code::mismatch, "pooling", std::to_string(by.parent().size()) + " pixels", std::to_string(fine.pixels()));
    const collapsed_pixels collapsed(by);
    basic_feature_map<Value> result(by.kept().size(), fine.channels, fine.zero);
    constexpr std::size_t grain = 1024;
    parallel_for(threads, result.pixels(), grain, [&](std::size_t begin, std::size_t end) {
        buffer<Sum> sums(fine.channels);
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t first = collapsed.first[i], last = collapsed.first[i + 1];
            std::copy_n(fine.at(collapsed.pixels[first]).begin(), fine.channels, sums.begin());
            for (std::size_t p = first + 1; p < last; ++p) {
                const std::span<const Value> from = fine.at(collapsed.pixels[p]);
                for (std::size_t c = 0; c < fine.channels; ++c) sums[c] = combine(sums[c], Sum{from[c]});
            }
            const std::span<Value> to = result.at(i);
            for (std::size_t c = 0; c < fine.channels; ++c) to[c] = finish(sums[c], last - first);
        }
    });
    return result;
}

}  // namespace detail

/// Returns the average over the fine pixels of each coarse pixel. Averages of bytes are rounded half up.
///
/// fine  values of type float or std::uint8_t
/// by    coarsened::map of the result of coarsen() for the graph of `fine`; raises mismatch for a graph of a different size
template <class Value, executor Executor = const serial_executor>
basic_feature_map<Value> average_pool(const basic_feature_map<Value>& fine, const level_map& by, Executor&& threads = {}) {
    if constexpr (std::same_as<Value, float>)
        return detail::pool<float>(
            fine, by, threads, [](float a, float b) { return a + b; },
            [](float sum, std::size_t count) { return sum / detail::nearest_float(count); });
    else
        return detail::pool<std::size_t>(
            fine, by, threads, [](std::size_t a, std::size_t b) { return a + b; },
            [](std::size_t sum, std::size_t count) { return static_cast<Value>((2 * sum + count) / (2 * count)); });
}

/// Returns the maximum of each channel over the fine pixels of each coarse pixel.
///
/// fine  values of type float or std::uint8_t
/// by    coarsened::map of the result of coarsen() for the graph of `fine`; raises mismatch for a graph of a different size
template <class Value, executor Executor = const serial_executor>
basic_feature_map<Value> max_pool(const basic_feature_map<Value>& fine, const level_map& by, Executor&& threads = {}) {
    return detail::pool<Value>(
        fine, by, threads, [](Value a, Value b) { return (std::max)(a, b); }, [](Value largest, std::size_t) { return largest; });
}

}}  // namespace ldi
