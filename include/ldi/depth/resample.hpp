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
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Larger sigmas smooth more noise and lose more thin objects. The defaults were tuned by experiment.
struct resample_options {
    /// Standard deviation of the Gaussian weight over distance, in samples of the disparity map; above 0.
    float spatial_sigma = 1.2F;
    /// Standard deviation of the Gaussian weight over color difference, in gray levels (Euclidean over the three channels);
    /// above 0.
    float color_sigma = 20.0F;
};

namespace detail::resample {

using namespace lanes;

// Radius of the window in samples: 2.5 times the default sigma of 1.2. Weights of samples farther out are below 0.05.
inline constexpr std::size_t radius = 3;
inline constexpr std::size_t samples = (2 * radius + 1) * (2 * radius + 1);

// Samples of a window, sorted by ascending disparity.
struct window {
    struct sample {
        float disparity, x, y, red, green, blue;
    };
    std::size_t count = 0;
    std::array<sample, samples> sorted;
};

// Up to four pixels of the photo: vector instructions process them together.
struct four_pixels {
    std::size_t count = 0;
    std::array<float, wide> x{}, y{};  // positions in samples
    std::array<float, wide> red{}, green{}, blue{};
    std::array<float*, wide> result{};
};

// Returns the first pixel of a row or column that belongs to `sample` or to a later sample. A pixel belongs to the sample that
// contains the pixel's left or upper edge.
inline std::size_t first_pixel(std::size_t sample, std::size_t pixel_count, std::size_t sample_count) {
    return (sample * pixel_count + sample_count - 1) / sample_count;
}

// Averages, for each sample of the map, the colors of the photo's pixels that belong to the sample (first_pixel()).
inline image<float> colors_at_samples(image_view<const std::uint8_t> photo, std::size_t rows, std::size_t columns) {
    image<float> mean(rows, columns, 3, 0.0F);
    buffer<std::size_t> first_column(columns + 1);
    for (std::size_t u = 0; u <= columns; ++u) first_column[u] = first_pixel(u, photo.width(), columns);
    for (std::size_t v = 0; v < rows; ++v) {
        const std::size_t first_row = first_pixel(v, photo.height(), rows), last_row = first_pixel(v + 1, photo.height(), rows);
        for (std::size_t y = first_row; y < last_row; ++y) {
            const std::uint8_t* const from = photo.row(y);
            for (std::size_t u = 0; u < columns; ++u) {
                float* const sum = mean.row(v) + 3 * u;
                float red = sum[0], green = sum[1], blue = sum[2];
                for (std::size_t x = first_column[u]; x < first_column[u + 1]; ++x)
                    red += from[3 * x], green += from[3 * x + 1], blue += from[3 * x + 2];
                sum[0] = red, sum[1] = green, sum[2] = blue;
            }
        }
        for (std::size_t u = 0; u < columns; ++u) {
            const std::size_t count = (last_row - first_row) * (first_column[u + 1] - first_column[u]);
            for (std::size_t c = 0; c < 3; ++c) mean(v, u, c) /= nearest_float(std::max<std::size_t>(count, 1));
        }
    }
    return mean;
}

// Sets each pixel to the value of its nearest sample.
inline image<float> nearest_samples(image_view<const float> disparity, image_view<const std::uint8_t> photo) {
    image<float> result(photo.height(), photo.width(), 1, unset);
    for (std::size_t y = 0; y < photo.height(); ++y) {
        const float* from = disparity.row((2 * y + 1) * disparity.height() / (2 * photo.height()));
        for (std::size_t x = 0; x < photo.width(); ++x)
            result(y, x) = from[(2 * x + 1) * disparity.width() / (2 * photo.width())];
    }
    return result;
}

// Returns for each sample whether the window around it contains an edge.
inline buffer<bool> find_edges(image_view<const float> disparity, surface_rule surface) {
    const std::size_t rows = disparity.height(), columns = disparity.width();
    const auto begin = [](std::size_t at) { return at < radius ? 0 : at - radius; };
    const auto end = [](std::size_t at, std::size_t count) { return (std::min)(at + radius + 1, count); };
    buffer<bool> result(rows * columns);
    buffer<float> low(columns), high(columns);  // per column: extremes over the rows of a window
    for (std::size_t v = 0; v < rows; ++v) {
        std::copy_n(disparity.row(v), columns, low.begin()), std::copy_n(disparity.row(v), columns, high.begin());
        for (std::size_t y = begin(v); y < end(v, rows); ++y) {
            const float* const row = disparity.row(y);
            for (std::size_t u = 0; u < columns; ++u) low[u] = (std::min)(low[u], row[u]), high[u] = (std::max)(high[u], row[u]);
        }
        for (std::size_t u = 0; u < columns; ++u)
            result[v * columns + u] =
                !surface.same_surface(*std::max_element(high.begin() + begin(u), high.begin() + end(u, columns)),
                                      *std::min_element(low.begin() + begin(u), low.begin() + end(u, columns)));
    }
    return result;
}

// Resamples a map that is coarser than the photo. All pixels that belong to one sample use the same window.
class upsampler {
public:
    upsampler(image_view<const float> disparity, image_view<const std::uint8_t> photo, surface_rule surface,
              const resample_options& options)
        : disparity_(disparity),
          photo_(photo),
          surface_(surface),
          colors_(colors_at_samples(photo, disparity.height(), disparity.width())),
          near_edge_(find_edges(disparity, surface)),
          scale_x_(nearest_float(disparity.width()) / nearest_float(photo.width())),
          scale_y_(nearest_float(disparity.height()) / nearest_float(photo.height())),
          spatial_falloff_(0.5F / (options.spatial_sigma * options.spatial_sigma)),
          color_falloff_(0.5F / (options.color_sigma * options.color_sigma)) {}

