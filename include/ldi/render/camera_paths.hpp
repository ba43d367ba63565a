// Camera paths that show a photo's depth (paper, section "Viewing 3D Photos"). Each predefined path keeps one point in the middle
// of the picture: the point in the middle of the photo at the depth in focus. Nearer and farther surfaces move relative to it.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/motion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The predefined paths of view_on_path().
enum class camera_path : std::uint8_t {
    circle,      ///< around the photo's viewpoint, parallel to its image plane, clockwise from the right; ends where it starts
    swing,       ///< from the photo's viewpoint to the right, to the left and back
    zoom_in,     ///< from the photo's viewpoint toward the scene
    dolly_zoom,  ///< toward the scene while the lens widens, so that surfaces in focus keep their size
};

/// The defaults were chosen by eye: enough motion to show depth, but not so much that the area beyond the photo's border becomes
/// visible.
struct path_options {
    /// Maximum motion of the camera, in [0, 1] (render/motion.hpp). Hidden surfaces extend only as far as
    /// expand_options::motion uncovers them, so a larger motion shows gaps.
    float motion = 0.08F;
    /// Disparity, in [0, 1], of the surfaces that stay in place on screen.
    float focus_disparity = window_disparity;
    /// zoom_in and dolly_zoom: distance that the camera travels, as a fraction of the distance to the nearest surface, in [0,
    /// 1). `motion` may limit this distance further.
    float approach = 0.3F;
};

/// Returns a camera at `position` that looks at `target`, both in the photo's space. The photo's y axis points up in the
/// picture. The line between the points must not be vertical, which an assertion checks. Without assertions, the rotation of
/// such a view is not finite, and rasterize() raises an error for the view.
view look_at(const pinhole_camera& camera, const std::array<float, 3>& position, const std::array<float, 3>& target);

/// Returns the view from `position` through a window: the rectangle that the photo covers at disparity `window`. The window fills
/// the picture. The camera does not turn, so the window remains a rectangle. The position must be in front of the window.
view view_through_window(const pinhole_camera& camera, const depth_range& range, const std::array<float, 3>& position,
                         float window = window_disparity);

/// Returns the view at `time`, 0 to 1, on a path, which starts at time 0 and ends at time 1. Raises invalid_option for options
/// out of range.
view view_on_path(camera_path path, const pinhole_camera& camera, const depth_range& range, float time,
                  const path_options& options = {});

/// A point of a custom path.
struct key_frame {
    float time = 0;                          ///< must increase from each key frame to the next
    std::array<float, 3> position{0, 0, 0};  ///< position of the camera in the photo's space (core/camera.hpp)
    std::array<float, 3> target{0, 0, -1};   ///< point that the camera looks at
    float zoom = 1;                          ///< factor by which the photo's focal length is multiplied, above 0, finite
};

/// Returns the view at `time` on a smooth path through all key frames: a cubic spline whose slope at each key frame is the
/// slope of the line between the neighboring key frames (Catmull-Rom). Before the first and after the last key frame, the
/// camera stays still. Raises invalid_option if there is no key frame, times do not increase, a zoom is not above 0, a number
/// is not finite, or the camera would look straight up or down at `time`, or at its own position. Positions and targets are
/// interpolated separately, so this can happen between two key frames even if it happens at neither of them. The result may lie
/// outside the motion budget; callers clamp it with within_motion().
view view_between(std::span<const key_frame> keys, const pinhole_camera& camera, float time);

/// Computes a frame that hides the outer edge of the photo's surfaces: the largest centered part of the picture, with the same
/// aspect ratio, in which no view sees past this edge, for any disparity from 0 to 1. Returns the frame's size relative to the
/// picture, in [0, 1].
///
/// past_border  motion for which surfaces continue past the photo's border (occlusion/past_frame.hpp); 0 if they end there
float frame_within(std::span<const view> views, const pinhole_camera& camera, const depth_range& range, float past_border = 0);

/// Zooms in on the middle of a view's picture, without changing the number of pixels. `size`, above 0, is the width of the part
/// that fills the new picture, relative to the old picture's width, for example the result of frame_within().
inline view framed(view from, float size) {
    LDI_ASSERT(size > 0);
    from.camera.focal_length /= size;
    for (float& shift : from.lens_shift) shift /= size;
    return from;
}

// ------------------------------------------------------------------------------------------------------------------------

