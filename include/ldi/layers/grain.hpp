// Grain for what is inpainted. Of a colour that can't be known an inpainter says the mean of what it might be, and that is
// smooth: beside sand, leaves or film it shows as a blur. So noise is laid over it, as strong as what is fine in the photo
// around; video codecs do the same ("film grain synthesis" of AV1). Where the photo is smooth, a sky, next to nothing is added.
// Not in the paper.
//
// The strength is measured at the known pixels next to unknown ones: how far a pixel's brightness is from the mean of its known
// neighbours. It diffuses over the links of the layered image into what is unknown; more exactly, its square root does, so that a
// few edges among smooth pixels count for little. The noise depends on a pixel's position alone: a result is always the same.
#pragma once

#include <ldi/core/error.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/layers/detail/diffuse_unknown.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ldi {

struct grain_options {
    /// Relative to the photo around; 0: no grain. 1 is as strong, but less looks better: a photo's own texture isn't noise.
    float strength = 0.75F;
    /// The strongest grain, of 255: what differs more from its neighbours is an edge.
    float limit = 16.0F;
    /// Gauss-Seidel rounds on each level of the diffusion.
    int rounds = 4;
};

namespace detail {

/// Noise of a position: mean 0, variance 1, close to normal, independent of every other position's.
inline float grain_at(std::int32_t x, std::int32_t y) {
    // the finaliser of MurmurHash3 (Austin Appleby, public domain)
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1U ^ static_cast<std::uint32_t>(y) * 0x85EBCA77U;
    h = (h ^ h >> 16) * 0x85EBCA6BU;
    h = (h ^ h >> 13) * 0xC2B2AE35U;
    h ^= h >> 16;
    const float sum = static_cast<float>((h & 255) + (h >> 8 & 255) + (h >> 16 & 255) + (h >> 24));  // of four dice
    return (sum - 510.0F) / 147.8F;
}

inline float brightness(const std::uint8_t* colour) {
    return 0.299F * static_cast<float>(colour[0]) + 0.587F * static_cast<float>(colour[1]) +
           0.114F * static_cast<float>(colour[2]);
}

/// How far a known pixel's brightness is from the mean of its known neighbours; 0 without any.
inline float fine_detail(const photo_layers& layers, std::int32_t pixel) {
    const std::vector<std::uint8_t>& known = layers.column<known_column>();
    float sum = 0.0F, count = 0.0F;
    for (const side s : all_sides) {
        const std::int32_t neighbour = layers.topology.neighbour(pixel, s);
        if (neighbour == no_pixel || known[static_cast<std::size_t>(neighbour)] == 0) continue;
        sum += brightness(layers.at<colour_column>(neighbour).data());
        count += 1.0F;
    }
    return count > 0.0F ? std::abs(brightness(layers.at<colour_column>(pixel).data()) - sum / count) : 0.0F;
}

}  // namespace detail

/// Lays grain over every pixel whose known_column is 0; all others stay as they are.
///
/// layers  in canonical order, with a colour everywhere
///
/// Errors: invalid_option for a strength or a limit that is negative or not finite.
inline void add_grain(photo_layers& layers, const grain_options& options = {}) {
    if (!(options.strength >= 0.0F && std::isfinite(options.strength) && options.limit >= 0.0F && std::isfinite(options.limit)))
        raise(error_code::invalid_option, "grain_options", "a strength and a limit of at least 0",
              std::to_string(options.strength) + " and " + std::to_string(options.limit));
    if (options.strength == 0.0F || options.limit == 0.0F) return;
    const graph& g = layers.topology;
    std::array<std::uint8_t, 3> root;
    detail::diffuse_unknown(
        g, layers.column<known_column>(), options.rounds,
        [&](std::int32_t pixel) {
            const float part = std::min(detail::fine_detail(layers, pixel) / options.limit, 1.0F);
            root.fill(static_cast<std::uint8_t>(std::lround(255.0F * std::sqrt(part))));
            return root.data();
        },
        [&](std::int32_t pixel, const diffusion::colour_type& diffused) {
            const float part = diffused[0] / 255.0F;
            const std::size_t i = static_cast<std::size_t>(pixel);
            const float grain = options.strength * options.limit * part * part * detail::grain_at(g.x[i], g.y[i]);
            for (std::uint8_t& value : layers.at<colour_column>(pixel))
                value = static_cast<std::uint8_t>(std::lround(std::clamp(static_cast<float>(value) + grain, 0.0F, 255.0F)));
        });
}

}  // namespace ldi
