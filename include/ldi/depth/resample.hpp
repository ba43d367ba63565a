// Resamples a disparity map from the depth network's resolution to the photo's, so that depth edges coincide with color edges:
// joint bilateral upsampling (Kopf et al., "Joint Bilateral Upsampling", SIGGRAPH 2007). Next to depth edges, the weighted
// median replaces the weighted mean, so that no values between the two sides appear.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/four_floats.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Larger sigmas smooth more noise and lose more thin objects. The defaults were tuned by experiment.
struct resample_options {
    /// Standard deviation of the Gaussian on distance, in samples of the disparity map.
    float spatial_sigma = 1.2F;
    /// Standard deviation of the Gaussian on color difference, in gray levels (Euclidean over the three channels).
    float color_sigma = 20.0F;
};

namespace detail::resample {

using namespace lanes;

// Radius of the window in samples: 2.5 times the default sigma of 1.2. Weights of samples farther out are below 0.05.
inline constexpr std::size_t radius = 3;
inline constexpr std::size_t samples = (2 * radius + 1) * (2 * radius + 1);
inline constexpr std::size_t padded = (samples + wide - 1) / wide * wide;

// Samples of a window, sorted by ascending disparity.
struct window {
    std::size_t count = 0;
    std::array<float, padded> disparity, x, y, red, green, blue;

    // Computes weights from distance and color similarity. exp(-a) is approximated by (1 - a/32 + a^2/2048)^32.
    void weigh(float at_x, float at_y, const std::uint8_t* color, float spatial_falloff, float color_falloff,
               std::array<float, padded>& weight) const {
        const float r = color[0], g = color[1], b = color[2];
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

// Averages the colors of the photo's pixels whose centers fall on each sample of the map.
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
            for (std::size_t c = 0; c < 3; ++c) mean.data()[3 * i + c] += from[3 * x + c];
            count[i] += 1.0F;
        }
    }
    for (std::size_t i = 0; i < count.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) mean.data()[3 * i + c] /= (std::max)(count[i], 1.0F);
    return mean;
}

// Assigns to each pixel its nearest sample.
inline image<float> nearest_samples(image_view<const float> disparity, image_view<const std::uint8_t> photo) {
    image<float> result(photo.height(), photo.width(), 1, unset);
    for (std::size_t y = 0; y < photo.height(); ++y) {
        const float* from = disparity.row((2 * y + 1) * disparity.height() / (2 * photo.height()));
        for (std::size_t x = 0; x < photo.width(); ++x)
            result(y, x) = from[(2 * x + 1) * disparity.width() / (2 * photo.width())];
    }
    return result;
}

// Resamples a map that is coarser than the photo. All pixels nearest to one sample use the same window.
class upsampler {
public:
    upsampler(image_view<const float> disparity, image_view<const std::uint8_t> photo, surface_rule surface,
              const resample_options& options)
        : disparity_(disparity),
          photo_(photo),
          surface_(surface),
          colors_(colors_at_samples(photo, disparity.height(), disparity.width())),
          scale_x_(nearest_float(disparity.width()) / nearest_float(photo.width())),
          scale_y_(nearest_float(disparity.height()) / nearest_float(photo.height())),
          spatial_falloff_(0.5F / (options.spatial_sigma * options.spatial_sigma)),
          color_falloff_(0.5F / (options.color_sigma * options.color_sigma)) {}

    // Sets the pixels nearest to the samples of rows [first, last).
    void resample_rows(std::size_t first, std::size_t last, image<float>& result) const {
        std::array<float, padded> weight;
        window around{};
        for (std::size_t v = first; v < last; ++v)
            for (std::size_t u = 0; u < disparity_.width(); ++u) {
                const bool near_edge = gather(u, v, around);
                const std::size_t y_end = first_pixel(v + 1, photo_.height(), disparity_.height()),
                                  x_end = first_pixel(u + 1, photo_.width(), disparity_.width());
                for (std::size_t y = first_pixel(v, photo_.height(), disparity_.height()); y < y_end; ++y)
                    for (std::size_t x = first_pixel(u, photo_.width(), disparity_.width()); x < x_end; ++x) {
                        const float at_x = (nearest_float(x) + 0.5F) * scale_x_ - 0.5F,
                                    at_y = (nearest_float(y) + 0.5F) * scale_y_ - 0.5F;
                        if (near_edge) {
                            around.weigh(at_x, at_y, photo_.row(y) + 3 * x, spatial_falloff_, color_falloff_, weight);
                            result(y, x) = smoothed_median(around, weight);
                        } else {
                            result(y, x) = bilinear(at_x, at_y);
                        }
                    }
            }
    }

private:
    // Returns the first pixel of a row or column whose nearest sample is `sample` or a later one.
    static std::size_t first_pixel(std::size_t sample, std::size_t pixel_count, std::size_t sample_count) {
        return (sample * pixel_count + sample_count - 1) / sample_count;
    }