namespace detail {

using point3 = std::array<double, 3>;

inline point3 normalized(const point3& p) {
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    return {p[0] / length, p[1] / length, p[2] / length};
}

inline point3 cross(const point3& a, const point3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Returns the maximum distance, up to `max_reach`, that a camera may move in a direction.
inline float reach_within_motion(const std::array<float, 3>& direction, const pinhole_camera& camera, const depth_range& range,
                                 float motion, float max_reach) {
    const auto [x, y, z] =
        within_motion({max_reach * direction[0], max_reach * direction[1], max_reach * direction[2]}, camera, range, motion);
    return vector_length(vector_length(x, y), z);
}

inline std::string point_text(const std::array<float, 3>& p) {
    return "(" + to_text(p[0]) + ", " + to_text(p[1]) + ", " + to_text(p[2]) + ")";
}

/// Evaluates at `t` the cubic Hermite curve over [0, 1] with the given end values and slopes.
inline float cubic(float first, float last, float slope_first, float slope_last, float t) {
    const float s = 1 - t;
    return s * s * (1 + 2 * t) * first + t * t * (1 + 2 * s) * last + t * s * (s * slope_first - t * slope_last);
}

}  // namespace detail

inline view look_at(const pinhole_camera& camera, const std::array<float, 3>& position, const std::array<float, 3>& target) {
    detail::point3 back{};
    for (std::size_t i = 0; i < 3; ++i) back[i] = double{position[i]} - target[i];
    LDI_ASSERT(back[0] != 0 || back[2] != 0);
    back = detail::normalized(back);
    const detail::point3 right = detail::normalized(detail::cross({0, 1, 0}, back));
    const detail::point3 up = detail::cross(back, right);
    view result;
    result.camera = camera;
    result.position = position;
    const std::array<const detail::point3*, 3> axes{&right, &up, &back};
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t axis = 0; axis < 3; ++axis) result.rotation[3 * row + axis] = static_cast<float>((*axes[axis])[row]);
    return result;
}

inline view view_through_window(const pinhole_camera& camera, const depth_range& range, const std::array<float, 3>& position,
                                float window) {
    const float distance = range.depth(window), pixels = camera.focal_length / distance;
    LDI_ASSERT(distance + position[2] > 0);
    view result;
    result.camera = camera;
    result.position = position;
    result.camera.focal_length = pixels * (distance + position[2]);
    result.lens_shift = {pixels * position[0], -pixels * position[1]};
    return result;
}

inline view view_on_path(camera_path path, const pinhole_camera& camera, const depth_range& range, float time,
                         const path_options& options) {
    if (!(options.motion >= 0 && options.motion <= 1) || !(options.focus_disparity >= 0 && options.focus_disparity <= 1) ||
        !(options.approach >= 0 && options.approach < 1))
        raise(error_code::invalid_option, "path_options", "motion and focus_disparity in [0, 1], approach in [0, 1)",
              detail::to_text(options.motion) + ", " + detail::to_text(options.focus_disparity) + ", " +
                  detail::to_text(options.approach));
    const float focus = range.depth(options.focus_disparity);
    const float radius = detail::reach_within_motion({1, 0, 0}, camera, range, options.motion, focus);
    const float farthest_forward =
        detail::reach_within_motion({0, 0, -1}, camera, range, options.motion, options.approach * range.z_near);
    const float angle = 6.28318530718F * time;
    const float forward = farthest_forward * 0.5F * (1 - std::cos(0.5F * angle));  // starts and stops gently
    const auto through_window = [&](const std::array<float, 3>& position) {
        return view_through_window(camera, range, position, options.focus_disparity);
    };
    switch (path) {
        case camera_path::circle: return through_window({radius * std::cos(angle), -radius * std::sin(angle), 0});
        case camera_path::swing: return through_window({radius * std::sin(angle), 0, 0});
        case camera_path::zoom_in: return look_at(camera, {0, 0, -forward}, {0, 0, -focus});
        case camera_path::dolly_zoom: break;
    }
    return through_window({0, 0, -forward});
}

