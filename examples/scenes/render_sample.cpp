// Writes a scene's photo (JPEG) and its depth map (16-bit gray PNG, disparity, white near), for example the sample of the
// project:
//
//     render_sample still_life 1152 1536 examples/photo3d/sample.jpg examples/photo3d/sample_depth.png
#include "scene.hpp"

#include <ldi/io/picture.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

namespace {

/// Rounds to 12 bits and scales the values to 16 bits. Finer steps would be invisible and would make the file larger.
ldi::image<std::uint16_t> stored(const ldi::image<float>& disparity) {
    ldi::image<std::uint16_t> result(disparity.height(), disparity.width());
    std::transform(disparity.begin(), disparity.end(), result.begin(), [](float d) {
        const long value = std::lround(std::clamp(d, 0.0F, 1.0F) * 4095.0F);
        return static_cast<std::uint16_t>(value << 4 | value >> 8);
    });
    return result;
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 6 && count != 7) {
        std::fprintf(stderr, "usage: %s SCENE WIDTH HEIGHT OUT.jpg OUT_depth.png [SAMPLES_PER_AXIS]\n", arguments[0]);
        return 2;
    }
    try {
        const auto positive = [&](int index) {
            const long value = std::strtol(arguments[index], nullptr, 10);
            if (value < 1 || value > 16384)
                ldi::raise(ldi::error_code::invalid_option, "render_sample", "a number from 1 to 16384", arguments[index]);
            return static_cast<std::int32_t>(value);
        };
        const ldi::scenes::scene scene = ldi::scenes::scene_by_name(arguments[1], positive(2), positive(3));
        ldi::view photo;
        photo.camera = scene.camera;
        ldi::scenes::picture_options options;
        options.samples = count == 7 ? positive(6) : 8;
        ldi::thread_pool threads;
        const ldi::scenes::picture result = ldi::scenes::render(scene, photo, options, threads);
        ldi::save_jpeg(arguments[4], result.color, 90);
        ldi::save_png(arguments[5], stored(result.disparity));
    } catch (const std::exception& failure) {
        std::fprintf(stderr, "%s\n", failure.what());
        return 1;
    }
}
