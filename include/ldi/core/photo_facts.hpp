// Facts about a photo that its pixels don't hold. They stand beside the layered image, and stages read the part that they need.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/surface.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct photo_facts {
    pinhole_camera camera{};  ///< that took the photo
    depth_range range{};      ///< distances of disparity 1 and 0
    surface_rule surface{};   ///< which neighbors belong to one surface
    /// Camera motion (render/motion.hpp) up to which hidden surfaces reach, as a share of the photo's longer side; 0: there are
    /// no hidden surfaces.
    float motion = 0.0F;
};

}}  // namespace ldi
