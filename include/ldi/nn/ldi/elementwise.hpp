// Elementwise operators on feature maps: addition, concatenation, activations, conversion between floats and bytes.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/four_floats.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <string>
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

/// Sets to[i] = function(from[i]).
template <class From, class To, executor Executor, class Function>
void convert_values(const basic_feature_map<From>& from, basic_feature_map<To>& to, Executor& threads, Function function) {
    constexpr std::size_t grain = 4096;
    parallel_for(threads, to.values.size(), grain, [&](std::size_t first, std::size_t last) {
        std::transform(from.values.begin() + first, from.values.begin() + last, to.values.begin() + first, function);
    });
}

/// Raises invalid_option unless the scale is above 0 and below 2^120.
inline void check_scale(const char* where, float scale) {
    if (!(scale > 0.0F && scale < 0x1p120F))
        raise(error_code::invalid_option, where, "a scale above 0 and below 2^120", to_text(scale));
}

// quantized() compares and selects bits instead of floats, so that loops that call it have no branches and GCC vectorizes them.
inline constexpr std::uint32_t sign_bit = 0x80000000U, infinity_bits = 0x7F800000U;

template <class Value>
void check_same_shape(const char* where, const basic_feature_view<Value>& a, const basic_feature_view<Value>& b) {
    check_rows(where, a), check_rows(where, b);
    if (b.pixels() != a.pixels() || b.channels != a.channels)
        raise(error_code::mismatch, where, std::to_string(a.pixels()) + " pixels of " + std::to_string(a.channels) + " channels",
              std::to_string(b.pixels()) + " pixels of " + std::to_string(b.channels) + " channels");
}

/// Returns the byte to which quantize() converts a value.
///
/// max_size  bits of the float 256 * scale; larger magnitudes are clamped to this float
inline std::uint8_t quantized(float value, double scale, std::uint32_t max_size, std::int32_t zero_point) {
    const std::uint32_t bits = bits_of(value), positive = bits & ~sign_bit;
    const std::uint32_t known = positive > infinity_bits ? 0U : positive;  // 0 for NaN
    const std::uint32_t size = (std::min)(known, max_size);
    // Rounds halves away from zero. If the quotient is below n + 0.5 for an integer n, adding 0.5 never rounds up to n + 1: the
    // quotient of two floats either equals n + 0.5 or differs from it by more than the rounding error of a double.
    const auto steps = static_cast<std::int32_t>(double{float_of(size)} / scale + 0.5);
    const std::int32_t result = zero_point + ((bits & sign_bit) != 0U ? -steps : steps);
    return static_cast<std::uint8_t>((std::min)((std::max)(result, 0), 255));
}

/// Returns tanh(x) within 2 units in the last place. The polynomials are from Cephes (Stephen Moshier). They approximate tanh
/// near 0, and exp(2 |x|) elsewhere.
inline lanes::four_floats hyperbolic_tangent(lanes::four_floats x) noexcept {
    using namespace lanes;
    const four_floats zero{}, limit = zero + 9.5F, size = larger(x, -x);
    const four_floats magnitude = select(size > limit, limit, size);  // tanh(9.5) rounds to 1; NaN stays
    const four_floats square = magnitude * magnitude, twice = magnitude + magnitude;
    const auto product = [](four_floats a, four_floats b) noexcept { return rounded_product(a, b); };
    four_floats near_zero = product(zero - 5.70498872745e-3F, square) + 2.06390887954e-2F;
    for (const float coefficient : {-5.37397155531e-2F, 1.33314422036e-1F, -3.33332819422e-1F})
        near_zero = product(near_zero, square) + coefficient;
    near_zero = product(near_zero * square, magnitude) + magnitude;

    constexpr float round = 12582912.0F;  // 1.5 * 2^23: adding it puts the nearest integer into the lowest bits
    const four_floats shifted = product(twice, zero + 1.44269504089F) + round, power = shifted - round;
    const four_floats r = (twice - product(power, zero + 0.693359375F)) + product(power, zero + 2.12194440e-4F);
    four_floats exponential = product(zero + 1.9875691500e-4F, r) + 1.3981999507e-3F;
    for (const float coefficient : {8.3334519073e-3F, 4.1665795894e-2F, 1.6666665459e-1F, 5.0000001201e-1F})
        exponential = product(exponential, r) + coefficient;
    exponential = product(exponential, r * r) + r + 1.0F;
    std::array<std::uint32_t, wide> bits;
    std::memcpy(bits.data(), &shifted, sizeof shifted);
    for (std::uint32_t& b : bits) b = (b + 127U) << 23;  // 2^power
    four_floats scale;
    std::memcpy(&scale, bits.data(), sizeof scale);
    const four_floats beyond = 1.0F - 2.0F / (product(exponential, scale) + 1.0F);
    const four_floats result = select(magnitude < zero + 0.625F, near_zero, beyond);
    return select(x < zero, -result, select(x > zero, result, x));  // zeros keep their sign
}

}  // namespace detail

