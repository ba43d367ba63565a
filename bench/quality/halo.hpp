// Color error beside silhouettes in a novel view: pale rims, and colors of one surface on the other.
#pragma once

#include "metrics.hpp"
#include "subjects.hpp"
#include "true_silhouettes.hpp"

#include <ldi/render/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ldi_quality {

struct halo_options {
    double width = 6;  ///< width of the band in pixels, half of it on either side of the silhouette
    /// A surface hides a silhouette if it is nearer by more than this, in disparity from 0 to 1.
    float min_cover = 0.02F;
};

namespace detail {

/// Projects the photo's pixel (x, y) at this inverse depth to the other view, in pixels.
inline std::array<float, 2> seen_from_other(const subject& s, float x, float y, float inverse_depth) {
    return s.other.camera.project(s.other.to_camera(s.camera.unproject(x, y, 1 / inverse_depth)));
}

/// Inverse depth of the nearest photo pixel in each pixel of the other view; 0 if there is none.
inline ldi::image<float> nearest_in_other(const subject& s) {
    ldi::image<float> result(s.seen.height(), s.seen.width(), 1, 0.0F);
    for (std::size_t y = 0; y < s.photo.height(); ++y)
        for (std::size_t x = 0; x < s.photo.width(); ++x) {
            const float d = s.inverse_depth(y, x);
            const auto [u, v] = seen_from_other(s, static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, d);
            if (u < 0 || v < 0 || u >= static_cast<float>(result.width()) || v >= static_cast<float>(result.height())) continue;
            float& nearest = result(static_cast<std::size_t>(v), static_cast<std::size_t>(u));
            nearest = std::max(nearest, d);
        }
    return result;
}

}  // namespace detail

/// Marks the band around the true silhouettes that are visible in the other view: pixels whose centers are at most half the
/// band's width from the middle of a side. A silhouette moves with its near surface.
inline mask silhouette_band(const subject& s, const std::vector<true_side>& truth, const halo_options& options = {}) {
    const ldi::image<float> nearest = detail::nearest_in_other(s);
    const auto [least, most] = std::minmax_element(s.inverse_depth.begin(), s.inverse_depth.end());
    const float cover = options.min_cover * (*most - *least);
    const float reach = static_cast<float>(options.width / 2);
    mask band(s.seen.height(), s.seen.width(), 1, std::uint8_t{0});
    const auto is_inside = [&](float u, float v) {
        return u >= 0 && v >= 0 && u < static_cast<float>(band.width()) && v < static_cast<float>(band.height());
    };
    for (const true_side& side : truth) {
        const float d = s.inverse_depth(side.near_y, side.near_x);
        const auto [u, v] =
            detail::seen_from_other(s, static_cast<float>(side.near_x) + 0.5F, static_cast<float>(side.near_y) + 0.5F, d);
        if (!is_inside(u, v) || nearest(static_cast<std::size_t>(v), static_cast<std::size_t>(u)) > d + cover) continue;
        const side_middle middle = side.middle();
        const auto [at_x, at_y] =
            detail::seen_from_other(s, static_cast<float>(middle.x) / 2, static_cast<float>(middle.y) / 2, d);
        for (float y = std::floor(at_y - reach); y <= at_y + reach; ++y)
            for (float x = std::floor(at_x - reach); x <= at_x + reach; ++x)
                if (is_inside(x, y) && std::hypot(x + 0.5F - at_x, y + 0.5F - at_y) <= reach)
                    band(static_cast<std::size_t>(y), static_cast<std::size_t>(x)) = 1;
    }
    return band;
}

/// Mean absolute difference of color over the pixels of a mask, 0 to 255; 0 if the mask is empty.
inline double color_error(const picture& a, const picture& b, const mask& where) {
    return mean_where(xt::abs(xt::cast<double>(ldi::as_tensor(a)) - xt::cast<double>(ldi::as_tensor(b))), where, 0);
}

}  // namespace ldi_quality
