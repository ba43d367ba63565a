// Finds the pixels beside the sharp steps of a disparity map, for the silhouette network. The network reads the pixels of a
// region, and assigns those of a narrower band to the front or the back. A step is described by a curve of pixels, each with a
// front and a back disparity. step_band stores the nearest curve pixel for each pixel of the region.
// examples/training/silhouettes/README.md defines the same band and region for training.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The network was trained with the defaults.
struct step_band_options {
    float max_step = 0.02F;  ///< neighbors that differ by more than this are separated by a step
    float min_step = 0.06F;  ///< minimum difference between the front and back of a curve pixel
};

/// Radius of the disk, in pixels, whose extreme disparities are the front and back of a curve pixel.
inline constexpr std::int32_t step_sides_radius = 4;
/// Maximum distance from a curve, in pixels, of the pixels that the network decides.
inline constexpr std::int32_t step_band_radius = 12;
/// Maximum distance from a curve, in pixels, of the pixels that the network reads.
inline constexpr std::int32_t step_region_radius = 16;

/// Pixels within step_region_radius of a curve.
struct step_band {
    struct sides {
        float front, back;  ///< disparity of the nearer and the farther surface
    };

    pixel_region region;                      ///< K pixels
    buffer<std::uint16_t> squared_distances;  ///< K: squared distance to the nearest curve pixel, 0 to 256
    buffer<std::int32_t> curve_pixels;        ///< K: index of the nearest curve pixel in `curve`
    buffer<sides> curve;                      ///< front and back of each curve pixel, row by row
    float min_step = 0;

    bool is_decided(std::int32_t pixel) const { return squared_distances[pixel] <= step_band_radius * step_band_radius; }
    const sides& sides_of(std::int32_t pixel) const { return curve[curve_pixels[pixel]]; }
    /// Returns the position of a disparity between back (0) and front (1), not clamped.
    float share(std::int32_t pixel, float disparity) const {
        const sides& s = sides_of(pixel);
        return (disparity - s.back) / (std::max)(s.front - s.back, min_step);
    }
};

/// Finds the band of a disparity map.
///
/// disparity  H x W x 1, finite
///
/// A pixel lies on a curve if its disparity and that of a neighbor differ by more than max_step, and if the extreme disparities
/// within step_sides_radius differ by at least min_step. Distances are Euclidean and exact. If several curve pixels are equally
/// near, the leftmost one counts, or the upper one of two in the same column. Linear time: up to 33 operations on 16-bit
/// numbers per pixel within step_region_radius rows and columns of a curve. Memory is 6 bytes per pixel, and 20 per pixel of
/// the region. Raises mismatch for another number of channels, invalid_data for values that are not finite, invalid_option for
/// a max_step below 0 or a min_step of 0 or less, too_large for 2^31 pixels or more.
step_band find_step_band(image_view<const float> disparity, const step_band_options& options = {});

namespace detail {

class step_band_finder {
public:
    step_band_finder(image_view<const float> disparity, const step_band_options& options)
        : disparity_(disparity),
          options_(options),
          width_(static_cast<std::int32_t>(disparity.width())),
          height_(static_cast<std::int32_t>(disparity.height())),
          below_(disparity.height(), disparity.width(), 1, unset),
          number_(disparity.height() * disparity.width(), unset),
          region_(width_) {
        band_.min_step = options.min_step;
    }

    step_band run() {
        find_curves();
        measure_below();
        measure_rows();
        band_.region = std::move(region_).build();
        return std::move(band_);
    }

private:
    static constexpr std::int32_t radius = step_region_radius;
    static constexpr std::uint8_t beyond = radius + 1;
    /// A key combines the squared distance and the column of a curve pixel in one number, so that one minimum finds both.
    static constexpr std::int32_t column_bits = 6;
    static constexpr std::uint16_t far_key = 49000;  // no curve pixel nearby

    void find_curves() {
        buffer<std::uint8_t> stepped(disparity_.width(), 0);
        for (std::int32_t y = 0; y < height_; ++y) {
            std::uint8_t* const to = below_.row(y);
            std::fill_n(to, width_, beyond);
            find_steps(y, stepped);
            for (std::int32_t x = 0; x < width_; ++x) {
                if (stepped[x] == 0) continue;
                const step_band::sides sides = extremes(x, y);
                if (!(sides.front - sides.back >= options_.min_step)) continue;
                to[x] = 0;
                number_[index(x, y)] = band_.curve.count();
                band_.curve.push_back(sides);
            }
        }
    }

    /// Marks the pixels of a row that have a neighbor across a step.
    void find_steps(std::int32_t y, buffer<std::uint8_t>& stepped) const {
        const float* const here = disparity_.row(y);
        const float* const above = disparity_.row((std::max)(y - 1, 0));
        const float* const below = disparity_.row((std::min)(y + 1, height_ - 1));
        const float step = options_.max_step;
        std::uint8_t* const to = stepped.data();
        for (std::int32_t x = 0; x < width_; ++x)
            to[x] = static_cast<std::uint8_t>((std::abs(here[x] - above[x]) > step ? 1 : 0) |
                                              (std::abs(here[x] - below[x]) > step ? 1 : 0));
        for (std::int32_t x = 0; x + 1 < width_; ++x) {
            const std::uint8_t differs = std::abs(here[x] - here[x + 1]) > step ? 1 : 0;
            to[x] |= differs, to[x + 1] |= differs;
        }
    }

