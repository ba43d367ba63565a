// Finds rims that do not belong to the scene: edges of scanned slides, and thin frames. If grow_past_frame() mirrored such rims
// past the border, they would become lines across the picture.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Measures the rim along each side of a photo. A rim consists of the outermost rows or columns with a single color each, and of
/// the next `fading` rows or columns, in which that color fades out. If more than `max_rim` rows or columns have a single color,
/// they are a plain background instead of a rim.
class rim_finder {
public:
    /// g             in canonical order
    /// color, known  columns of the layered image, K x 3 and K
    rim_finder(const graph_view& g, array_view<const std::uint8_t> color, array_view<const std::uint8_t> known,
               const buffer<pixel_run>& runs)
        : graph_(g), color_(color), known_(known), runs_(runs) {}

    /// Returns the width of the rim in pixels.
    ///
    /// inward  direction from the rim's side into the photo
    std::int32_t width(side inward) const {
        const bool is_row = inward == side::up || inward == side::down;
        const std::int32_t length = is_row ? graph_.width() : graph_.height(), depth = is_row ? graph_.height() : graph_.width();
        if (length < min_length || depth < 4 * (max_rim + fading)) return 0;
        std::int32_t rim = 0;
        while (rim <= max_rim && has_one_color(inward, rim)) ++rim;
        return rim == 0 || rim > max_rim ? 0 : rim + fading;
    }

private:
    // All of these limits were tuned by experiment.
    static constexpr std::int32_t max_rim = 8, fading = 2, min_length = 32;
    static constexpr double max_deviation = 5;  // mean difference from the mean color, in gray levels

    /// Whether the known pixels at the given distance from a side have nearly the same color.
    bool has_one_color(side inward, std::int32_t distance) const {
        std::array<double, 3> mean{};
        double count = 0, deviation = 0;
        for_each_pixel(inward, distance, [&](const std::uint8_t* color) {
            count += 1;
            for (std::size_t c = 0; c < 3; ++c) mean[c] += color[c];
        });
        if (count == 0) return false;
        for (double& value : mean) value /= count;
        for_each_pixel(inward, distance, [&](const std::uint8_t* color) {
            for (std::size_t c = 0; c < 3; ++c) deviation += std::abs(color[c] - mean[c]) / 3;
        });
        return deviation <= max_deviation * count;
    }

    template <class Visit>
    void for_each_pixel(side inward, std::int32_t distance, Visit&& visit) const {
        const auto see = [&](std::int32_t pixel) {
            if (known_[pixel] != 0) visit(color_.data() + 3 * std::ptrdiff_t{pixel});
        };
        const std::int32_t x = inward == side::right ? distance : graph_.width() - 1 - distance;
        const std::int32_t y = inward == side::down ? distance : graph_.height() - 1 - distance;
        for (const pixel_run& r : runs_) {
            const std::int32_t x0 = graph_.x()[r.first];
            if (inward == side::left || inward == side::right) {
                if (x0 <= x && x < x0 + r.size()) see(r.first + x - x0);
            } else if (graph_.y()[r.first] == y) {
                for (std::int32_t i = r.first; i < r.last; ++i) see(i);
            }
        }
    }

    graph_view graph_;
    array_view<const std::uint8_t> color_, known_;
    const buffer<pixel_run>& runs_;
};

}}}  // namespace ldi::detail
