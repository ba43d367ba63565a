// Parts of the sample in examples/photo3d, as a photo, a disparity map and a layered image. Requires only ldi's headers.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

namespace learn {

struct sample {
    ldi::image<std::uint8_t> color;  ///< H x W x 3
    ldi::image<float> disparity;     ///< H x W x 1, in [0, 1]
};

/// Reads a part of the sample from the folder of this header: colors from NAME.ppm, and disparity from NAME.pgm with 16 bits
/// per value. Raises file_access if a file is missing or truncated.
inline sample load_crop(const std::string& name) {
    const std::string path = (std::filesystem::path(__FILE__).parent_path() / name).string();
    const auto read = [&](const char* extension, auto&& make) {
        std::ifstream file(path + extension, std::ios::binary);
        std::string format;
        std::size_t width = 0, height = 0, largest = 0;
        file >> format >> width >> height >> largest;
        file.get();
        make(width, height, [&] { return static_cast<unsigned>(file.get()); });
        if (!file)
            ldi::raise(ldi::error_code::file_access, path + extension, "a complete picture", "a missing or truncated file");
    };
    sample result;
    read(".ppm", [&](std::size_t width, std::size_t height, auto&& next) {
        result.color = ldi::image<std::uint8_t>(height, width, 3);
        for (std::uint8_t& value : result.color) value = static_cast<std::uint8_t>(next());
    });
    read(".pgm", [&](std::size_t width, std::size_t height, auto&& next) {
        result.disparity = ldi::image<float>(height, width);
        for (float& value : result.disparity) {
            const unsigned high = next(), low = next();
            value = static_cast<float>(high << 8 | low) / 65535.0F;
        }
    });
    return result;
}

/// Returns the photo_facts of a phone's main camera, with the default depth range.
inline ldi::photo_facts facts_of(const sample& from) {
    const std::int32_t width = static_cast<std::int32_t>(from.color.width()),
                       height = static_cast<std::int32_t>(from.color.height());
    ldi::photo_facts facts;
    facts.camera = {width, height, ldi::focal_length_from_35mm(26.0F, width, height)};
    return facts;
}

/// Makes a layered image as in lesson 1, whose hidden surfaces have grown by `iterations` pixels. Marks colors at silhouettes,
/// where the lens mixes two surfaces, as unknown.
inline ldi::photo_layers layers_of(const sample& from, int iterations) {
    ldi::photo_layer layer = ldi::lift(from.color, from.disparity);
    const ldi::buffer<ldi::discontinuity_curve> curves = ldi::find_discontinuity_curves(layer);
    ldi::close_spurious_discontinuities(layer, curves);
    ldi::unmix_colors(layer);
    return ldi::expand(std::move(layer), ldi::surface_rule{}, curves, {.motion = 1.0F, .iterations = iterations}).layers;
}

}  // namespace learn
