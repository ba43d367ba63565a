// Disparity maps that cost much time and memory: as many silhouettes, ends, layers and thin objects as fit.
#pragma once

#include <ldi/core/image.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string_view>

namespace ldi::testing {

/// Names that hard_map() accepts.
inline constexpr std::string_view hard_maps[] = {"flat",   "ramp", "stripes", "comb",   "checkerboard",
                                                 "spiral", "dots", "rings",   "stairs", "noise"};

/// Makes a map of rows x columns x 1, above 0 and at most 1.
///
/// unit  width of the map's features in samples
inline image<float> hard_map(std::string_view name, std::size_t rows, std::size_t columns, std::size_t unit) {
    constexpr float front = 0.9F, back = 0.1F;
    std::mt19937 random(11);
    std::uniform_real_distribution<float> any(0.05F, 1.0F);
    const image<float> cells = [&] {
        image<float> values(rows / unit + 1, columns / unit + 1);
        for (float& value : values) value = any(random);
        return values;
    }();
    const auto at = [&](std::size_t y, std::size_t x) {
        const std::size_t j = y / unit, i = x / unit;
        const auto is_odd = [](std::size_t n) { return n % 2 == 1; };
        if (name == "ramp") return back + (front - back) * static_cast<float>(x) / static_cast<float>(columns);
        if (name == "stripes") return is_odd(i) ? front : back;
        if (name == "comb") return is_odd(i) || j < 2 ? front : back;
        if (name == "checkerboard") return is_odd(i + j) ? front : back;
        if (name == "spiral") {
            const float dy = static_cast<float>(y) - 0.5F * static_cast<float>(rows),
                        dx = static_cast<float>(x) - 0.5F * static_cast<float>(columns);
            const float turns = std::hypot(dx, dy) / static_cast<float>(unit) + std::atan2(dy, dx) / 3.14159265F + 1.0F;
            return is_odd(static_cast<std::size_t>(turns)) ? front : back;
        }
        if (name == "dots") return is_odd(i) && is_odd(j) ? front : back;
        if (name == "rings") return is_odd((std::min)({y, x, rows - 1 - y, columns - 1 - x}) / unit) ? front : back;
        if (name == "stairs") return back + (front - back) * static_cast<float>(i % 12) / 12.0F;
        if (name == "noise") return cells(j, i);
        return front;
    };
    image<float> map(rows, columns, 1, unset);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) map(y, x) = at(y, x);
    return map;
}

/// Makes a photo of rows x columns x 3 random values.
inline image<std::uint8_t> noisy_photo(std::size_t rows, std::size_t columns) {
    std::mt19937 random(12);
    image<std::uint8_t> photo(rows, columns, 3, unset);
    for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(random());
    return photo;
}

}  // namespace ldi::testing