inline view view_between(std::span<const key_frame> keys, const pinhole_camera& camera, float time) {
    if (keys.empty()) raise(error_code::invalid_option, "key frames", "at least one", "none");
    for (std::size_t i = 0; i < keys.size(); ++i) {
        if (!(keys[i].zoom > 0) || !std::isfinite(keys[i].zoom))
            raise(error_code::invalid_option, "key frame", "a finite zoom above 0", detail::to_text(keys[i].zoom));
        if (!std::isfinite(keys[i].time))
            raise(error_code::invalid_option, "key frame", "a finite time", detail::to_text(keys[i].time));
        if (i > 0 && !(keys[i].time > keys[i - 1].time))
            raise(error_code::invalid_option, "key frames", "increasing times",
                  detail::to_text(keys[i - 1].time) + ", then " + detail::to_text(keys[i].time));
    }
    std::size_t i = 0;
    while (i + 2 < keys.size() && time >= keys[i + 1].time) ++i;
    const std::size_t next = (std::min)(i + 1, keys.size() - 1);
    const std::size_t before = i > 0 ? i - 1 : i, after = (std::min)(next + 1, keys.size() - 1);
    const float duration = keys[next].time - keys[i].time;
    const float t = duration > 0 ? std::clamp((time - keys[i].time) / duration, 0.0F, 1.0F) : 0.0F;
    const auto slope = [&](std::size_t a, std::size_t b, auto&& value) {
        return b > a ? (value(keys[b]) - value(keys[a])) / (keys[b].time - keys[a].time) * duration : 0.0F;
    };
    const auto interpolated = [&](auto&& value) {
        return detail::cubic(value(keys[i]), value(keys[next]), slope(before, next, value), slope(i, after, value), t);
    };
    std::array<float, 3> position{}, target{};
    for (std::size_t c = 0; c < 3; ++c) {
        position[c] = interpolated([c](const key_frame& k) { return k.position[c]; });
        target[c] = interpolated([c](const key_frame& k) { return k.target[c]; });
    }
    const auto is_finite = [](const std::array<float, 3>& p) {
        return std::all_of(p.begin(), p.end(), [](float value) { return std::isfinite(value); });
    };
    if (!is_finite(position) || !is_finite(target) || (position[0] == target[0] && position[2] == target[2]))
        raise(error_code::invalid_option, "key frames", "a camera that never looks straight up or down",
              detail::point_text(position) + " looking at " + detail::point_text(target) + " at time " + detail::to_text(time));
    view result = look_at(camera, position, target);
    result.camera.focal_length *= std::exp(interpolated([](const key_frame& k) { return std::log(k.zoom); }));
    return result;
}

inline float frame_within(std::span<const view> views, const pinhole_camera& camera, const depth_range& range,
                          float past_border) {
    const float w = detail::nearest_float(camera.width), h = detail::nearest_float(camera.height);
    // Whether pixel (x, y) of a view shows a point of the photo or of its continuation, if the surface there has this disparity.
    // Along a ray, the position in the photo is linear in disparity, so tests at disparity 0, 1 and the window suffice.
    const auto sees_photo = [&](const view& v, float x, float y, float disparity) {
        const std::array<float, 3> ray = v.direction_to_photo({x - v.axis_x(), v.axis_y() - y, -v.camera.focal_length});
        const float depth = range.depth(disparity);
        if (!(ray[2] < 0) || !(v.position[2] > -depth)) return false;
        const float scale = (-depth - v.position[2]) / ray[2];
        const std::array<float, 2> seen =
            camera.project({v.position[0] + scale * ray[0], v.position[1] + scale * ray[1], -depth});
        const float grown = past_border * std::abs(disparity - window_disparity) * (std::max)(w, h);
        const float more_x = grown + 1e-3F * w, more_y = grown + 1e-3F * h;
        return seen[0] >= -more_x && seen[0] <= w + more_x && seen[1] >= -more_y && seen[1] <= h + more_y;
    };
    const auto is_inside = [&](float size) {
        for (const view& v : views)
            for (const float x : {-1.0F, 1.0F})
                for (const float y : {-1.0F, 1.0F})
                    for (const float disparity : {0.0F, window_disparity, 1.0F})
                        if (!sees_photo(v, v.camera.center_x() * (1 + size * x), v.camera.center_y() * (1 + size * y), disparity))
                            return false;
        return true;
    };
    if (is_inside(1)) return 1;
    float inside = 0, outside = 1;
    for (int step = 0; step < 20; ++step) {  // to a millionth, about the precision of float
        const float middle = 0.5F * (inside + outside);
        (is_inside(middle) ? inside : outside) = middle;
    }
    return inside;
}

}}  // namespace ldi
