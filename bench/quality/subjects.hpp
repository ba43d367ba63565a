// Test subjects: stereo pairs with true depth, and ray-cast scenes with known surfaces.
#pragma once

#include "metrics.hpp"

#include <examples/scenes/scene.hpp>

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/render/camera.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

struct subject {
    std::string name;
    picture photo;
    ldi::image<float> inverse_depth;  ///< H x W x 1, above 0
    mask known;                       ///< H x W x 1; 0 where depth was not measured and is copied from the nearest pixel
    ldi::pinhole_camera camera;
    ldi::view other;  ///< the second viewpoint
    picture seen;     ///< photograph from there

    ldi::depth_range range() const {
        const auto [least, most] = std::minmax_element(inverse_depth.begin(), inverse_depth.end());
        return {1 / *most, 1 / *least};
    }
    /// Relative motion of the nearest and the farthest surface between both views, in pixels.
    double parallax() const {
        const ldi::depth_range r = range();
        return static_cast<double>(std::abs(other.position[0]) * camera.focal_length * (r.inverse_depth(1) - r.inverse_depth(0)));
    }
};

/// Middlebury's pairs: a point with disparity d is d pixels farther left in the right photo. This function uses d as inverse
/// depth. It ignores how far the photos were cropped relative to each other, which distorts the space but changes neither
/// picture.
inline std::vector<subject> stereo_pairs() {
    std::vector<subject> result;
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "rgbd";
    for (const char* name : {"mb_books", "mb_cloth3", "mb_cones", "mb_laundry", "mb_reindeer", "mb_wood2"}) {
        const std::string path = (folder / name).string();
        if (!std::filesystem::exists(path + "_right.png")) {
            std::printf("skipped: there is no %s_right.png\n\n", path.c_str());
            continue;
        }
        subject s;
        s.name = name;
        s.photo = ldi::load_photo(path + ".png").color;
        s.seen = ldi::load_photo(path + "_right.png").color;
        ldi::depth_map_options options;
        options.invalid_zero = true;
        options.scale = 1.0F / 256;
        const ldi::image<float> measured = ldi::load_depth_map(path + "_disparity.png", options);
        s.known = mask(measured.height(), measured.width());
        std::transform(measured.begin(), measured.end(), s.known.begin(),
                       [](float d) { return static_cast<std::uint8_t>(std::isnan(d) ? 0 : 1); });
        s.inverse_depth = ldi::fill_invalid(measured);
        const std::int32_t w = static_cast<std::int32_t>(s.photo.width()), h = static_cast<std::int32_t>(s.photo.height());
        const float near_pixels = *std::max_element(s.inverse_depth.begin(), s.inverse_depth.end());
        for (float& d : s.inverse_depth) d /= near_pixels;
        s.camera = {w, h, ldi::focal_length_from_35mm(26, w, h)};
        s.other = ldi::moved_view(s.camera, s.range(), 1, -near_pixels);
        result.push_back(std::move(s));
    }
    return result;
}

/// Ray-cast scenes with a second view from the right, so that the nearest surface moves by a tenth of the longer side.
template <ldi::executor Executor>
std::vector<subject> ray_cast_scenes(Executor& threads) {
    std::vector<subject> result;
    ldi::scenes::picture_options options;
    options.samples = 3;
    for (const char* name : {"t_junction", "still_life", "rods", "random3", "random7", "random11"}) {
        const ldi::scenes::scene scene = ldi::scenes::scene_by_name(name, 384, 512);
        subject s;
        s.name = name;
        s.camera = scene.camera;
        ldi::view own;
        own.camera = s.camera;
        s.other = ldi::moved_view(s.camera, scene.range, 1, -51.2F);
        const ldi::scenes::picture photo = ldi::scenes::render(scene, own, options, threads);
        s.photo = photo.color;
        s.seen = ldi::scenes::render(scene, s.other, options, threads).color;
        s.known = mask(photo.depth.height(), photo.depth.width(), 1, std::uint8_t{1});
        s.inverse_depth = photo.depth;
        for (float& d : s.inverse_depth) d = 1 / d;
        result.push_back(std::move(s));
    }
    return result;
}

}  // namespace ldi_quality