/// Returns a + b. Pass `std::move(a)` to reuse its memory.
///
/// b  map with the same numbers of pixels and channels as `a`, else raises mismatch. It may be an upsampled view, in which
///    pixels without a parent are zero
template <executor Executor = const serial_executor>
feature_map add(feature_map a, const feature_view& b, Executor&& threads = {}) {
    detail::check_same_shape<float>("add", a, b);
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
/// b    as in add() for floats
/// sum  result of prepare_add_u8() (kernels/add_u8.hpp) for the quantizations of a, b and the sum. Raises mismatch if the zero
///      points of the maps disagree with `exact.bias` of this result
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> add(basic_feature_map<std::uint8_t> a, const basic_feature_view<std::uint8_t>& b,
                                    const add_u8_constants& sum, Executor&& threads = {}) {
    detail::check_same_shape<std::uint8_t>("add", a, b);
    if (sum->exact.bias != -(sum->exact.a_multiplier * a.zero + sum->exact.b_multiplier * b.zero))
        raise(error_code::mismatch, "add", "maps with the zero points of the addition",
              "zero points " + std::to_string(a.zero) + " and " + std::to_string(b.zero));
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
    a.zero = static_cast<std::uint8_t>(sum->exact.zero_point);
    return a;
}

namespace detail {

template <class Value, executor Executor>
basic_feature_map<Value> concatenate(std::span<const basic_feature_view<Value>> sources, Executor& threads) {
    if (sources.empty()) raise(error_code::mismatch, "concatenate", "at least one map", "none");
    std::size_t channels = 0;
    for (const auto& source : sources) {
        check_rows("concatenate", source);
        if (source.zero != sources[0].zero)
            raise(error_code::mismatch, "concatenate", "zero point " + std::to_string(sources[0].zero) + " in all maps",
                  std::to_string(source.zero));
        if (source.pixels() != sources[0].pixels())
            raise(error_code::mismatch, "concatenate", std::to_string(sources[0].pixels()) + " pixels",
                  std::to_string(source.pixels()));
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

/// Concatenates the channels of the maps. Called with a single upsampled map, returns a full-size copy of it. Convolutions can
/// read several maps directly, which is faster.
///
/// maps  at least one, all with the same number of pixels and the same zero point, else raises mismatch; maps of bytes must share
///       one quantization
template <executor Executor = const serial_executor>
feature_map concatenate(std::initializer_list<feature_view> maps, Executor&& threads = {}) {
    return detail::concatenate(std::span<const feature_view>(maps.begin(), maps.size()), threads);
}
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> concatenate(std::initializer_list<basic_feature_view<std::uint8_t>> maps,
                                            Executor&& threads = {}) {
    return detail::concatenate(std::span<const basic_feature_view<std::uint8_t>>(maps.begin(), maps.size()), threads);
}

/// Applies relu or leaky_relu(slope), for example after an addition; a convolution_layer has its own activation. NaN remains NaN.
template <executor Executor = const serial_executor>
feature_map activate(feature_map x, activation by, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [by](float v) {
        if (v > 0.0F || std::isnan(v)) return v;
        return by.negative_slope == 0.0F ? 0.0F : by.negative_slope * v;  // avoids 0 * -infinity
    });
}

/// Applies relu to a map of bytes: values below the zero point become the zero point. Raises unsupported for any other
/// activation.
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> activate(basic_feature_map<std::uint8_t> x, activation by, Executor&& threads = {}) {
    if (by.negative_slope != 0.0F)
        raise(error_code::unsupported, "activate", "relu for a map of bytes",
              "a negative slope of " + detail::to_text(by.negative_slope));
    const std::uint8_t zero = x.zero;
    return detail::for_each_value(std::move(x), threads, [zero](std::uint8_t v) { return (std::max)(v, zero); });
}

/// Converts a map to bytes. Divides each value by `to.scale`, rounds to the nearest integer (halves away from zero), adds the
/// zero point, and clamps to 0..255. NaN becomes the zero point. Raises invalid_option unless the scale is above 0 and below
/// 2^120.
template <executor Executor = const serial_executor>
basic_feature_map<std::uint8_t> quantize(const feature_map& x, const quantization& to, Executor&& threads = {}) {
    detail::check_rows<float>("quantize", x);
    detail::check_scale("quantize", to.scale);
    basic_feature_map<std::uint8_t> result(x.pixels(), x.channels, to.zero_point);
    const double scale = double{to.scale};
    const std::uint32_t max_size = detail::bits_of(256.0F * to.scale);
    const std::int32_t zero_point = to.zero_point;
    detail::convert_values(x, result, threads, [=](float v) { return detail::quantized(v, scale, max_size, zero_point); });
    return result;
}

/// Converts a map of bytes to floats. Raises invalid_option unless the scale is above 0 and below 2^120.
///
/// from  the quantization of the map; x.zero is not read
template <executor Executor = const serial_executor>
feature_map dequantize(const basic_feature_map<std::uint8_t>& x, const quantization& from, Executor&& threads = {}) {
    detail::check_rows<std::uint8_t>("dequantize", x);
    detail::check_scale("dequantize", from.scale);
    feature_map result(x.pixels(), x.channels);
    detail::convert_values(x, result, threads,
                           [=](std::uint8_t v) { return static_cast<float>(v - from.zero_point) * from.scale; });
    return result;
}

/// Computes 1 / (1 + exp(-x)). The last bits depend on the standard library's std::exp().
template <executor Executor = const serial_executor>
feature_map sigmoid(feature_map x, Executor&& threads = {}) {
    return detail::for_each_value(std::move(x), threads, [](float v) { return 1.0F / (1.0F + std::exp(-v)); });
}

/// Computes the hyperbolic tangent within 2 units in the last place, with the same operations on every machine.
template <executor Executor = const serial_executor>
feature_map tanh(feature_map x, Executor&& threads = {}) {
    constexpr std::size_t grain = 4096;
    parallel_for(threads, x.values.size(), grain, [&](std::size_t first, std::size_t last) {
        using namespace detail::lanes;
        float* const values = x.values.data();
        for (; first + wide <= last; first += wide) store(values + first, detail::hyperbolic_tangent(load(values + first)));
        for (; first < last; ++first) values[first] = detail::hyperbolic_tangent(four_floats{} + values[first])[0];
    });
    return x;
}

}}  // namespace ldi
