// Flakes: thin surfaces of a depth between that of a nearer and a farther surface beside them, such as depth networks leave where
// three surfaces meet, and where a step is blurred. No scene has them. Each joins the surface that it looks like.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct flake_options {
    /// Surfaces that hold no square with a side of 2 * radius + 1 pixels are thin. 0 to 8; 0 merges nothing.
    std::int32_t radius = 4;
    /// Disparities within a square of one surface differ by at most this many thresholds: surfaces slope.
    float max_slope = 2.0F;
};

namespace detail {

// For every pixel the extreme value of the square around it, cut off at the map's border. `extreme` is min or max. The windows
// along rows, then those along columns, double in length step by step.
template <class T, class Extreme>
image<T> extreme_of_square(const image<T>& from, std::int32_t radius, Extreme&& extreme) {
    const std::int32_t rows = static_cast<std::int32_t>(from.height()), columns = static_cast<std::int32_t>(from.width());
    const std::int32_t window = 2 * radius + 1, all_rows = rows + 2 * radius, all_columns = columns + 2 * radius;
    image<T> padded(static_cast<std::size_t>(all_rows), static_cast<std::size_t>(all_columns), 1), result = from;
    const auto widen = [&](T* to, const T* other, std::int32_t count) {
        for (std::int32_t x = 0; x < count; ++x) to[x] = extreme(to[x], other[x]);
    };
    std::int32_t length = 1;
    for (std::int32_t y = 0; y < all_rows; ++y) {
        T* const row = padded.row(y);
        const T* const source = from.row(std::clamp(y - radius, 0, rows - 1));
        std::copy_n(source, columns, row + radius);
        std::fill_n(row, radius, source[0]), std::fill_n(row + radius + columns, radius, source[columns - 1]);
        for (length = 1; 2 * length <= window; length *= 2) widen(row, row + length, all_columns - length);
        widen(row, row + window - length, columns);
    }
    for (length = 1; 2 * length <= window; length *= 2)
        for (std::int32_t y = 0; y + length < all_rows; ++y) widen(padded.row(y), padded.row(y + length), columns);
    for (std::int32_t y = 0; y < rows; ++y) {
        widen(padded.row(y), padded.row(y + window - length), columns);
        std::copy_n(padded.row(y), columns, result.row(y));
    }
    return result;
}

class flake_merger {
public:
    flake_merger(const image<float>& disparity, image_view<const std::uint8_t> photo, surface_rule surface,
                 const flake_options& options)
        : disparity_(disparity), photo_(photo), surface_(surface), reach_(2 * options.radius + 1), vote_(options.radius / 2) {
        const auto smaller = [](auto a, auto b) { return (std::min)(a, b); };
        const auto larger = [](auto a, auto b) { return (std::max)(a, b); };
        const image<float> lowest = extreme_of_square(disparity, options.radius, smaller),
                           highest = extreme_of_square(disparity, options.radius, larger);
        image<std::uint8_t> holds_square(disparity.height(), disparity.width());
        for (std::size_t i = 0; i < holds_square.size(); ++i)
            holds_square.data()[i] = highest.data()[i] - lowest.data()[i] <= options.max_slope * surface.max_step ? 1 : 0;
        is_solid_ = extreme_of_square(holds_square, options.radius, larger);
        is_near_solid_ = extreme_of_square(is_solid_, reach_, larger);  // noise has none: nothing to search
    }

