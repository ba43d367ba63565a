// A single measure for any camera motion away from the photo's viewpoint: sideways, forward, along a path, or with a viewer's
// head. The measure is the width of the hidden surface that the motion uncovers. Surfaces behind silhouettes extend by this
// width (occlusion/expand.hpp).
//
// A surface at depth n hides another at depth f. The edge of the front surface appears at p in the photo, in pixels from the
// middle. A camera at c, which has moved forward by c_forward, sees past that edge by
//
//     (1 / n - 1 / f) * n / (n - c_forward) * |focal_length * (c_right, c_down) - c_forward * p|  pixels of the surface at f.
//
// The first factor is the step in disparity. The other factors are largest for the nearest surface, in a corner of the photo.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/core/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Returns the parallax of a camera at `position` between the nearest and the farthest surface, without the factor n / (n -
/// c_forward), as a fraction of the photo's longer side.
inline float motion_across(const std::array<float, 3>& position, const pinhole_camera& camera, const depth_range& range) {
    const float width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
    const float forward = std::abs(position[2]);
    const float right = camera.focal_length * std::abs(position[0]) + 0.5F * forward * width;
    const float down = camera.focal_length * std::abs(position[1]) + 0.5F * forward * height;
    return vector_length(right, down) * (range.inverse_depth(1) - range.inverse_depth(0)) / (std::max)(width, height);
}

}  // namespace detail

/// Returns the motion of a camera at `position` in the photo's space: the maximum parallax between the nearest and the farthest
/// surface, as a fraction of the photo's longer side. Returns infinity if the camera reaches or passes the nearest surface.
inline float motion_of(const std::array<float, 3>& position, const pinhole_camera& camera, const depth_range& range) {
    // If the camera moves back, n / (n - c_forward) is at most 1. The code then uses 1 as an upper bound.
    const float forward = (std::max)(-position[2], 0.0F);
    if (!(forward < range.z_near)) return std::numeric_limits<float>::infinity();
    return detail::motion_across(position, camera, range) * range.z_near / (range.z_near - forward);
}

/// Returns the point nearest to `position`, on the line from the photo's viewpoint to `position`, at which motion_of() is at most
/// `motion`.
inline std::array<float, 3> within_motion(const std::array<float, 3>& position, const pinhole_camera& camera,
                                          const depth_range& range, float motion) {
    if (motion_of(position, camera, range) <= motion) return position;
    if (!(motion > 0)) return {0, 0, 0};
    // Maximum motion forward, as a fraction of the distance to the nearest surface. In a flat photo, `motion` alone would not
    // limit the camera.
    constexpr float closest = 0.99F;
    const float forward = (std::max)(-position[2], 0.0F);
    if (forward > closest * range.z_near) {
        const float kept = closest * range.z_near / forward;
        return within_motion({kept * position[0], kept * position[1], kept * position[2]}, camera, range, motion);
    }
    // Solves across * k * z_near / (z_near - k * forward) = motion for k, the factor for `position`.
    const float across = detail::motion_across(position, camera, range);
    const float share = motion * range.z_near / (across * range.z_near + motion * forward);
    return {share * position[0], share * position[1], share * position[2]};
}

}}  // namespace ldi
