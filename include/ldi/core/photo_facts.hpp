// Properties of a photo that its pixels don't contain. Stages receive these facts in addition to the layered image.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Disparity of the window (the zero-parallax plane) through which a 3D photo is seen. Surfaces at this disparity do not move
/// within the window. The value is the middle of the range, so that the nearest and the farthest surface move equally far.
inline constexpr float window_disparity = 0.5F;

/// The camera and the depth range of a photo, and the extent of its hidden surfaces.
struct photo_facts {
    pinhole_camera camera{};  ///< camera that took the photo
    depth_range range{};      ///< distances at disparity 1 and 0; see depth_range for their unit
    surface_rule surface{};   ///< rule for whether neighbors belong to one surface
    /// Maximum camera motion (render/motion.hpp) for which hidden surfaces are wide enough, as a fraction of the photo's longer
    /// side; 0 if there are no hidden surfaces.
    float motion = 0.0F;
    /// Width of the lattice's margin around the photo, in pixels (occlusion/past_frame.hpp); 0: surfaces end at the photo's
    /// border.
    std::int32_t margin = 0;

    /// Returns the camera of the layered image: the photo's camera, with a sensor that is larger by the margin on every side.
    /// Raises invalid_option for a margin below 0 or above 2^29, and if a side would have 2^31 pixels or more.
    pinhole_camera layers_camera() const {
        if (margin < 0 || margin > 1 << 29)
            raise(error_code::invalid_option, "photo_facts::margin", "0 to 2^29", std::to_string(margin));
        if ((std::max)(camera.width, camera.height) > 0x7FFFFFFF - 2 * margin)
            raise(error_code::invalid_option, "photo_facts", "fewer than 2^31 pixels per side, with the margin",
                  std::to_string(camera.width) + " x " + std::to_string(camera.height) + " with a margin of " +
                      std::to_string(margin));
        return {camera.width + 2 * margin, camera.height + 2 * margin, camera.focal_length};
    }
};

/// Upper bounds, in pixels and in disparity, on the errors that the default tolerances of the mesh cause. Hidden surfaces, and
/// the strips that extend them (mesh/detail/hems.hpp), are wide enough to cover these errors. mesh_pixels: where two surfaces
/// separate, each outline may be off by one pixel (mesh/simplify.hpp). mesh_disparity: at least the sum of the disparity
/// tolerances in mesh/simplify.hpp and mesh/studs.hpp. Both constants are in core because expand() and grow_past_frame() also
/// depend on them, and occlusion/ and mesh/ do not include each other.
inline constexpr float mesh_pixels = 2.0F, mesh_disparity = 0.02F;

/// Returns the maximum parallax between disparities 0 and 1, in pixels.
///
/// width, height  size of the photo
/// motion         photo_facts::motion
inline float max_parallax(std::int32_t width, std::int32_t height, float motion) {
    return motion * detail::nearest_float((std::max)(width, height));
}

}}  // namespace ldi
