// Brings a disparity map from the depth network's resolution to the photo's, so that depth edges sit on color edges: joint
// bilateral upsampling (Kopf et al., "Joint Bilateral Upsampling", SIGGRAPH 2007), with the weighted median in place of the
// weighted mean next to depth edges, so that no values appear between the two sides.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/four_floats.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi {

struct resample_options {
    /// Standard deviation of the Gaussian on distance, in samples of the disparity map.
    float spatial_sigma = 1.2F;
    /// Standard deviation of the Gaussian on color difference, in gray levels (Euclidean over the three channels).
    float color_sigma = 20.0F;
};

namespace detail::resample {

using namespace lanes;

inline constexpr int radius = 3;
inline constexpr std::size_t samples = (2 * radius + 1) * (2 * radius + 1);
inline constexpr std::size_t padded = (samples + wide - 1) / wide * wide;

// The samples round one of them, by ascending disparity.
struct window {
    std::size_t count = 0;
    std::array<float, padded> disparity, x, y, red, green, blue;

    // Weights by distance and by likeness in color. exp(-a) is taken as (1 - a/32 + a^2/2048)^32.
    void weigh(float at_x, float at_y, const std::uint8_t* color, float spatial_falloff, float color_falloff,
               std::array<float, padded>& weight) const {
        const float r = static_cast<float>(color[0]), g = static_cast<float>(color[1]), b = static_cast<float>(color[2]);
        const four_floats one = four_floats{} + 1.0F;
        for (std::size_t s = 0; s < count; s += wide) {
            const four_floats dx = load(&x[s]) - at_x, dy = load(&y[s]) - at_y;
            const four_floats dr = load(&red[s]) - r, dg = load(&green[s]) - g, db = load(&blue[s]) - b;
            const four_floats exponent = spatial_falloff * (dx * dx + dy * dy) + color_falloff * (dr * dr + dg * dg + db * db);
            const four_floats a = smaller(exponent * (1.0F / 32.0F), one);
            four_floats w = one - a + 0.5F * a * a;
            w *= w, w *= w, w *= w, w *= w, w *= w;
            store(&weight[s], w);
        }
    }
};

// The mean color of the photo's pixels whose centers fall on each sample of the map.
inline image<float> colors_at_samples(image_view<const std::uint8_t> photo, std::size_t rows, std::size_t columns) {
    image<float> mean(rows, columns, 3, 0.0F);
    buffer<float> count(rows * columns, 0.0F);
    buffer<std::size_t> sample_column(photo.width());
    for (std::size_t x = 0; x < photo.width(); ++x) sample_column[x] = x * columns / photo.width();
    for (std::size_t y = 0; y < photo.height(); ++y) {
        const std::uint8_t* from = photo.row(y);
        const std::size_t v = y * rows / photo.height();
        for (std::size_t x = 0; x < photo.width(); ++x) {
            const std::size_t i = v * columns + sample_column[x];
            for (std::size_t c = 0; c < 3; ++c) mean.data()[3 * i + c] += static_cast<float>(from[3 * x + c]);
            count[i] += 1.0F;
        }
    }
    for (std::size_t i = 0; i < count.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) mean.data()[3 * i + c] /= (std::max)(count[i], 1.0F);
    return mean;
}

}  // namespace detail::resample