    // Sets the pixels that belong to the samples of rows [first, last).
    void resample_rows(std::size_t first, std::size_t last, image<float>& result) const {
        interpolate(first_row(first), first_row(last), result);
        window around;
        for (std::size_t v = first; v < last; ++v)
            for (std::size_t u = 0; u < disparity_.width(); ++u) {
                if (!near_edge_[v * disparity_.width() + u]) continue;
                gather(u, v, around);
                four_pixels pixels;
                for (std::size_t y = first_row(v); y < first_row(v + 1); ++y)
                    for (std::size_t x = first_column(u); x < first_column(u + 1); ++x) {
                        const std::uint8_t* const color = photo_.row(y) + 3 * x;
                        const std::size_t i = pixels.count++;
                        pixels.x[i] = sample_x(x), pixels.y[i] = sample_y(y), pixels.result[i] = &result(y, x);
                        pixels.red[i] = color[0], pixels.green[i] = color[1], pixels.blue[i] = color[2];
                        if (pixels.count == wide) set_medians(around, pixels), pixels.count = 0;
                    }
                if (pixels.count > 0) set_medians(around, pixels);
            }
    }

private:
    std::size_t first_row(std::size_t v) const { return first_pixel(v, photo_.height(), disparity_.height()); }
    std::size_t first_column(std::size_t u) const { return first_pixel(u, photo_.width(), disparity_.width()); }

    // Position of a pixel's center in the map, in samples from the center of the first sample: from -0.5 to the number of samples
    // minus 0.5.
    float sample_x(std::size_t x) const { return (nearest_float(x) + 0.5F) * scale_x_ - 0.5F; }
    float sample_y(std::size_t y) const { return (nearest_float(y) + 0.5F) * scale_y_ - 0.5F; }

    // Collects the window around a sample. Samples of equal disparity keep their order, because sums of floats depend on the
    // order.
    void gather(std::size_t u, std::size_t v, window& around) const {
        std::array<window::sample, samples> found;
        std::array<float, samples> disparity;
        std::array<std::int32_t, samples> rank{};  // number of samples before each sample in sorted order
        std::size_t count = 0;
        const std::size_t y_end = (std::min)(v + radius + 1, disparity_.height()),
                          x_end = (std::min)(u + radius + 1, disparity_.width());
        for (std::size_t y = v < radius ? 0 : v - radius; y < y_end; ++y)
            for (std::size_t x = u < radius ? 0 : u - radius; x < x_end; ++x, ++count) {
                disparity[count] = disparity_(y, x);
                found[count] = {disparity[count], nearest_float(x), nearest_float(y),
                                colors_(y, x, 0), colors_(y, x, 1), colors_(y, x, 2)};
            }
        for (std::size_t s = 0; s < count; ++s) {  // without branches, so that the compiler can vectorize the loop
            std::int32_t before = 0;
            for (std::size_t t = s + 1; t < count; ++t) {
                const std::int32_t is_first = disparity[s] <= disparity[t] ? 1 : 0;
                rank[t] += is_first, before += 1 - is_first;
            }
            rank[s] += before;
        }
        for (std::size_t s = 0; s < count; ++s) around.sorted[static_cast<std::size_t>(rank[s])] = found[s];
        around.count = count;
    }

    // Sets pixels to the weighted median of a window, smoothed by a weighted mean over the samples on the median's surface.
    // Approximates exp(-e) by (1 - e/32 + e^2/2048)^32.
    void set_medians(const window& around, const four_pixels& pixels) const noexcept {
        const four_floats x = load(pixels.x.data()), y = load(pixels.y.data()), red = load(pixels.red.data()),
                          green = load(pixels.green.data()), blue = load(pixels.blue.data());
        const four_floats zero{}, one = zero + 1.0F;
        std::array<four_floats, samples> weight;
        four_floats total = zero;
        for (std::size_t s = 0; s < around.count; ++s) {
            const window::sample& n = around.sorted[s];
            const four_floats dx = n.x - x, dy = n.y - y, dr = n.red - red, dg = n.green - green, db = n.blue - blue;
            const four_floats exponent = spatial_falloff_ * (dx * dx + dy * dy) + color_falloff_ * (dr * dr + dg * dg + db * db);
            const four_floats a = smaller(exponent * (1.0F / 32.0F), one);
            four_floats w = one - a + 0.5F * a * a;
            w *= w, w *= w, w *= w, w *= w, w *= w;
            weight[s] = w, total += w;
        }
        four_floats sum = zero, before = zero;  // before: number of samples before the median
        for (std::size_t s = 0; s + 1 < around.count; ++s) {
            sum += weight[s];
            before += select(sum < 0.5F * total, one, zero);
        }
        four_floats median = zero;
        for (std::size_t i = 0; i < wide; ++i) median[i] = around.sorted[static_cast<std::size_t>(before[i])].disparity;
        four_floats mean = zero, share = zero;
        for (std::size_t s = 0; s < around.count; ++s) {
            const four_floats step = around.sorted[s].disparity - median;
            const auto is_other = larger(step, -step) > zero + surface_.max_step;
            mean += select(is_other, zero, weight[s] * around.sorted[s].disparity);
            share += select(is_other, zero, weight[s]);
        }
        const four_floats smoothed = mean / share;
        for (std::size_t i = 0; i < pixels.count; ++i) *pixels.result[i] = smoothed[i];
    }

