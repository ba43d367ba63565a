// Elementwise operators on feature maps: addition, concatenation, activations.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

namespace detail {

template <executor Executor, class Function>
feature_map for_each_value(feature_map values, Executor& threads, Function function) {
    constexpr std::size_t grain = 4096;
    parallel_for(threads, values.values.size(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) values.values[i] = function(values.values[i]);
    });
    return values;
}

}  // namespace detail

/// a + b. Pass `std::move(a)` to reuse its memory.
///
/// b  of as many pixels and channels; it may be upsampled. Its missing pixels count as zero
template <executor Executor = const serial_executor>
feature_map add(feature_map a, const feature_view& b, Executor&& threads = {}) {
    LDI_ASSERT(b.pixels() == a.pixels() && b.channels == a.channels);
    constexpr std::size_t grain = 1024;
    parallel_for(threads, a.pixels(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const std::int32_t pixel = static_cast<std::int32_t>(i), row = b.row_of(pixel);
            if (row == no_pixel) continue;
            const float* const from = b.values_of(row);
            const std::span<float> to = a.at(pixel);
            for (std::size_t c = 0; c < b.channels; ++c) to[c] += from[c];
        }
    });
    return a;
}

/// Concatenates the channels of the maps. A single upsampled map is written out.
///
/// maps  at least one, all with the same number of pixels. A convolution reads several maps directly, which is faster
template <executor Executor = const serial_executor>
feature_map concatenate(std::initializer_list<feature_view> maps, Executor&& threads = {}) {
    LDI_ASSERT(maps.size() > 0);
    const std::span<const feature_view> sources(maps.begin(), maps.size());
    std::size_t channels = 0;
    for (const feature_view& source : sources) {
        LDI_ASSERT(source.pixels() == sources[0].pixels());
        channels += source.channels;
    }
    feature_map result(sources[0].pixels(), channels);
    constexpr std::size_t grain = 1024;
    parallel_for(threads, result.pixels(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const std::int32_t pixel = static_cast<std::int32_t>(i);
            detail::copy_pixel(sources, pixel, result.at(pixel).data());
        }
    });
    return result;
}

/// relu, leaky_relu(slope) as an operator of its own, for use after an addition; a convolution_layer has its own.
template <executor Executor = const serial_executor>
feature_map activate(feature_map x, activation by, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [by](float v) {
        return v > 0.0F ? v : by.negative_slope == 0.0F ? 0.0F : by.negative_slope * v;  // also for -infinity
    });
}

/// 1 / (1 + exp(-x)), to the rounding of the standard library.
template <executor Executor = const serial_executor>
feature_map sigmoid(feature_map x, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [](float v) { return 1.0F / (1.0F + std::exp(-v)); });
}

/// The hyperbolic tangent, to the rounding of the standard library.
template <executor Executor = const serial_executor>
feature_map tanh(feature_map x, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [](float v) { return std::tanh(v); });
}

}  // namespace ldi
