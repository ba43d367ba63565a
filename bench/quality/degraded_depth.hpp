// Simulates a network's depth by degrading true depth, so that the truth stays known: shrinks, blurs and shifts the depth map.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/kernels/area_resize.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ldi_quality {

struct degradation {
    std::size_t long_side = 384;  ///< the map is shrunk to this long side by area averaging, if it is larger
    double sigma = 3;             ///< standard deviation of the Gaussian blur that follows, in samples of the small map
    std::ptrdiff_t shift = 2;     ///< shift to the right and down after the blur, in samples
};

namespace detail {

/// Filters along one direction: sample i of the result is the weighted sum of the source samples that `taps(i)` lists with
/// their weights.
template <class Taps>
ldi::image<float> filtered(const ldi::image<float>& from, std::size_t length, bool across, Taps&& taps) {
    ldi::image<float> to(across ? from.height() : length, across ? length : from.width());
    for (std::size_t i = 0; i < length; ++i) {
        const auto sources = taps(i);
        for (std::size_t other = 0; other < (across ? from.height() : from.width()); ++other) {
            double sum = 0;
            for (const auto& [source, weight] : sources)
                sum += weight * static_cast<double>(across ? from(other, source, 0) : from(source, other, 0));
            (across ? to(other, i, 0) : to(i, other, 0)) = static_cast<float>(sum);
        }
    }
    return to;
}

struct tap {
    std::size_t source;
    double weight;
};

inline ldi::image<float> shrunk(const ldi::image<float>& from, std::size_t length, bool across) {
    const ldi::area_weights weights = ldi::make_area_weights(across ? from.width() : from.height(), length);
    return filtered(from, length, across, [&](std::size_t i) {
        const ldi::area_weights::cover cover = weights.covers[i];
        std::vector<tap> taps;
        for (std::size_t k = 0; k < cover.count; ++k)
            taps.push_back({cover.first + k, static_cast<double>(weights.weights[cover.weight + k])});
        return taps;
    });
}

/// Blurs with a kernel that extends to three sigmas, and shifts: sample i of the result averages the samples around i - shift.
/// Repeats the border.
inline ldi::image<float> blurred_and_moved(const ldi::image<float>& from, double sigma, std::ptrdiff_t shift, bool across) {
    const std::size_t length = across ? from.width() : from.height();
    const std::ptrdiff_t reach = static_cast<std::ptrdiff_t>(std::ceil(3 * sigma));
    const auto weight = [&](std::ptrdiff_t k) {
        return sigma > 0 ? std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma)) : 1.0;
    };
    double sum = 0;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) sum += weight(k);
    return filtered(from, length, across, [&](std::size_t i) {
        std::vector<tap> taps;
        for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) - shift + k, last = static_cast<std::ptrdiff_t>(length) - 1;
            taps.push_back({static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(at, 0, last)), weight(k) / sum});
        }
        return taps;
    });
}

}  // namespace detail

/// Degrades a map.
///
/// inverse_depth  H x W x 1; the longer side of the result is at most `long_side`
inline ldi::image<float> degraded(const ldi::image<float>& inverse_depth, const degradation& how = {}) {
    const std::size_t rows = inverse_depth.height(), columns = inverse_depth.width(), longer = std::max(rows, columns);
    const std::size_t longest = std::min(longer, how.long_side);
    const auto scaled = [&](std::size_t length) { return std::max<std::size_t>((length * longest + longer / 2) / longer, 1); };
    ldi::image<float> result = detail::shrunk(detail::shrunk(inverse_depth, scaled(columns), true), scaled(rows), false);
    for (const bool across : {true, false}) result = detail::blurred_and_moved(result, how.sigma, how.shift, across);
    return result;
}

}  // namespace ldi_quality
