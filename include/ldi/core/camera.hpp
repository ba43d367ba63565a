// The pinhole camera that took the photo, and how disparity becomes distance. The paper lifts every vertex "along its
// corresponding ray according to its depth" (section "Meshing"); these are the ray and the depth.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/numbers.hpp>

#include <array>
#include <cmath>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Pixel (x, y) of the photo covers [x, x + 1) x [y, y + 1); its center is (x + 0.5, y + 0.5). Space is glTF's: x to the right,
/// y up, the camera at the origin looking along -z.
struct pinhole_camera {
    std::int32_t width = 0, height = 0;  ///< of the photo, in pixels
    float focal_length = 0;              ///< in pixels; the optical axis meets the middle of the photo

    /// The middle of the photo, in pixels.
    float center_x() const { return 0.5F * detail::nearest_float(width); }
    float center_y() const { return 0.5F * detail::nearest_float(height); }

    /// The point at distance `depth` along the optical axis that is seen at (x, y), in pixels.
    std::array<float, 3> unproject(float x, float y, float depth) const {
        const float scale = depth / focal_length;
        return {(x - center_x()) * scale, (center_y() - y) * scale, -depth};
    }

    /// The place in the photo at which a point in front of the camera is seen, in pixels.
    std::array<float, 2> project(const std::array<float, 3>& point) const {
        const float scale = focal_length / -point[2];
        return {center_x() + point[0] * scale, center_y() - point[1] * scale};
    }
};

/// The focal length in pixels of a lens given as 35 mm equivalent, which compares diagonals (EXIF FocalLengthIn35mmFilm).
inline float focal_length_from_35mm(float millimeters, std::int32_t width, std::int32_t height) {
    return millimeters * detail::vector_length(detail::nearest_float(width), detail::nearest_float(height)) /
           detail::vector_length(36.0F, 24.0F);
}

/// The focal length in pixels that gives `degrees` of view over the longer side of the photo.
inline float focal_length_from_field_of_view(float degrees, std::int32_t width, std::int32_t height) {
    const float radians = degrees * 3.14159265358979F / 180.0F;
    return 0.5F * detail::nearest_float(width > height ? width : height) / std::tan(0.5F * radians);
}

/// The distances that disparity 1 and disparity 0 stand for. In between, disparity is linear in 1 / depth, so that equal steps of
/// disparity move equally far on screen.
struct depth_range {
    float z_near = 1.0F;  ///< depth of disparity 1, in meters where known
    float z_far = 10.0F;  ///< depth of disparity 0

    float inverse_depth(float disparity) const { return 1.0F / z_far + disparity * (1.0F / z_near - 1.0F / z_far); }
    float depth(float disparity) const { return 1.0F / inverse_depth(disparity); }

    /// The largest error, in pixels, of a texture along an edge of `length` pixels between these disparities, when it is drawn
    /// with perspective-correct interpolation: renderers move the middle of an edge towards its nearer end.
    float texture_shift(float length, float disparity_a, float disparity_b) const {
        const float a = inverse_depth(disparity_a), b = inverse_depth(disparity_b);
        return 0.25F * length * std::abs(a - b) / (a < b ? a : b);  // length (r - 1) / (r + 1) with r^2 = a / b is less than this
    }
};

}}  // namespace ldi
