// Area averaging of 8-bit images in float: each pixel of the result is the mean of the source rectangle that it covers. Pixels
// are averaged horizontally, then vertically, and the mean is rounded half to even. The published depth network's inputs were
// computed in this order.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Weights along one axis: the source pixels that each result pixel covers, and the weight of each source pixel.
struct area_weights {
    struct cover {
        std::size_t first = 0;   ///< first source pixel
        std::size_t count = 0;   ///< number of source pixels
        std::size_t weight = 0;  ///< index of the first pixel's weight in `weights`
    };
    buffer<cover> covers;   ///< one per result pixel
    buffer<float> weights;  ///< the weights of each cover add up to 1
};

/// Computes the weights along one axis. Lengths are at least 1 and their product is below 2^63.
inline area_weights make_area_weights(std::size_t source_length, std::size_t result_length) {
    LDI_ASSERT(source_length > 0 && result_length > 0);
    // In units of 1 / (source_length * result_length), the borders of source and result pixels are integers.
    const std::uint64_t source = source_length, result = result_length;
    area_weights made;
    for (std::uint64_t i = 0; i < result; ++i) {
        const std::uint64_t begin = i * source, end = begin + source;
        const std::uint64_t first = begin / result, last = (end + result - 1) / result;
        made.covers.push_back({static_cast<std::size_t>(first), static_cast<std::size_t>(last - first), made.weights.size()});
        for (std::uint64_t s = first; s < last; ++s) {
            const std::uint64_t overlap =
                std::min<std::uint64_t>(end, (s + 1) * result) - std::max<std::uint64_t>(begin, s * result);
            made.weights.push_back(static_cast<float>(detail::nearest_double(overlap) / detail::nearest_double(source)));
        }
    }
    return made;
}

// A fused multiply-add would change the last bit of some sums on machines that have it. Do not compile with clang's
// -ffp-contract=fast or with any compiler's -ffast-math: these flags override this pragma.
#if defined(__clang__) && LDI_HAS_EXTENSIONS
#define LDI_NO_FUSED_MULTIPLY_ADD _Pragma("clang fp contract(off)")
#else
#define LDI_NO_FUSED_MULTIPLY_ADD
#endif
#if defined(__GNUC__) && !defined(__clang__) && LDI_HAS_EXTENSIONS
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif

namespace detail {

inline float area_share(float weight, float value) {
    LDI_NO_FUSED_MULTIPLY_ADD
#if LDI_HAS_EXTENSIONS
    return weight * value;
#else
    return rounded_product(weight, value);
#endif
}

}  // namespace detail

/// Adds the horizontally averaged `source`, times `weight`, to `sums`.
///
/// source  pixels x channels
/// sums    horizontal.covers x channels
inline void add_area_row(const area_weights& horizontal, const std::uint8_t* source, std::size_t channels, float weight,
                         float* sums) {
    LDI_NO_FUSED_MULTIPLY_ADD
    for (const area_weights::cover& cover : horizontal.covers)
        for (std::size_t c = 0; c < channels; ++c, ++sums) {
            float mean = 0;
            for (std::size_t i = 0; i < cover.count; ++i) {
                const float value = source[(cover.first + i) * channels + c];
                const float share = detail::area_share(horizontal.weights[cover.weight + i], value);
                mean += share;
            }
            const float share = detail::area_share(weight, mean);
            *sums += share;
        }
}

#if defined(__GNUC__) && !defined(__clang__) && LDI_HAS_EXTENSIONS
#pragma GCC pop_options
#endif
#undef LDI_NO_FUSED_MULTIPLY_ADD

/// Computes row y of the result.
///
/// source  H x W x C
/// sums    working memory
/// result  horizontal.covers x C
inline void area_resize_row(const area_weights& horizontal, const area_weights& vertical, std::size_t y,
                            image_view<const std::uint8_t> source, buffer<float>& sums, std::uint8_t* result) {
    const std::size_t channels = source.channels();
    sums.assign(horizontal.covers.size() * channels, 0.0F);
    const area_weights::cover& rows = vertical.covers[y];
    for (std::size_t i = 0; i < rows.count; ++i)
        add_area_row(horizontal, source.row(rows.first + i), channels, vertical.weights[rows.weight + i], sums.data());
    // Rounds half to even without calling std::lrint(): floats of 2^23 and above have no fractional bits.
    constexpr float ones = 0x1.8p23F;
    for (std::size_t i = 0; i < sums.size(); ++i)
        result[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>((sums[i] + ones) - ones));
}

/// Resizes an image by averaging over areas. In an upsampled image, each source pixel becomes a rectangle of constant color, with
/// mixed colors at its borders. Raises invalid_data if the source or the result has no pixel.
template <executor Executor = const serial_executor>
image<std::uint8_t> area_resize(image_view<const std::uint8_t> source, std::size_t result_height, std::size_t result_width,
                                Executor&& threads = {}) {
    if (source.empty() || result_height == 0 || result_width == 0)
        raise(error_code::invalid_data, "area_resize", "a source and a result with at least one pixel",
              std::to_string(source.height()) + " x " + std::to_string(source.width()) + " and " + std::to_string(result_height) +
                  " x " + std::to_string(result_width));
    image<std::uint8_t> result(result_height, result_width, source.channels(), unset);
    if (source.height() == result_height && source.width() == result_width) {
        for (std::size_t y = 0; y < result_height; ++y)
            std::copy_n(source.row(y), result_width * source.channels(), result.row(y));
        return result;
    }
    const area_weights horizontal = make_area_weights(source.width(), result_width);
    const area_weights vertical = make_area_weights(source.height(), result_height);
    parallel_for(threads, result_height, 8, [&](std::size_t first, std::size_t last) {
        buffer<float> sums;
        for (std::size_t y = first; y < last; ++y) area_resize_row(horizontal, vertical, y, source, sums, result.row(y));
    });
    return result;
}

}}  // namespace ldi
