// Pixel regions from images of marks. number_in() counts marks one by one, to check the numbers of a region's pixels.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/core/pixel_region.hpp>

#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

namespace ldi::testing {

/// Blobs, stripes and single pixels.
inline image<std::uint8_t> random_marks(std::size_t height, std::size_t width, std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    image<std::uint8_t> marks(height, width);
    for (std::size_t blob = 0; blob < 1 + below(6); ++blob) {
        const std::size_t rows = 1 + below(height), columns = 1 + below(width), top = below(height), left = below(width);
        const std::uint8_t value = below(4) == 0 ? 0 : 1;
        for (std::size_t y = top; y < top + rows && y < height; ++y)
            for (std::size_t x = left; x < left + columns && x < width; ++x) marks(y, x) = value;
    }
    for (std::size_t i = 0; i < height * width / 16; ++i) marks(below(height), below(width)) ^= 1;
    return marks;
}

inline pixel_region region_of(const image<std::uint8_t>& marks) {
    const auto width = static_cast<std::int32_t>(marks.width());
    pixel_region_builder region(width);
    for (std::size_t y = 0; y < marks.height(); ++y) {
        for (std::int32_t x = 0; x < width; ++x)
            if (marks(y, x) != 0) region.add_run(x, x + 1);
        region.end_row();
    }
    return std::move(region).build();
}

inline std::int32_t number_in(const image<std::uint8_t>& marks, std::int32_t x, std::int32_t y) {
    const std::int32_t height = static_cast<std::int32_t>(marks.height()), width = static_cast<std::int32_t>(marks.width());
    if (x < 0 || y < 0 || x >= width || y >= height || marks(y, x) == 0) return no_pixel;
    std::int32_t number = 0;
    for (std::int32_t i = 0; i < y * width + x; ++i) number += marks.data()[i];
    return number;
}

}  // namespace ldi::testing
