// The whole sample of examples/photo3d, or a part of it, at a lower resolution.
#pragma once

#include "sample.hpp"

#include <ldi/depth/normalize.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace learn {

/// A rectangle of the sample's 1152 x 1536 pixels.
struct rectangle {
    std::size_t x, y, width, height;
};
inline constexpr rectangle everything{0, 0, 1152, 1536}, globe{103, 270, 252, 252}, archway{40, 640, 460, 480};

/// Loads a part of the sample and shrinks it: each square of `shrink` x `shrink` pixels becomes one pixel, with the mean color of
/// those pixels that lie on the same surface as the square's center.
inline sample load_sample(const rectangle& part, std::size_t shrink) {
    const std::string file = LDI_SOURCE_DIR "/examples/photo3d/sample";
    const ldi::image<std::uint8_t> photo = ldi::load_photo(file + ".jpg").color;
    const ldi::image<float> map = ldi::normalize(ldi::load_depth_map(file + "_depth.png"), {.is_inverse_depth = false}).disparity;
    sample result{ldi::image<std::uint8_t>(part.height / shrink, part.width / shrink, 3),
                  ldi::image<float>(part.height / shrink, part.width / shrink)};
    for (std::size_t y = 0; y < result.color.height(); ++y)
        for (std::size_t x = 0; x < result.color.width(); ++x) {
            const std::size_t top = part.y + y * shrink, left = part.x + x * shrink;
            const float middle = result.disparity(y, x) = map(top + shrink / 2, left + shrink / 2);
            std::size_t sum[3] = {}, count = 0;
            for (std::size_t v = top; v < top + shrink; ++v)
                for (std::size_t u = left; u < left + shrink; ++u) {
                    if (!ldi::surface_rule{}.same_surface(map(v, u), middle)) continue;
                    ++count;
                    for (std::size_t c = 0; c < 3; ++c) sum[c] += photo(v, u, c);
                }
            for (std::size_t c = 0; c < 3; ++c) result.color(y, x, c) = static_cast<std::uint8_t>(sum[c] / count);
        }
    return result;
}

}  // namespace learn