/// disparity  h x w x 1, in [0, 1]
/// photo      H x W x 3, of the same view
///
/// H x W x 1. Where the map has no edge within three samples it is interpolated bilinearly; next to an edge a pixel takes the
/// weighted median of the 7 x 7 samples round it, weighted by distance and by likeness in color, smoothed over the samples on
/// the median's side. A map at least as fine as the photo is point-sampled instead. Raises error_code::mismatch if there is
/// no pixel or the channels are others, error_code::invalid_option if a sigma is not above 0.
template <executor Executor = const serial_executor>
image<float> resample_to_photo(image_view<const float> disparity, image_view<const std::uint8_t> photo, surface_rule surface = {},
                               const resample_options& options = {}, Executor&& threads = {}) {
    using namespace detail::resample;
    const std::size_t rows = disparity.height(), columns = disparity.width();
    if (disparity.empty() || photo.empty() || disparity.channels() != 1 || photo.channels() != 3)
        raise(error_code::mismatch, "resample", "a disparity map h x w x 1 and a photo H x W x 3",
              std::to_string(rows) + " x " + std::to_string(columns) + " x " + std::to_string(disparity.channels()) + " and " +
                  std::to_string(photo.height()) + " x " + std::to_string(photo.width()) + " x " +
                  std::to_string(photo.channels()));
    if (!(options.spatial_sigma > 0.0F) || !(options.color_sigma > 0.0F))
        raise(error_code::invalid_option, "resample_options", "sigmas above 0",
              std::to_string(options.spatial_sigma) + " and " + std::to_string(options.color_sigma));
    image<float> result(photo.height(), photo.width(), 1, unset);
    if (rows >= photo.height() && columns >= photo.width()) {
        for (std::size_t y = 0; y < photo.height(); ++y) {
            const float* from = disparity.row((2 * y + 1) * rows / (2 * photo.height()));
            for (std::size_t x = 0; x < photo.width(); ++x) result.row(y)[x] = from[(2 * x + 1) * columns / (2 * photo.width())];
        }
        return result;
    }

    const image<float> colors = colors_at_samples(photo, rows, columns);
    const float scale_x = static_cast<float>(columns) / static_cast<float>(photo.width());
    const float scale_y = static_cast<float>(rows) / static_cast<float>(photo.height());
    const float spatial_falloff = 0.5F / (options.spatial_sigma * options.spatial_sigma);
    const float color_falloff = 0.5F / (options.color_sigma * options.color_sigma);
    const auto clamped = [](std::ptrdiff_t i, std::size_t count) {
        return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1));
    };

    // All pixels nearest to one row of samples share their windows.
    parallel_for(threads, rows, 4, [&](std::size_t first, std::size_t last) {
        struct neighbor {
            float disparity;
            std::ptrdiff_t x, y;
        };
        std::array<neighbor, samples> nearest;
        std::array<float, padded> weight;
        window around{};
        for (std::size_t v = first; v < last; ++v)
            for (std::size_t u = 0; u < columns; ++u) {
                around.count = 0;
                float low = disparity.row(v)[u], high = low;
                for (int dv = -radius; dv <= radius; ++dv)
                    for (int du = -radius; du <= radius; ++du) {
                        const std::ptrdiff_t y = static_cast<std::ptrdiff_t>(v) + dv, x = static_cast<std::ptrdiff_t>(u) + du;
                        if (y < 0 || x < 0 || y >= static_cast<std::ptrdiff_t>(rows) || x >= static_cast<std::ptrdiff_t>(columns))
                            continue;
                        const float d = disparity.row(static_cast<std::size_t>(y))[x];
                        nearest[around.count++] = {d, x, y};
                        low = (std::min)(low, d), high = (std::max)(high, d);
                    }
                const bool near_edge = !surface.same_surface(high, low);
                if (near_edge) {
                    std::sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(around.count),
                              [](const neighbor& a, const neighbor& b) { return a.disparity < b.disparity; });
                    for (std::size_t s = 0; s < around.count; ++s) {
                        const neighbor& n = nearest[s];
                        const float* c = colors.row(static_cast<std::size_t>(n.y)) + 3 * n.x;
                        around.disparity[s] = n.disparity, around.x[s] = static_cast<float>(n.x),
                        around.y[s] = static_cast<float>(n.y);
                        around.red[s] = c[0], around.green[s] = c[1], around.blue[s] = c[2];
                    }
                }

                const std::size_t y_end = ((v + 1) * photo.height() + rows - 1) / rows,
                                  x_end = ((u + 1) * photo.width() + columns - 1) / columns;
                for (std::size_t y = (v * photo.height() + rows - 1) / rows; y < y_end; ++y)
                    for (std::size_t x = (u * photo.width() + columns - 1) / columns; x < x_end; ++x) {
                        const float at_x = (static_cast<float>(x) + 0.5F) * scale_x - 0.5F,
                                    at_y = (static_cast<float>(y) + 0.5F) * scale_y - 0.5F;
                        if (!near_edge) {
                            const float floor_x = std::floor(at_x), floor_y = std::floor(at_y);
                            const std::ptrdiff_t i = static_cast<std::ptrdiff_t>(floor_x),
                                                 j = static_cast<std::ptrdiff_t>(floor_y);
                            const float* above = disparity.row(clamped(j, rows));
                            const float* below = disparity.row(clamped(j + 1, rows));
                            const std::size_t left = clamped(i, columns), right = clamped(i + 1, columns);
                            const float fx = at_x - floor_x, fy = at_y - floor_y;
                            result.row(y)[x] = (1.0F - fy) * ((1.0F - fx) * above[left] + fx * above[right]) +
                                               fy * ((1.0F - fx) * below[left] + fx * below[right]);
                            continue;
                        }
                        around.weigh(at_x, at_y, photo.row(y) + 3 * x, spatial_falloff, color_falloff, weight);
                        float total = 0.0F;
                        for (std::size_t s = 0; s < around.count; ++s) total += weight[s];
                        std::size_t median = 0;
                        for (float sum = weight[0]; sum < 0.5F * total && median + 1 < around.count;) sum += weight[++median];
                        float mean = 0.0F, share = 0.0F;
                        for (std::size_t s = 0; s < around.count; ++s)
                            if (surface.same_surface(around.disparity[s], around.disparity[median])) {
                                mean += weight[s] * around.disparity[s];
                                share += weight[s];
                            }
                        result.row(y)[x] = mean / share;
                    }
            }
    });
    return result;
}

}  // namespace ldi
