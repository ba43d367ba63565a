// What the lessons look at: a part of the sample that lies in examples/photo3d, as a photo, a disparity map and a layered image.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace learn {

struct sample {
    ldi::image<std::uint8_t> color;  ///< H x W x 3
    ldi::image<float> disparity;     ///< H x W x 1, in [0, 1]
};

/// A rectangle of the sample's 1152 x 1536 pixels.
struct rectangle {
    std::size_t x, y, width, height;
};
inline constexpr rectangle everything{0, 0, 1152, 1536}, globe{103, 270, 252, 252}, archway{40, 640, 460, 480};

/// shrink  the side of the square of pixels that becomes one. It gets the mean color of those that are of its middle's surface
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

/// The photo seen by a phone's main camera, over the default range of distances.
inline ldi::photo_facts facts_of(const sample& from) {
    const std::int32_t width = static_cast<std::int32_t>(from.color.width()),
                       height = static_cast<std::int32_t>(from.color.height());
    ldi::photo_facts facts;
    facts.camera = {width, height, ldi::focal_length_from_35mm(26.0F, width, height)};
    return facts;
}

/// Lesson 1 in one function: the sample as a layered image whose hidden surfaces have grown by `iterations` pixels. Colors right
/// at silhouettes, where the lens has mixed those of two surfaces, count as unknown.
inline ldi::photo_layers layers_of(const sample& from, int iterations) {
    ldi::photo_layer layer = ldi::lift(from.color, from.disparity);
    const ldi::buffer<ldi::discontinuity_curve> curves = ldi::find_discontinuity_curves(layer, {});
    ldi::close_spurious_discontinuities(layer, curves);
    ldi::unmix_colors(layer);
    return ldi::expand(std::move(layer), {}, curves, {.motion = 1.0F, .iterations = iterations}).layers;
}

}  // namespace learn
