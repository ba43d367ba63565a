// Writes one picture for each eye: `photo3d --stereo-image FILE`.
#pragma once

#include "outputs.hpp"
#include "photo_texture.hpp"
#include "stereo_file.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Views of the two eyes.
struct stereo_pair {
    image<std::uint8_t> left, right;
    float eye_distance = 0;  ///< in units of the photo's space
};

/// Checks the output's name before the conversion starts. Raises invalid_option for another type of file, and the errors of
/// output_files::claim().
inline void check_stereo_image(const std::filesystem::path& file, output_files& files) {
    if (file.empty()) return;
    files.claim(file);
    const std::string kind = extension_of(file);
    for (const char* known : {".jps", ".mpo", ".jpg", ".jpeg", ".png"})
        if (kind == known) return;
    raise(error_code::invalid_option, file.string(), "a name that ends in .jps, .mpo, .jpg or .png",
          kind.empty() ? "no extension" : kind);
}

/// Draws the two views of a scene through a window, which has the same position for both eyes. The window is at the distance of
/// the nearest surface, so that its edges cut off no surface in front of it. The parallax of the farthest surface is a thirtieth
/// of the width, or less if the photo's motion limits it. If surfaces end at the photo's border, each picture covers less of the
/// photo's width, by this parallax, because otherwise the border would be visible.
template <executor Executor>
stereo_pair draw_stereo_pair(const photo3d& result, photo_texture& texture, Executor& threads) {
    const pinhole_camera camera = texture.camera();
    const depth_range& range = result.facts.range;
    const float half = within_motion({0.5F * eye_distance(camera, range), 0, 0}, camera, range, result.facts.motion)[0];
    const float width = static_cast<float>(camera.width);
    const float apart = camera.focal_length * half * (range.inverse_depth(1) - range.inverse_depth(0));
    view from;
    from.camera = camera;
    if (result.facts.margin == 0) from.camera.focal_length *= width / (width - 2 * apart);
    raster_options raster;
    raster.samples = 2;
    raster.z_near = 0.01F * range.z_near;
    const auto draw = [&](float side) { return texture.draw(beside(from, side, range.z_near), raster, threads).color; };
    return {draw(-half), draw(half), 2 * half};
}

/// Writes a stereo picture.
///
/// quality    quality of JPEG, 1 to 100
/// is_metric  whether depth is in meters
template <executor Executor>
void save_stereo_image(const photo3d& result, photo_texture& texture, const std::filesystem::path& file, int quality,
                       bool is_metric, output_files& files, Executor& threads) {
    if (file.empty()) return;
    const stereo_pair pair = draw_stereo_pair(result, texture, threads);
    const std::string kind = extension_of(file);
    files.write(file, kind == ".jps"   ? encode_jps(pair.left, pair.right, quality)
                      : kind == ".mpo" ? encode_mpo(pair.left, pair.right, quality, is_metric ? pair.eye_distance : 0)
                      : kind == ".png" ? encode_png(side_by_side(pair.left, pair.right))
                                       : encode_jpeg(side_by_side(pair.left, pair.right), quality));
}

}  // namespace ldi::examples