    // Collects the window around a sample if it contains an edge. If it does not, returns false and leaves `around` unspecified.
    bool gather(std::size_t u, std::size_t v, window& around) const {
        struct neighbor {
            float disparity;
            std::size_t x, y;
        };
        std::array<neighbor, samples> nearest;
        around.count = 0;
        float low = disparity_(v, u), high = low;
        const std::size_t y_end = (std::min)(v + radius + 1, disparity_.height()),
                          x_end = (std::min)(u + radius + 1, disparity_.width());
        for (std::size_t y = v < radius ? 0 : v - radius; y < y_end; ++y)
            for (std::size_t x = u < radius ? 0 : u - radius; x < x_end; ++x) {
                const float d = disparity_(y, x);
                nearest[around.count++] = {d, x, y};
                low = (std::min)(low, d), high = (std::max)(high, d);
            }
        if (surface_.same_surface(high, low)) return false;
        // Equal disparities in the order of their samples: sums of floats depend on it, and std::sort() on the library.
        std::sort(nearest.data(), nearest.data() + around.count, [](const neighbor& a, const neighbor& b) {
            if (a.disparity != b.disparity) return a.disparity < b.disparity;
            return a.y != b.y ? a.y < b.y : a.x < b.x;
        });
        for (std::size_t s = 0; s < around.count; ++s) {
            const neighbor& n = nearest[s];
            around.disparity[s] = n.disparity, around.x[s] = nearest_float(n.x), around.y[s] = nearest_float(n.y);
            around.red[s] = colors_(n.y, n.x, 0), around.green[s] = colors_(n.y, n.x, 1), around.blue[s] = colors_(n.y, n.x, 2);
        }
        return true;
    }

    // Computes the weighted median of a window, smoothed by a weighted mean over the samples of its surface.
    float smoothed_median(const window& around, const std::array<float, padded>& weight) const {
        float total = 0.0F;
        for (std::size_t s = 0; s < around.count; ++s) total += weight[s];
        std::size_t median = 0;
        for (float sum = weight[0]; sum < 0.5F * total && median + 1 < around.count;) sum += weight[++median];
        float mean = 0.0F, share = 0.0F;
        for (std::size_t s = 0; s < around.count; ++s)
            if (surface_.same_surface(around.disparity[s], around.disparity[median])) {
                mean += weight[s] * around.disparity[s];
                share += weight[s];
            }
        return mean / share;
    }

    // Interpolates the map bilinearly at (x, y), in samples. The position may lie up to one sample outside the map.
    float bilinear(float x, float y) const {
        const float floor_x = std::floor(x), floor_y = std::floor(y);
        const std::ptrdiff_t i = static_cast<std::ptrdiff_t>(floor_x), j = static_cast<std::ptrdiff_t>(floor_y);
        const float* above = disparity_.row(clamped(j, disparity_.height()));
        const float* below = disparity_.row(clamped(j + 1, disparity_.height()));
        const std::ptrdiff_t left = clamped(i, disparity_.width()), right = clamped(i + 1, disparity_.width());
        const float fx = x - floor_x, fy = y - floor_y;
        return (1.0F - fy) * ((1.0F - fx) * above[left] + fx * above[right]) +
               fy * ((1.0F - fx) * below[left] + fx * below[right]);
    }
    static std::ptrdiff_t clamped(std::ptrdiff_t i, std::size_t count) {
        return std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1);
    }

    image_view<const float> disparity_;
    image_view<const std::uint8_t> photo_;
    surface_rule surface_;
    image<float> colors_;
    float scale_x_, scale_y_, spatial_falloff_, color_falloff_;
};

}  // namespace detail::resample

/// Resamples a disparity map to the photo's resolution. Returns H x W x 1.
///
/// disparity  h x w x 1, in [0, 1]
/// photo      H x W x 3, of the same view
///
/// Interpolates bilinearly where the map has no edge within three samples. Next to an edge, a pixel gets the weighted median of
/// the 7 x 7 samples around it, weighted by distance and color similarity, and smoothed over the samples on the median's side.
/// Point-samples maps at least as fine as the photo. Raises error_code::mismatch for empty images or other numbers of channels,
/// error_code::invalid_option if a sigma is not above 0. Linear time; 4 bytes per pixel and 16 per sample.
template <executor Executor = const serial_executor>
image<float> resample_to_photo(image_view<const float> disparity, image_view<const std::uint8_t> photo, surface_rule surface = {},
                               const resample_options& options = {}, Executor&& threads = {}) {
    using namespace detail::resample;
    const std::size_t rows = disparity.height(), columns = disparity.width();
    if (disparity.empty() || photo.empty() || disparity.channels() != 1 || photo.channels() != 3)
        raise(error_code::mismatch, "resample", "a disparity map h x w x 1 and a photo H x W x 3",
              detail::shape_text(disparity) + " and " + detail::shape_text(photo));
    if (!(options.spatial_sigma > 0.0F) || !(options.color_sigma > 0.0F))
        raise(error_code::invalid_option, "resample_options", "sigmas above 0",
              detail::to_text(options.spatial_sigma) + " and " + detail::to_text(options.color_sigma));
    if (rows >= photo.height() && columns >= photo.width()) return nearest_samples(disparity, photo);
    image<float> result(photo.height(), photo.width(), 1, unset);
    const upsampler upsample(disparity, photo, surface, options);
    parallel_for(threads, rows, 4, [&](std::size_t first, std::size_t last) { upsample.resample_rows(first, last, result); });
    return result;
}

}}  // namespace ldi
