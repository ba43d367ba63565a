// The viewer's camera (paper, section "Viewing 3D Photos"): a pinhole camera that can leave the photo's viewpoint.
#pragma once

#include <ldi/core/camera.hpp>

#include <array>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A camera with a pose in the photo's space, which follows glTF: the photo's camera is at the origin and looks along -z.
struct view {
    pinhole_camera camera;                   ///< size of the picture, focal length
    std::array<float, 3> position{0, 0, 0};  ///< position of the camera in the photo's space
    /// 3 x 3, row-major, orthonormal: rotates from the camera's axes to the photo's axes.
    std::array<float, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
    /// Offset of the optical axis from the picture's center, in pixels to the right and down.
    std::array<float, 2> lens_shift{0, 0};

    /// Position of the optical axis in the picture, in pixels.
    float axis_x() const { return camera.center_x() + lens_shift[0]; }
    float axis_y() const { return camera.center_y() + lens_shift[1]; }

    /// Rotates a direction from the camera's axes to the photo's axes.
    std::array<float, 3> direction_to_photo(const std::array<float, 3>& d) const {
        const std::array<float, 9>& r = rotation;
        return {r[0] * d[0] + r[1] * d[1] + r[2] * d[2], r[3] * d[0] + r[4] * d[1] + r[5] * d[2],
                r[6] * d[0] + r[7] * d[1] + r[8] * d[2]};
    }

    /// Transforms a point from the photo's space to the camera's space.
    std::array<float, 3> to_camera(const std::array<float, 3>& point) const {
        const std::array<float, 9>& r = rotation;
        const float x = point[0] - position[0], y = point[1] - position[1], z = point[2] - position[2];
        return {r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z};
    }
};

/// Moves the photo's camera within its image plane, without rotation, so that points at `disparity` shift by `pixels_right` and
/// `pixels_down` on screen (negative: left, up). Points at other depths shift in inverse proportion to their depth.
inline view moved_view(const pinhole_camera& camera, const depth_range& range, float disparity, float pixels_right,
                       float pixels_down = 0) {
    const float scale = range.depth(disparity) / camera.focal_length;
    view result;
    result.camera = camera;
    result.position = {-pixels_right * scale, pixels_down * scale, 0};
    return result;
}

}}  // namespace ldi
