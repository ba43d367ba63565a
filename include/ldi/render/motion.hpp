// One budget for every way in which a camera leaves the place of the photo: sideways, forwards, on a path, on a head. What it
// spends is what it uncovers, and surfaces have grown behind silhouettes for just that (occlusion/expand.hpp).
//
// A thing at depth n hides what lies at depth f. Its edge is seen at p in the photo, in pixels from the middle. A camera at c,
// which has gone c_forward towards the scene, sees past that edge by
//
//     (1 / n - 1 / f) * n / (n - c_forward) * |focal_length * (c_right, c_down) - c_forward * p|     pixels of what lies at f.
//
// The first factor is the step in disparity. The others are largest for what is nearest, in a corner of the photo.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/core/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Parallax of a camera at `position` between the nearest surface and infinity, without the factor n / (n - c_forward): as a
/// share of the photo's longer side.
inline float motion_across(const std::array<float, 3>& position, const pinhole_camera& camera, const depth_range& range) {
    const float width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
    const float forward = std::abs(position[2]);
    const float right = camera.focal_length * std::abs(position[0]) + 0.5F * forward * width;
    const float down = camera.focal_length * std::abs(position[1]) + 0.5F * forward * height;
    return vector_length(right, down) * (range.inverse_depth(1) - range.inverse_depth(0)) / (std::max)(width, height);
}

}  // namespace detail

/// Share of the motion budget that a camera at `position` uses, in the photo's space: the maximum parallax between the nearest
/// and the farthest surface, as a share of the photo's longer side. Infinite beyond the nearest surface.
inline float motion_of(const std::array<float, 3>& position, const pinhole_camera& camera, const depth_range& range) {
    const float forward = (std::max)(-position[2], 0.0F);  // going back, the factor is largest for what is far, and 1
    if (!(forward < range.z_near)) return std::numeric_limits<float>::infinity();
    return detail::motion_across(position, camera, range) * range.z_near / (range.z_near - forward);
}

/// The place on the way from the photo's to `position` that is nearest to it and uses at most `motion`.
inline std::array<float, 3> within_motion(const std::array<float, 3>& position, const pinhole_camera& camera,
                                          const depth_range& range, float motion) {
    if (motion_of(position, camera, range) <= motion) return position;
    if (!(motion > 0)) return {0, 0, 0};
    constexpr float closest = 0.99F;  // of the way to what is nearest: a flat photo alone would let a camera go on
    const float forward = (std::max)(-position[2], 0.0F);
    if (forward > closest * range.z_near) {
        const float kept = closest * range.z_near / forward;
        return within_motion({kept * position[0], kept * position[1], kept * position[2]}, camera, range, motion);
    }
    // The share k of the way with across * k * z_near / (z_near - k * forward) = motion.
    const float across = detail::motion_across(position, camera, range);
    const float share = motion * range.z_near / (across * range.z_near + motion * forward);
    return {share * position[0], share * position[1], share * position[2]};
}

}}  // namespace ldi
