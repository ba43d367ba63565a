// Elementwise operators on feature maps: addition, concatenation, activations, conversion between floats and bytes.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

template <class Value, executor Executor, class Function>
basic_feature_map<Value> for_each_value(basic_feature_map<Value> values, Executor& threads, Function function) {
    constexpr std::size_t grain = 4096;
    parallel_for(threads, values.values.size(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) values.values[i] = function(values.values[i]);
    });
    return values;
}

}  // namespace detail

/// Returns a + b. Pass `std::move(a)` to reuse its memory.
///
/// b  as many pixels and channels as `a`; may be upsampled. Its missing pixels count as zero
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

/// Returns a + b for maps of bytes, each in its own quantization.
///
/// sum  result of prepare_add_u8() (kernels/add_u8.hpp) for the quantizations of a, b and the sum
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> add(basic_feature_map<std::uint8_t> a, const basic_feature_view<std::uint8_t>& b,
                                    const add_u8_constants& sum, Executor&& threads = {}) {
    LDI_ASSERT(b.pixels() == a.pixels() && b.channels == a.channels);
    constexpr std::size_t grain = 1024;
    const buffer<std::uint8_t> missing(b.channels, b.zero);
    parallel_for(threads, a.pixels(), grain, [&](std::size_t first, std::size_t last) {
        std::uint8_t* to = a.values.data() + first * a.channels;
        if (b.rows.empty() && b.mask.empty()) {
            add_u8(sum, to, b.values.data() + first * b.channels, (last - first) * a.channels, to);
            return;
        }
        for (std::size_t i = first; i < last; ++i, to += a.channels) {
            const std::int32_t row = b.row_of(static_cast<std::int32_t>(i));
            add_u8(sum, to, row == no_pixel ? missing.data() : b.values_of(row), a.channels, to);
        }
    });
    a.zero = static_cast<std::uint8_t>(sum.exact.zero_point);
    return a;
}

namespace detail {

template <class Value, executor Executor>
basic_feature_map<Value> concatenate(std::span<const basic_feature_view<Value>> sources, Executor& threads) {
    LDI_ASSERT(!sources.empty());
    std::size_t channels = 0;
    for (const auto& source : sources) {
        LDI_ASSERT(source.pixels() == sources[0].pixels() && source.zero == sources[0].zero);
        channels += source.channels;
    }
    basic_feature_map<Value> result(sources[0].pixels(), channels, sources[0].zero);
    constexpr std::size_t grain = 1024;
    parallel_for(threads, result.pixels(), grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const std::int32_t pixel = static_cast<std::int32_t>(i);
            copy_pixel(sources, pixel, result.at(pixel).data());
        }
    });
    return result;
}

}  // namespace detail

/// Concatenates the channels of the maps. With a single upsampled map, stores it at full size. Convolutions can read several
/// maps directly, which is faster.
///
/// maps  at least one, all with the same number of pixels; maps of bytes must share one quantization
template <executor Executor = const serial_executor>
feature_map concatenate(std::initializer_list<feature_view> maps, Executor&& threads = {}) {
    return detail::concatenate(std::span<const feature_view>(maps.begin(), maps.size()), threads);
}
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> concatenate(std::initializer_list<basic_feature_view<std::uint8_t>> maps,
                                            Executor&& threads = {}) {
    return detail::concatenate(std::span<const basic_feature_view<std::uint8_t>>(maps.begin(), maps.size()), threads);
}

/// Applies relu or leaky_relu(slope), for example after an addition; a convolution_layer has its own activation.
template <executor Executor = const serial_executor>
feature_map activate(feature_map x, activation by, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [by](float v) {
        return v > 0.0F ? v : by.negative_slope == 0.0F ? 0.0F : by.negative_slope * v;  // avoids 0 * -infinity
    });
}

/// Applies relu to a map of bytes: raises values to at least the zero point. Bytes support no other activation.
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> activate(basic_feature_map<std::uint8_t> x, [[maybe_unused]] activation by,
                                         Executor&& threads = {}) {
    LDI_ASSERT(by.negative_slope == 0.0F);
    const std::uint8_t zero = x.zero;
    return detail::for_each_value(std::move(x), threads, [zero](std::uint8_t v) { return (std::max)(v, zero); });
}

/// Converts a map to bytes: the nearest multiples of `to.scale`, clamped to the range of bytes. NaN becomes the zero point.
inline basic_feature_map<std::uint8_t> quantize(const feature_map& x, const quantization& to) {
    basic_feature_map<std::uint8_t> result(x.pixels(), x.channels, to.zero_point);
    std::transform(x.values.begin(), x.values.end(), result.values.begin(), [&](float v) {
        const double steps = std::isnan(v) ? 0.0 : std::clamp(double{v} / double{to.scale}, -255.0, 255.0);
        return static_cast<std::uint8_t>(std::clamp<std::int64_t>(detail::nearest_whole(steps) + to.zero_point, 0, 255));
    });
    return result;
}

/// Converts a map of bytes to floats.
inline feature_map dequantize(const basic_feature_map<std::uint8_t>& x, const quantization& from) {
    feature_map result(x.pixels(), x.channels);
    std::transform(x.values.begin(), x.values.end(), result.values.begin(),
                   [&](std::uint8_t v) { return static_cast<float>(v - from.zero_point) * from.scale; });
    return result;
}

/// Computes 1 / (1 + exp(-x)). The last bits depend on the standard library's std::exp().
template <executor Executor = const serial_executor>
feature_map sigmoid(feature_map x, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [](float v) { return 1.0F / (1.0F + std::exp(-v)); });
}

/// Computes the hyperbolic tangent. The last bits depend on the standard library's std::tanh().
template <executor Executor = const serial_executor>
feature_map tanh(feature_map x, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [](float v) { return std::tanh(v); });
}

}}  // namespace ldi
