// The band of pixels around a discontinuity curve, straightened: one row per corner of the curve, from the back across the curve
// to the front. In the middle of the band, it is uncertain which surface a pixel belongs to; the pixels outside the middle have
// the colors of the two surfaces.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/trace_curves.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace curves {

struct point {
    float x = 0, y = 0;
};

// A curve as points in the plane, where pixel (x, y) covers [x, x + 1) x [y, y + 1). "Across" means from back to front.
struct plane_curve {
    buffer<point> corners;  // corners of the traced curve
    buffer<point> smooth;   // corners, smoothed to remove the lattice's stair steps; ends stay in place
    buffer<point> across;   // unit vectors from back to front
};

// Computes the points and directions of a traced curve.
//
// reach  number of corners on either side to average
inline plane_curve make_plane_curve(const traced_curve& t, const corner_map& lattice, std::int32_t reach) {
    const std::int32_t count = t.corners.count(), period = count - 1;  // the last corner of a closed curve equals its first
    plane_curve result;
    for (std::int32_t corner : t.corners)
        result.corners.push_back({nearest_float(lattice.x(corner)), nearest_float(lattice.y(corner))});
    const auto wrapped = [&](std::int32_t k) { return (k % period + period) % period; };
    result.smooth.resize(result.corners.size()), result.across.resize(result.corners.size());
    for (std::int32_t k = 0; k < count; ++k) {
        const std::int32_t before = t.is_closed ? reach : (std::min)(reach, k),
                           after = t.is_closed ? reach : (std::min)(reach, period - k);
        const std::int32_t even = (std::min)(before, after);
        point sum, front;
        for (std::int32_t i = k - even; i <= k + even; ++i) {
            const point p = result.corners[t.is_closed ? wrapped(i) : i];
            sum.x += p.x, sum.y += p.y;
        }
        for (std::int32_t i = k - before; i < k + after; ++i) {
            const side s = t.sides[t.is_closed ? wrapped(i) : i].toward_front;
            front.x += nearest_float(step_x(s)), front.y += nearest_float(step_y(s));
        }
        const float size = nearest_float(2 * even + 1), length = (std::max)(vector_length(front.x, front.y), 1e-6F);
        result.smooth[k] = {sum.x / size, sum.y / size};
        result.across[k] = {front.x / length, front.y / length};
    }
    // If a curve ends at the photo's border, the band's row there runs along the border, so that the band has no gap.
    for (const std::int32_t k : {std::int32_t{0}, period}) {
        const std::int32_t corner = t.corners[k];
        if (t.is_closed || !lattice.on_border(corner)) continue;
        point& across = result.across[k];
        const bool on_side = lattice.on_border_column(corner);
        across = on_side ? point{0.0F, across.y < 0.0F ? -1.0F : 1.0F} : point{across.x < 0.0F ? -1.0F : 1.0F, 0.0F};
    }
    return result;
}

// Sums over the color samples on one side of a curve.
struct color_sums {
    float count = 0;
    std::array<float, 3> sum{}, squares{};

    void add(const std::uint8_t* color) {
        count += 1.0F;
        for (std::size_t c = 0; c < 3; ++c) {
            const float v = nearest_float(color[c]);
            sum[c] += v, squares[c] += v * v;
        }
    }
    void add(const color_sums& other, float sign) {
        count += sign * other.count;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += sign * other.sum[c], squares[c] += sign * other.squares[c];
    }
};

// Normal distribution of colors, channel by channel.
struct color_model {
    std::array<float, 3> mean{}, precision{};
    float log_scale = 0;

    // noise  standard deviation of noise in gray levels; its square is added to the variance of the samples
    color_model(const color_sums& of, float noise) {
        for (std::size_t c = 0; c < 3; ++c) {
            mean[c] = of.sum[c] / of.count;
            const float variance = (std::max)(of.squares[c] / of.count - mean[c] * mean[c], 0.0F) + noise * noise;
            precision[c] = 1.0F / variance;
            log_scale += 0.5F * natural_logarithm(variance);
        }
    }
    float log_likelihood(const std::uint8_t* color) const {
        float result = -log_scale;
        for (std::size_t c = 0; c < 3; ++c) {
            const float d = nearest_float(color[c]) - mean[c];
            result -= 0.5F * precision[c] * d * d;
        }
        return result;
    }
};

