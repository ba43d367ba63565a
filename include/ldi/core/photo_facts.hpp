// Properties of a photo that its pixels don't contain. They accompany the layered image; stages read the parts that they need.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/surface.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct photo_facts {
    pinhole_camera camera{};  ///< camera that took the photo
    depth_range range{};      ///< distances at disparity 1 and 0
    surface_rule surface{};   ///< rule for whether neighbors belong to one surface
    /// Maximum camera motion (render/motion.hpp) for which hidden surfaces exist, as a share of the photo's longer side; 0:
    /// there are no hidden surfaces.
    float motion = 0.0F;
};

}}  // namespace ldi
