// Merges two depth estimates of one photo, computed at a small and at a large size. Coarse structures become the mean of both
// estimates; edges come from the estimate at the large size. Depth networks return consistent structures for small pictures and
// sharp edges for large ones (Miangoleh et al., Boosting Monocular Depth Estimation Models to High-Resolution via
// Content-Adaptive Multi-Resolution Merging, CVPR 2021, sections 3 and 5).
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Mirrors an image horizontally.
///
/// source  H x W x C
template <class T>
image<T> mirrored(const image<T>& source) {
    image<T> result(source.height(), source.width(), source.channels(), unset);
    for (std::size_t y = 0; y < source.height(); ++y)
        for (std::size_t x = 0; x < source.width(); ++x)
            std::copy_n(&source(y, x, 0), source.channels(), &result(y, source.width() - 1 - x, 0));
    return result;
}

/// The two neighboring source samples from which a sample of the resized row is interpolated.
struct sample_place {
    std::size_t first, second;
    float share;  ///< weight of `second`; the weight of `first` is 1 - share
};
inline sample_place place_of_sample(std::size_t i, std::size_t count, std::size_t from_count) {
    const float at = (nearest_float(i) + 0.5F) * nearest_float(from_count) / nearest_float(count) - 0.5F;
    const float inside = std::clamp(at, 0.0F, nearest_float(from_count - 1));
    const auto first = static_cast<std::size_t>(inside);
    return {first, (std::min)(first + 1, from_count - 1), inside - nearest_float(first)};
}

/// Resizes H x W x 1 by bilinear interpolation, without averaging over areas if the result is smaller.
inline image<float> interpolated(const image<float>& source, std::size_t height, std::size_t width) {
    image<float> result(height, width, 1, unset);
    const auto mean = [](float a, float b, float share) { return a + (b - a) * share; };
    for (std::size_t y = 0; y < height; ++y) {
        const sample_place row = place_of_sample(y, height, source.height());
        for (std::size_t x = 0; x < width; ++x) {
            const sample_place column = place_of_sample(x, width, source.width());
            const auto at = [&](std::size_t from) {
                return mean(source(from, column.first, 0), source(from, column.second, 0), column.share);
            };
            result(y, x, 0) = mean(at(row.first), at(row.second), row.share);
        }
    }
    return result;
}

/// Averages squares of `side` x `side` pixels. Returns H / side x W / side x 1.
///
/// source  H x W x 1; H and W are multiples of `side`
inline image<float> square_means(const image<float>& source, std::size_t side) {
    image<float> result(source.height() / side, source.width() / side);
    for (std::size_t y = 0; y < source.height(); ++y)
        for (std::size_t x = 0; x < source.width(); ++x) result(y / side, x / side, 0) += source(y, x, 0);
    for (float& sum : result) sum /= nearest_float(side * side);
    return result;
}

/// Replaces structures of `details` that are coarser than 16 pixels with the mean of both maps. Returns H x W x 1.
///
/// details  H x W x 1, H and W multiples of 16
/// layout   h x w x 1, any size, in the unit of `details`
inline image<float> with_layout(image<float> details, const image<float>& layout) {
    constexpr std::size_t coarse = 16;
    image<float> change = interpolated(layout, details.height(), details.width());
    for (std::size_t i = 0; i < change.size(); ++i) change.data()[i] = (change.data()[i] - details.data()[i]) / 2;
    change = interpolated(square_means(change, coarse), details.height(), details.width());
    for (std::size_t i = 0; i < change.size(); ++i) details.data()[i] += change.data()[i];
    return details;
}

}}}  // namespace ldi::detail
