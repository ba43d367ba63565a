// The graph of a real photo at the paper's size, for the benchmarks of core.
#pragma once

#include "tests/support/sketched_graph.hpp"

#include <ldi/core/graph.hpp>
#include <ldi/io/photo.hpp>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace ldi::benchmarks {

inline constexpr std::int32_t photo_width = 1152, photo_height = 1536;

/// A single layer of photo_width x photo_height pixels, linked except where the photo's disparity jumps by more than 0.05.
/// Nothing if the photo is not there.
inline std::optional<graph> photo_graph() {
    const std::filesystem::path path = std::filesystem::path(LDI_SHARED_DIR) / "rgbd" / "lensblur_exifr_disparity.png";
    if (!std::filesystem::exists(path)) return std::nullopt;
    const image<std::uint8_t> disparity = load_photo(path).color;
    testing::sketched_graph g(make_grid(photo_width, photo_height));
    const auto value = [&](std::int32_t pixel) {
        const std::size_t x = static_cast<std::size_t>(pixel % photo_width) * disparity.width() / photo_width;
        const std::size_t y = static_cast<std::size_t>(pixel / photo_width) * disparity.height() / photo_height;
        return static_cast<float>(disparity(y, x, 0)) / 255.0F;
    };
    for (std::int32_t i = 0; i < photo_width * photo_height; ++i)
        for (const side s : {side::up, side::left})
            if (g.neighbor(i, s) != no_pixel && std::abs(value(i) - value(g.neighbor(i, s))) > 0.05F) g.unlink(i, s);
    return g;
}

}  // namespace ldi::benchmarks