    // Interpolates the map bilinearly at the pixels of rows [first, last).
    void interpolate(std::size_t first, std::size_t last, image<float>& result) const {
        const std::size_t width = photo_.width();
        buffer<float> above(width, unset), below(width, unset);
        std::ptrdiff_t row_above = -3;  // the map's row in `above`; the next one is in `below`
        for (std::size_t y = first; y < last; ++y) {
            const float at = sample_y(y), floor = std::floor(at), share = at - floor;
            const std::ptrdiff_t v = static_cast<std::ptrdiff_t>(floor);
            if (v != row_above) {
                if (v == row_above + 1)
                    above.swap(below);
                else
                    interpolate_row(v, above);
                interpolate_row(v + 1, below);
                row_above = v;
            }
            float* const to = result.row(y);
            for (std::size_t x = 0; x < width; ++x) to[x] = (1.0F - share) * above[x] + share * below[x];
        }
    }
    // Interpolates one row of the map at the columns of the photo. Rows outside the map repeat its first or last row.
    void interpolate_row(std::ptrdiff_t v, buffer<float>& result) const {
        const float* const row = disparity_.row(clamped(v, disparity_.height()));
        for (std::size_t x = 0; x < result.size(); ++x) {
            const float at = sample_x(x), floor = std::floor(at), share = at - floor;
            const std::ptrdiff_t u = static_cast<std::ptrdiff_t>(floor);
            result[x] = (1.0F - share) * row[clamped(u, disparity_.width())] + share * row[clamped(u + 1, disparity_.width())];
        }
    }
    static std::ptrdiff_t clamped(std::ptrdiff_t i, std::size_t count) {
        return std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1);
    }

    image_view<const float> disparity_;
    image_view<const std::uint8_t> photo_;
    surface_rule surface_;
    image<float> colors_;
    buffer<bool> near_edge_;
    float scale_x_, scale_y_, spatial_falloff_, color_falloff_;
};

}  // namespace detail::resample

/// Resamples a disparity map to the photo's resolution. Returns H x W x 1.
///
/// disparity  h x w x 1, in [0, 1]
/// photo      H x W x 3, of the same view
/// surface    rule that decides whether neighboring samples belong to one surface
///
/// Interpolates bilinearly where the map has no edge within three samples. Next to an edge, a pixel gets the weighted median of
/// the 7 x 7 samples around it, weighted by distance and color similarity, and then smoothed over the samples on the median's
/// surface. If the map is at least as fine as the photo, each pixel gets its nearest sample instead. Raises mismatch for empty
/// images or wrong numbers of channels, invalid_data for disparities that are not finite, invalid_option if a sigma is not
/// above 0. Linear time; 4 bytes per pixel and 16 per sample.
template <executor Executor = const serial_executor>
image<float> resample_to_photo(image_view<const float> disparity, image_view<const std::uint8_t> photo, surface_rule surface = {},
                               const resample_options& options = {}, Executor&& threads = {}) {
    using namespace detail::resample;
    const std::size_t rows = disparity.height(), columns = disparity.width();
    if (disparity.empty() || photo.empty() || disparity.channels() != 1 || photo.channels() != 3)
        raise(error_code::mismatch, "resample", "a disparity map h x w x 1 and a photo H x W x 3",
              detail::shape_text(disparity) + " and " + detail::shape_text(photo));
    detail::check_finite(disparity, "resample");
    if (!(options.spatial_sigma > 0.0F) || !(options.color_sigma > 0.0F))
        raise(error_code::invalid_option, "resample_options", "sigmas above 0",
              detail::to_text(options.spatial_sigma) + " and " + detail::to_text(options.color_sigma));
    if (rows == photo.height() && columns == photo.width()) return image<float>(disparity);
    if (rows >= photo.height() && columns >= photo.width()) return nearest_samples(disparity, photo);
    image<float> result(photo.height(), photo.width(), 1, unset);
    const upsampler upsample(disparity, photo, surface, options);
    parallel_for(threads, rows, 4, [&](std::size_t first, std::size_t last) { upsample.resample_rows(first, last, result); });
    return result;
}

}}  // namespace ldi