    /// Returns the extreme disparities within step_sides_radius of (x, y).
    step_band::sides extremes(std::int32_t x, std::int32_t y) const {
        constexpr std::int32_t r = step_sides_radius;
        step_band::sides result{disparity_(y, x), disparity_(y, x)};
        for (std::int32_t v = (std::max)(y - r, 0); v <= (std::min)(y + r, height_ - 1); ++v) {
            const float* const row = disparity_.row(v);
            for (std::int32_t u = (std::max)(x - r, 0); u <= (std::min)(x + r, width_ - 1); ++u) {
                if ((u - x) * (u - x) + (v - y) * (v - y) > r * r + r) continue;
                result.front = (std::max)(result.front, row[u]), result.back = (std::min)(result.back, row[u]);
            }
        }
        return result;
    }

    /// Computes the distance from each pixel to the next curve pixel below it in the same column, at most `beyond`.
    void measure_below() {
        for (std::int32_t y = height_ - 1; y-- > 0;) {
            std::uint8_t* const here = below_.row(y);
            const std::uint8_t* const below = below_.row(y + 1);
            for (std::int32_t x = 0; x < width_; ++x) here[x] = (std::min)(here[x], next(below[x]));
        }
    }
    static std::uint8_t next(std::uint8_t distance) { return static_cast<std::uint8_t>((std::min)(distance + 1, int{beyond})); }

    void measure_rows() {
        const std::size_t padded = disparity_.width() + 2 * radius;
        buffer<std::uint8_t> above(disparity_.width(), beyond);
        buffer<std::uint16_t> columns(padded, far_key), keys(disparity_.width(), unset);
        for (std::int32_t y = 0; y < height_; ++y) {
            const std::uint8_t* const below = below_.row(y);
            std::uint8_t nearest = beyond;
            for (std::int32_t x = 0; x < width_; ++x) {
                above[x] = below[x] == 0 ? std::uint8_t{0} : next(above[x]);
                const std::uint8_t distance = (std::min)(above[x], below[x]);
                nearest = (std::min)(nearest, distance);
                const std::uint16_t squared = static_cast<std::uint16_t>(distance * distance << column_bits);
                columns[x + radius] = distance < beyond ? squared : far_key;
            }
            if (nearest < beyond) measure_row(y, above, below, columns, keys);
            region_.end_row();
        }
    }

    void measure_row(std::int32_t y, const buffer<std::uint8_t>& above, const std::uint8_t* below,
                     const buffer<std::uint16_t>& columns, buffer<std::uint16_t>& keys) {
        for (std::int32_t x = 0, last; x < width_; x = last) {
            const std::uint16_t* const found = std::find_if(columns.begin() + radius + x, columns.begin() + radius + width_,
                                                            [](std::uint16_t key) { return key != far_key; });
            const std::int32_t column = static_cast<std::int32_t>(found - columns.begin()) - radius;
            if (column == width_) return;
            // The range contains all columns within `radius` of a column with a curve pixel nearby. It ends at the first gap of
            // more than 2 * radius columns without a curve pixel nearby.
            const std::int32_t first = (std::max)(x, column - radius);
            last = column + 1;
            for (std::int32_t u = last; u < (std::min)(width_, last + 2 * radius + 1); ++u)
                if (columns[u + radius] != far_key) last = u + 1;
            last = (std::min)(last + radius, width_);
            find_minima(columns.data() + first, keys.data() + first, last - first);
            add_pixels(y, first, last, above, below, keys);
        }
    }

    static void find_minima(const std::uint16_t* columns, std::uint16_t* keys, std::int32_t count) {
        std::fill_n(keys, count, far_key);
        for (std::int32_t d = 0; d <= 2 * radius; ++d) {
            const std::uint16_t across = static_cast<std::uint16_t>(((d - radius) * (d - radius) << column_bits) + d);
            const std::uint16_t* const from = columns + d;
            for (std::int32_t i = 0; i < count; ++i) {
                const std::uint16_t key = static_cast<std::uint16_t>(from[i] + across);
                keys[i] = key < keys[i] ? key : keys[i];
            }
        }
    }

    void add_pixels(std::int32_t y, std::int32_t first, std::int32_t last, const buffer<std::uint8_t>& above,
                    const std::uint8_t* below, const buffer<std::uint16_t>& keys) {
        constexpr std::uint16_t largest = radius * radius;
        for (std::int32_t x = first, end; x < last; x = end) {
            for (end = x; end < last && keys[end] >> column_bits <= largest; ++end) {
                const std::int32_t u = end + (keys[end] & ((1 << column_bits) - 1)) - radius;
                const std::int32_t v = above[u] <= below[u] ? y - above[u] : y + below[u];
                band_.squared_distances.push_back(static_cast<std::uint16_t>(keys[end] >> column_bits));
                band_.curve_pixels.push_back(number_[index(u, v)]);
            }
            if (end > x) region_.add_run(x, end);
            while (end < last && keys[end] >> column_bits > largest) ++end;
        }
    }

    std::size_t index(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * disparity_.width() + static_cast<std::size_t>(x);
    }

    image_view<const float> disparity_;
    step_band_options options_;
    std::int32_t width_, height_;
    image<std::uint8_t> below_;
    buffer<std::int32_t> number_;  // index of each curve pixel in `curve`; not set for other pixels
    pixel_region_builder region_;
    step_band band_;
};

}  // namespace detail

inline step_band find_step_band(image_view<const float> disparity, const step_band_options& options) {
    detail::check_map(disparity, "find_step_band");
    if (!(options.max_step >= 0 && options.min_step > 0))
        raise(error_code::invalid_option, "step_band_options", "a max_step of at least 0 and a min_step above 0",
              detail::to_text(options.max_step) + " and " + detail::to_text(options.min_step));
    detail::check_pixel_count(disparity, "find_step_band");
    detail::check_finite(disparity, "find_step_band");
    return detail::step_band_finder(disparity, options).run();
}

}}  // namespace ldi
