// The pinhole camera that took the photo, and the conversion of disparity to distance. The paper lifts every vertex "along its
// corresponding ray according to its depth" (section "Meshing"); this header defines the ray and the depth.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/numbers.hpp>

#include <array>
#include <cmath>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The camera of the photo. Its functions do not check the focal length: with 0, the default, unproject() returns infinite or NaN
/// coordinates. Pixel (x, y) covers [x, x + 1) x [y, y + 1); its center is (x + 0.5, y + 0.5). Space follows glTF: x to the
/// right, y up, the camera at the origin looking along -z.
struct pinhole_camera {
    std::int32_t width = 0, height = 0;  ///< size of the photo in pixels
    float focal_length = 0;  ///< focal length in pixels, above 0; the optical axis passes through the middle of the photo

    /// Middle of the photo in pixels.
    float center_x() const { return 0.5F * detail::nearest_float(width); }
    float center_y() const { return 0.5F * detail::nearest_float(height); }

    /// Returns the point that is visible at (x, y), in pixels, and whose distance along the optical axis is `depth`.
    std::array<float, 3> unproject(float x, float y, float depth) const {
        const float scale = depth / focal_length;
        return {(x - center_x()) * scale, (center_y() - y) * scale, -depth};
    }

    /// Projects a point in front of the camera to the photo, in pixels.
    std::array<float, 2> project(const std::array<float, 3>& point) const {
        const float scale = focal_length / -point[2];
        return {center_x() + point[0] * scale, center_y() - point[1] * scale};
    }
};

/// Converts a 35 mm equivalent focal length (EXIF FocalLengthIn35mmFilm) to pixels. The photo's diagonal corresponds to the
/// diagonal of a frame of 36 mm x 24 mm.
///
/// millimeters    above 0; EXIF stores 0 for an unknown focal length, and the result is then 0
/// width, height  size of the photo in pixels
inline float focal_length_from_35mm(float millimeters, std::int32_t width, std::int32_t height) {
    return millimeters * detail::vector_length(detail::nearest_float(width), detail::nearest_float(height)) /
           detail::vector_length(36.0F, 24.0F);
}

/// Converts the field of view across the photo's longer side, in degrees, to a focal length in pixels.
///
/// degrees        above 0, below 180
/// width, height  size of the photo in pixels
inline float focal_length_from_field_of_view(float degrees, std::int32_t width, std::int32_t height) {
    const float radians = degrees * 3.14159265358979F / 180.0F;
    return 0.5F * detail::nearest_float(width > height ? width : height) / std::tan(0.5F * radians);
}

/// Distances at disparity 1 and disparity 0. Between them, disparity is linear in 1 / depth, so that equal steps of disparity
/// cause equal motion on screen. The unit is meters if the depth is metric (normalize_options::is_metric). Otherwise it is
/// arbitrary: by default, the nearest surface is at distance 1 (normalize_options::assumed_range). The functions do not check the
/// two distances: values outside the ranges below give meaningless depths, such as negative or infinite ones.
struct depth_range {
    float z_near = 1.0F;  ///< depth at disparity 1, above 0
    float z_far = 10.0F;  ///< depth at disparity 0, z_near or more

    float inverse_depth(float disparity) const { return 1.0F / z_far + disparity * (1.0F / z_near - 1.0F / z_far); }
    float depth(float disparity) const { return 1.0F / inverse_depth(disparity); }

    /// Returns an upper bound, in pixels, on the distance by which renderers shift the texture along an edge of `length` pixels
    /// between these disparities. Perspective-correct interpolation causes the shift: at the middle of the edge, renderers sample
    /// the texture closer to the nearer end.
    float texture_shift(float length, float disparity_a, float disparity_b) const {
        const float a = inverse_depth(disparity_a), b = inverse_depth(disparity_b);
        // The exact maximum is length (r - 1) / (r + 1), where r^2 is the larger inverse depth divided by the smaller.
        return 0.25F * length * std::abs(a - b) / (a < b ? a : b);
    }
};

}}  // namespace ldi
