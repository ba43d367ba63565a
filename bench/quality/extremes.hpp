// Counts uncovered pixels when the camera is as far from the photo's viewpoint as allowed.
#pragma once

#include "holes.hpp"
#include "metrics.hpp"

#include <ldi/photo3d.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

/// Views from the limits of the camera's motion: in eight directions at the photo's distance, closer and farther; straight
/// forward and back; and from five positions along each named path.
inline std::vector<std::pair<std::string, ldi::view>> extreme_views(const ldi::photo_facts& photo) {
    std::vector<std::pair<std::string, ldi::view>> result;
    const auto add = [&](const std::string& name, const std::array<float, 3>& direction) {
        const float far = 0.99F * photo.range.z_near;  // in front of the nearest surface
        ldi::view v;
        v.camera = photo.camera;
        v.position = ldi::within_motion({far * direction[0], far * direction[1], far * direction[2]}, photo.camera, photo.range,
                                        photo.motion);
        result.emplace_back(name, v);
    };
    for (const float forward : {-1.0F, 0.0F, 0.5F, 1.0F})
        for (int i = 0; i < 8; ++i) {
            const float angle = 0.785398163F * static_cast<float>(i);
            add("aside " + std::to_string(45 * i) + ", forward " + std::to_string(forward).substr(0, 4),
                {std::cos(angle), std::sin(angle), -forward});
        }
    add("forward", {0, 0, -1}), add("back", {0, 0, 1});
    for (const named_view& v : views_on_paths(photo)) result.emplace_back(v.name, v.from);
    return result;
}

struct extreme {
    double uncovered = 0;  ///< share of the frame
    std::string where;
};

/// Finds the extreme view with the largest uncovered share of the frame.
template <ldi::executor Executor>
extreme worst_extreme(const ldi::photo3d& photo, Executor& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * photo.facts.range.z_near;
    extreme worst;
    for (const auto& [name, from] : extreme_views(photo.facts)) {
        // Makes the frame one percent smaller, because frame_within() allows about a pixel of the border to be visible.
        const float size = 0.99F * ldi::frame_within(std::span(&from, 1), photo.facts.camera, photo.facts.range);
        const ldi::rendering seen = ldi::rasterize(photo.mesh, photo.atlas.color, ldi::framed(from, size), raster, threads);
        const double uncovered = 1 - share(seen.coverage);
        if (uncovered > worst.uncovered) worst = {uncovered, name};
    }
    return worst;
}

}  // namespace ldi_quality
