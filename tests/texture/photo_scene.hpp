// Layered images for tests of textures: random ones, and real photos after the previous stages.
#pragma once

#include "tests/support/lifted_scene.hpp"
#include "tests/support/random_graph.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <utility>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace ldi::testing {

/// A graph from random_graph.hpp, with random colors, some of them unknown.
inline photo_layers random_photo_layers(std::mt19937& random, std::int32_t largest_side) {
    random_layers made = random_graph(random, largest_side);
    photo_layers layers(graph(made.topology()));
    layers.set_column<disparity_column>(std::move(made.disparity));
    for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(below(random, 256));
    for (std::uint8_t& known : layers.column<known_column>()) known = chance(random, 70) ? 1 : 0;
    return layers;
}

/// A lifted photo with its hidden surfaces, every pixel colored.
inline photo_layers with_hidden_surfaces(photo_layer lifted) {
    unmix_colors(lifted);
    const auto curves = find_discontinuity_curves(lifted, {});
    // Grows far behind the surface in front.
    photo_layers layers = expand(std::move(lifted), {}, curves, {.motion = 1.0F, .iterations = 50}).layers;
    const serial_executor threads;
    diffusion_inpainter().inpaint(layers, {}, threads);
    return layers;
}

/// Slanted shapes in front of a slanted background, in noisy colors.
inline photo_layers random_scene(std::mt19937& random, std::size_t rows, std::size_t columns) {
    image<std::uint8_t> color(rows, columns, 3);
    for (std::size_t i = 0; i < color.size(); ++i) color.data()[i] = static_cast<std::uint8_t>(below(random, 256));
    return with_hidden_surfaces(lift(color, ldi::testing::random_disparity(random, rows, columns)));
}

/// Returns the layers of a photo with disparity from ../shared/rgbd, at the photo's size or stretched to rows x columns; nothing
/// if a file is missing. The disparity is scaled to [0, 1] but not cleaned, because charts must handle noisy edges.
inline std::optional<photo_layers> shared_photo(const std::string& name, std::size_t rows = 0, std::size_t columns = 0) {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "rgbd";
    std::filesystem::path photo_file = folder / (name + ".png");
    if (!std::filesystem::exists(photo_file)) photo_file = folder / (name + ".jpg");
    const std::filesystem::path map_file = folder / (name + "_disparity.png");
    if (!std::filesystem::exists(photo_file) || !std::filesystem::exists(map_file)) return std::nullopt;
    const image<std::uint8_t> photo = load_photo(photo_file).color;
    depth_map_options map_options;
    map_options.invalid_zero = true;
    const image<float> map = fill_invalid(load_depth_map(map_file, map_options));
    if (rows == 0) rows = photo.height(), columns = photo.width();
    image<std::uint8_t> color(rows, columns, 3);
    image<float> disparity(rows, columns);
    const auto [lowest, highest] = std::minmax_element(map.data(), map.data() + map.size());
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            for (std::size_t c = 0; c < 3; ++c) color(y, x, c) = photo(y * photo.height() / rows, x * photo.width() / columns, c);
            disparity(y, x, 0) = (map(y * map.height() / rows, x * map.width() / columns, 0) - *lowest) / (*highest - *lowest);
        }
    return with_hidden_surfaces(lift(color, disparity));
}

}  // namespace ldi::testing