    // Finds the samples of flakes, and lets each join the surface that most of its flake around it looks like.
    std::size_t merge(image<float>& result) {
        const std::int32_t rows = static_cast<std::int32_t>(disparity_.height()),
                           columns = static_cast<std::int32_t>(disparity_.width());
        buffer<flake> flakes;
        image<std::int32_t> sums(disparity_.height() + 1, disparity_.width() + 1);  // +1 for the front, -1 for the back
        for (std::int32_t y = 0; y < rows; ++y)
            for (std::int32_t x = 0, row = 0; x < columns; ++x) {
                flake f{x, y, {}, {}};
                if (is_solid_(y, x) == 0 && is_near_solid_(y, x) != 0 && find_sides(f)) {
                    flakes.push_back(f);
                    row += contrast(x, y, f.front) <= contrast(x, y, f.back) ? 1 : -1;
                }
                sums(y + 1, x + 1) = sums(y, x + 1) + row;
            }
        for (const flake& f : flakes) {
            const std::int32_t left = (std::max)(f.x - vote_, 0), right = (std::min)(f.x + vote_ + 1, columns);
            const std::int32_t top = (std::max)(f.y - vote_, 0), bottom = (std::min)(f.y + vote_ + 1, rows);
            const std::int32_t votes = sums(bottom, right) - sums(top, right) - sums(bottom, left) + sums(top, left);
            const found& side = votes >= 0 ? f.front : f.back;
            result(f.y, f.x) = disparity_(side.y, side.x);
        }
        return flakes.size();
    }

private:
    struct found {
        std::int32_t squared_distance = 1 << 20, x = 0, y = 0;
        bool is_any() const { return squared_distance < 1 << 20; }
    };
    struct flake {
        std::int32_t x, y;
        found front, back;
    };

    // Whether there is a nearer and a farther surface beside a sample, and none as far as itself.
    bool find_sides(flake& f) const {
        const std::int32_t rows = static_cast<std::int32_t>(disparity_.height()),
                           columns = static_cast<std::int32_t>(disparity_.width());
        const float own = disparity_(f.y, f.x);
        for (std::int32_t v = (std::max)(f.y - reach_, 0); v <= (std::min)(f.y + reach_, rows - 1); ++v)
            for (std::int32_t u = (std::max)(f.x - reach_, 0); u <= (std::min)(f.x + reach_, columns - 1); ++u) {
                if (is_solid_(v, u) == 0) continue;
                const float there = disparity_(v, u);
                if (surface_.same_surface(there, own)) return false;  // a corner of a surface
                found& side = there > own ? f.front : f.back;
                const std::int32_t squared = (u - f.x) * (u - f.x) + (v - f.y) * (v - f.y);
                if (squared < side.squared_distance) side = {squared, u, v};
            }
        return f.front.is_any() && f.back.is_any();
    }

    std::int32_t contrast(std::int32_t x, std::int32_t y, const found& other) const {
        std::int32_t sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int32_t difference = std::int32_t{photo_(y, x, c)} - std::int32_t{photo_(other.y, other.x, c)};
            sum += difference * difference;
        }
        return sum;
    }

    const image<float>& disparity_;
    image_view<const std::uint8_t> photo_;
    surface_rule surface_;
    std::int32_t reach_, vote_;
    image<std::uint8_t> is_solid_, is_near_solid_;
};

}  // namespace detail

/// disparity  H x W x 1, in [0, 1], larger is nearer; changed in place
/// photo      H x W x 3
///
/// The flakes' pixels are thin ones with a nearer and a farther surface within 2 * radius + 1 pixels, and none as far as
/// themselves. Each joins the nearer or the farther surface, whichever most flake pixels within half the radius resemble more in
/// color. Things in front of one surface alone stay, however thin. Returns the number of flake pixels. Linear time; up to 80
/// bytes per pixel. Raises mismatch and invalid_option.
inline std::size_t merge_flakes(image<float>& disparity, image_view<const std::uint8_t> photo, surface_rule surface = {},
                                const flake_options& options = {}) {
    if (photo.height() != disparity.height() || photo.width() != disparity.width() || photo.channels() != 3)
        raise(error_code::mismatch, "merge_flakes", "a photo of 3 channels as large as the map", detail::shape_text(photo));
    if (options.radius < 0 || options.radius > 8 || !(options.max_slope > 0))
        raise(error_code::invalid_option, "flake_options", "a radius from 0 to 8, a slope above 0",
              std::to_string(options.radius) + " and " + detail::to_text(options.max_slope));
    if (options.radius == 0) return 0;
    const image<float> before = disparity;
    return detail::flake_merger(before, photo, surface, options).merge(disparity);
}

}}  // namespace ldi
