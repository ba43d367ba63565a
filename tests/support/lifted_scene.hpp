// Disparity maps for tests of hidden surfaces: random maps, and lifting without colors.
#pragma once

#include <ldi/core/photo_facts.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace ldi::testing {

inline photo_layer lift_disparity(const image<float>& disparity) {
    return lift(image<std::uint8_t>(disparity.height(), disparity.width(), 3, std::uint8_t{100}), disparity);
}

/// Returns the layer as a layered image without hidden surfaces.
inline photo_layers lifted_layers(const image<float>& disparity) { return expand(lift_disparity(disparity), {}, {}).layers; }

/// A phone's main camera.
inline photo_facts facts_of(const graph_view& g) {
    photo_facts facts;
    facts.camera = {g.width(), g.height(), focal_length_from_35mm(26.0F, g.width(), g.height())};
    return facts;
}

/// A slanted background with discs, bars and half planes in front of it, each flat or slanted.
inline image<float> random_disparity(std::mt19937& random, std::size_t rows, std::size_t columns) {
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    image<float> map(rows, columns);
    const float slope = 0.15F * unit(random) / static_cast<float>(rows);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) map(y, x, 0) = 0.05F + slope * static_cast<float>(y);
    const int count = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < count; ++i) {
        const float x0 = unit(random) * static_cast<float>(columns), y0 = unit(random) * static_cast<float>(rows);
        const float size = 2.0F + unit(random) * 0.4F * static_cast<float>(std::max(rows, columns)), angle = 6.28F * unit(random);
        const float value = 0.15F + 0.8F * unit(random), tilt = unit(random) < 0.5F ? 0.0F : 0.01F * unit(random);
        const int kind = static_cast<int>(random() % 3);
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x) {
                const float dx = static_cast<float>(x) - x0, dy = static_cast<float>(y) - y0;
                const float along = dx * std::cos(angle) + dy * std::sin(angle),
                            across = dy * std::cos(angle) - dx * std::sin(angle);
                const bool inside = kind == 0   ? std::hypot(dx, dy) < 0.6F * size
                                    : kind == 1 ? std::abs(along) < size && std::abs(across) < 0.15F * size
                                                : along > 0.0F && across > 0.0F;
                const float here = std::clamp(value + tilt * along, 0.0F, 1.0F);
                if (inside && here > map(y, x, 0)) map(y, x, 0) = here;
            }
    }
    return map;
}

}  // namespace ldi::testing