// The straightened band, row by row.
class band {
public:
    // radius  number of uncertain pixels on each side of the curve; beyond them, up to `radius` more pixels on each side supply
    //         the color models of front and back
    band(const plane_curve& curve, const traced_curve& t, image_view<const std::uint8_t> photo, image_view<const float> disparity,
         std::int32_t radius)
        : photo_(photo), disparity_(disparity), radius_(radius), width_(nearest_int(photo.width())) {
        rows_.resize(curve.corners.size());
        pixels_.resize(curve.corners.size() * static_cast<std::size_t>(4 * radius));
        for (std::int32_t k = 0; k < rows_.count(); ++k) {
            const discontinuity& d = t.sides[(std::min)(k, t.sides.count() - 1)];
            rows_[k].middle = 0.5F * (at(d.front) + at(d.back));
            for (std::int32_t offset = -2 * radius; offset < 2 * radius; ++offset)
                pixel(k, offset) = pixel_at(curve.smooth[k], curve.across[k], nearest_float(offset) + 0.5F);
            measure(k);
        }
    }

    std::int32_t radius() const { return radius_; }
    std::int32_t size() const { return rows_.count(); }
    // Smallest and largest cut of row k that leave pixels on both surfaces. A cut is a distance from the curve in pixels,
    // negative toward the back and positive toward the front.
    std::int32_t min_cut(std::int32_t k) const { return -rows_[k].back; }
    std::int32_t largest_cut(std::int32_t k) const { return rows_[k].front; }
    const color_sums& sums(std::int32_t k, bool of_front) const {
        return of_front ? rows_[k].front_colors : rows_[k].back_colors;
    }
    // Returns the color of the pixel of row k between cuts `offset` and `offset` + 1; nullptr outside the photo or the band.
    const std::uint8_t* color(std::int32_t k, std::int32_t offset) const {
        if (offset < -2 * radius_ || offset >= 2 * radius_) return nullptr;
        const std::int32_t i = pixels_[index(k, offset)];
        return i == no_pixel ? nullptr : photo_.row(i / width_) + 3 * (i % width_);
    }

private:
    struct row {
        float middle = 0;  // disparity halfway between front and back
        std::int32_t front = 0, back = 0;
        color_sums front_colors, back_colors;
    };

    static std::int32_t nearest_int(std::size_t n) { return static_cast<std::int32_t>(n); }
    float at(std::int32_t i) const { return disparity_.row(i / width_)[i % width_]; }
    std::size_t index(std::int32_t k, std::int32_t offset) const {
        return 4 * static_cast<std::size_t>(k) * static_cast<std::size_t>(radius_) +
               static_cast<std::size_t>(offset + 2 * radius_);
    }
    std::int32_t& pixel(std::int32_t k, std::int32_t offset) { return pixels_[index(k, offset)]; }
    std::int32_t pixel_at(point from, point across, float distance) const {
        const float x = std::floor(from.x + distance * across.x), y = std::floor(from.y + distance * across.y);
        if (!(x >= 0.0F && y >= 0.0F && x < nearest_float(photo_.width()) && y < nearest_float(photo_.height()))) return no_pixel;
        return static_cast<std::int32_t>(y) * width_ + static_cast<std::int32_t>(x);
    }

    // Measures how far the front and back surfaces extend across the band, and sums their colors outside the uncertain middle.
    // On thin objects, the middle is narrower, and fewer pixels supply colors.
    void measure(std::int32_t k) {
        row& r = rows_[k];
        std::int32_t front = 0, back = 0;
        const auto is_front = [&](std::int32_t offset) {
            return pixel(k, offset) != no_pixel && at(pixel(k, offset)) > r.middle;
        };
        const auto is_back = [&](std::int32_t offset) {
            return pixel(k, offset) != no_pixel && at(pixel(k, offset)) <= r.middle;
        };
        // Assumes that each surface extends over at least two pixels, because smoothing may have moved the curve by that much.
        while (front < 2 * radius_ && (is_front(front) || front < 2)) ++front;
        while (back < 2 * radius_ && (is_back(-back - 1) || back < 2)) ++back;
        r.front = (std::min)(radius_, front / 2), r.back = (std::min)(radius_, back / 2);
        for (std::int32_t offset = r.front; offset < front; ++offset)
            if (is_front(offset)) r.front_colors.add(color(k, offset));
        for (std::int32_t offset = -back; offset < -r.back; ++offset)
            if (is_back(offset)) r.back_colors.add(color(k, offset));
    }

    image_view<const std::uint8_t> photo_;
    image_view<const float> disparity_;
    std::int32_t radius_, width_;
    buffer<row> rows_;
    buffer<std::int32_t> pixels_;
};

}}}}  // namespace ldi::detail::curves
