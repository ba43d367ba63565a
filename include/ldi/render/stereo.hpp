// Pictures made from renderings: stereo pairs and depth maps.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>
#include <ldi/render/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Moves a view by `distance`, in units of the photo's space, to the right along the horizontal axis of its picture (negative:
/// to the left). For a stereo pair, move the view by half the eye distance in each direction. Surfaces at depth `window` keep
/// their position in the picture. `window` is positive, in the same units.
inline view beside(view from, float distance, float window = std::numeric_limits<float>::infinity()) {
    LDI_ASSERT(window > 0);
    const std::array<float, 3> step = from.direction_to_photo({distance, 0, 0});
    for (std::size_t i = 0; i < 3; ++i) from.position[i] += step[i];
    from.lens_shift[0] += from.camera.focal_length * distance / window;
    return from;
}

/// Returns the eye distance, in units of the photo's space, at which the parallax between the nearest and the farthest surface
/// is a fraction `share` of the picture's width. Returns 0 if all surfaces have the same depth. The default `share`, a
/// thirtieth, is comfortable to view.
inline float eye_distance(const pinhole_camera& camera, const depth_range& range, float share = 1.0F / 30.0F) {
    const float parallax = camera.focal_length * (range.inverse_depth(1) - range.inverse_depth(0));
    return parallax > 0 ? share * detail::nearest_float(camera.width) / parallax : 0.0F;
}

namespace detail {

inline void check_pair(image_view<const std::uint8_t> left, image_view<const std::uint8_t> right) {
    if (!same_shape(left, right) || left.channels() != 3)
        raise(error_code::mismatch, "pair of pictures", "two of the same size with 3 channels",
              shape_text(left) + " and " + shape_text(right));
}

}  // namespace detail

/// Combines two pictures into one of H x 2W x 3, the left eye's picture on the left. Raises mismatch unless both have the same
/// size and 3 channels.
inline image<std::uint8_t> side_by_side(image_view<const std::uint8_t> left, image_view<const std::uint8_t> right) {
    detail::check_pair(left, right);
    const std::size_t values = 3 * left.width();
    image<std::uint8_t> result(left.height(), 2 * left.width(), 3, unset);
    for (std::size_t y = 0; y < left.height(); ++y) {
        std::copy_n(left.row(y), values, result.row(y));
        std::copy_n(right.row(y), values, result.row(y) + values);
    }
    return result;
}

/// Combines two pictures into an anaglyph for glasses with a red left lens and a cyan right lens. The red channel is the left
/// picture's brightness (Rec. 601); the green and blue channels are the right picture's. With this method, "half color", the
/// brightness of colored objects differs less between the eyes than with the left picture's own red channel. Raises mismatch
/// unless both have the same size and 3 channels.
inline image<std::uint8_t> anaglyph(image_view<const std::uint8_t> left, image_view<const std::uint8_t> right) {
    detail::check_pair(left, right);
    image<std::uint8_t> result(right);
    for (std::size_t y = 0; y < left.height(); ++y)
        for (std::size_t x = 0; x < left.width(); ++x) {
            const unsigned red = left(y, x, 0), green = left(y, x, 1), blue = left(y, x, 2);
            result(y, x, 0) = static_cast<std::uint8_t>((299 * red + 587 * green + 114 * blue + 500) / 1000);
        }
    return result;
}

/// Converts a rendering's depth to a 16-bit disparity map, H x W x 1: 65,535 (white) at the near end of the range, 1 at its far
/// end, and 0 in holes.
///
/// depth  H x W x 1, infinity in holes
///
/// Raises mismatch for another number of channels.
inline image<std::uint16_t> disparity_map(const image<float>& depth, const depth_range& range) {
    if (depth.height() > 0 && depth.width() > 0 && depth.channels() != 1)
        raise(error_code::mismatch, "disparity_map", "depth H x W x 1", detail::shape_text(depth));
    image<std::uint16_t> result(depth.height(), depth.width(), 1, unset);
    const float last = range.inverse_depth(0), span = range.inverse_depth(1) - last;
    std::transform(depth.begin(), depth.end(), result.begin(), [&](float z) {
        if (!std::isfinite(z)) return std::uint16_t{0};
        const float disparity = span > 0 ? std::clamp((1 / z - last) / span, 0.0F, 1.0F) : 0.0F;
        return static_cast<std::uint16_t>(1 + std::lround(65534 * disparity));
    });
    return result;
}

}}  // namespace ldi
