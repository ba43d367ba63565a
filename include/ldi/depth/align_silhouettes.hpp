// Moves silhouettes to the photo's edges. Depth maps are coarser than the photo, and their edges are off by a sample or two.
// Therefore, a strip of the background sticks to the foreground, or a strip of the foreground to the background. Both become
// visible when the camera moves.
//
// A band of pixels surrounds each discontinuity curve. In the middle of the band, within the depth map's uncertainty on either
// side of the curve, the silhouette may be anywhere. The pixels outside the middle supply color models of the front and the
// back surface. The best cut through the middle separates front colors from back colors, follows contrast, and has no jumps. It
// is a shortest path, found by dynamic programming, like the contours of Rother et al., "GrabCut" (SIGGRAPH 2004), section
// "Border matting". Junctions and ends of curves do not move, except that ends at the photo's border may move along it. Pixels
// between the old curve and the new one change sides.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/core/trace_curves.hpp>
#include <ldi/depth/detail/check_map.hpp>
#include <ldi/depth/detail/straightened_curve.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The defaults were tuned on ground-truth depth maps that were degraded to resemble a network's depth maps.
struct alignment_options {
    /// Maximum distance between a silhouette and its edge in the photo, in pixels, 0 to 256. With 0, silhouettes do not move. If
    /// samples of the depth map are wider than a pixel, make_photo3d() multiplies this option and min_length by their width.
    float uncertainty = 3.0F;
    /// Cost of moving sideways by one pixel between neighboring points of a curve, at least 0. Larger values keep silhouettes
    /// straighter.
    float stiffness = 1.5F;
    /// Curves with fewer pixel sides than this do not move.
    std::size_t min_length = 20;
};

namespace detail::curves {

// Computes the cost of each cut and the cheapest path along a band. A cut is the position at which the new curve crosses a row.
class band_cut {
public:
    // is_closed  whether the band's last row repeats its first row
    band_cut(const band& b, float stiffness, bool is_closed)
        : radius_(b.radius()), rows_(b.size() - (is_closed ? 1 : 0)), stiffness_(stiffness) {
        costs_.assign(static_cast<std::size_t>(rows_) * places(), impossible);
        const std::int32_t reach = 2 * radius_;  // rows on either side whose colors are averaged
        color_sums front, back;
        for (std::int32_t k = 0; k < (std::min)(reach, rows_); ++k) front.add(b.sums(k, true), 1), back.add(b.sums(k, false), 1);
        for (std::int32_t k = 0; k < rows_; ++k) {
            if (k + reach < rows_) front.add(b.sums(k + reach, true), 1), back.add(b.sums(k + reach, false), 1);
            if (k > reach) front.add(b.sums(k - reach - 1, true), -1), back.add(b.sums(k - reach - 1, false), -1);
            weigh_row(b, k, front, back);
        }
    }

    void fix(std::int32_t row, std::int32_t cut) {
        for (std::int32_t c = -radius_; c <= radius_; ++c)
            if (c != cut) cost(row, c) = impossible;
    }

    // Returns the cuts of the cheapest path through `steps` rows, starting at row `first` and wrapping around.
    buffer<std::int32_t> cheapest(std::int32_t first, std::int32_t steps) const {
        const std::size_t count = places();
        buffer<std::int8_t> came_by(static_cast<std::size_t>(steps) * count, 0);
        buffer<float> sums(count, 0.0F), next(count, 0.0F);
        for (std::int32_t i = 0; i < steps; ++i) {
            const float* of_row = costs_.data() + static_cast<std::size_t>((first + i) % rows_) * count;
            for (std::size_t c = 0; c < count; ++c) {
                float best = sums[c];
                std::int8_t step = 0;
                if (i > 0 && c > 0 && sums[c - 1] + stiffness_ < best) best = sums[c - 1] + stiffness_, step = -1;
                if (i > 0 && c + 1 < count && sums[c + 1] + stiffness_ < best) best = sums[c + 1] + stiffness_, step = 1;
                next[c] = best + of_row[c];
                came_by[static_cast<std::size_t>(i) * count + c] = step;
            }
            sums.swap(next);
        }
        buffer<std::int32_t> result(static_cast<std::size_t>(steps), 0);
        std::int32_t c = static_cast<std::int32_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
        for (std::int32_t i = steps; i-- > 0;) {
            result[i] = c - radius_;
            c += came_by[static_cast<std::size_t>(i) * count + static_cast<std::size_t>(c)];
        }
        return result;
    }

private:
    static constexpr float impossible = 1e6F;
    static constexpr float noise = 6.0F;         // standard deviation of camera and JPEG noise, in gray levels
    static constexpr float max_evidence = 3.0F;  // maximum log-likelihood ratio of a pixel; limits outliers
    static constexpr float contrast_weight = 3.0F;
    static constexpr float distance_weight = 1.0F;

    std::size_t places() const { return static_cast<std::size_t>(2 * radius_ + 1); }
    float& cost(std::int32_t row, std::int32_t cut) {
        return costs_[static_cast<std::size_t>(row) * places() + static_cast<std::size_t>(cut + radius_)];
    }

    void weigh_row(const band& b, std::int32_t k, const color_sums& front_sums, const color_sums& back_sums) {
        const bool is_known = front_sums.count > 0.0F && back_sums.count > 0.0F;
        const std::int32_t min_cut = b.min_cut(k), max_cut = b.largest_cut(k);
        if (!is_known) {
            for (std::int32_t cut = min_cut; cut <= max_cut; ++cut) cost(k, cut) = distance_cost(cut);
            return;
        }
        const color_model front(front_sums, noise), back(back_sums, noise);
        std::array<float, 3> direction;
        float squared = 0.0F;
        for (std::size_t c = 0; c < 3; ++c) direction[c] = front.mean[c] - back.mean[c], squared += direction[c] * direction[c];
        float evidence = 0.0F;
        for (std::int32_t cut = min_cut; cut <= max_cut; ++cut) {
            cost(k, cut) = evidence + distance_cost(cut);
            if (squared > 9.0F * noise * noise) cost(k, cut) -= contrast_weight * contrast(b, k, cut, direction, squared);
            if (const std::uint8_t* color = b.color(k, cut))
                evidence += std::clamp(front.log_likelihood(color) - back.log_likelihood(color), -max_evidence, max_evidence);
        }
    }
    float distance_cost(std::int32_t cut) const {
        const float share = nearest_float(cut) / nearest_float(radius_);
        return distance_weight * share * share;
    }
    // Contrast across a cut: the color difference between the first and the last of the four pixels around it, as a share of the
    // difference between the back and the front color.
    float contrast(const band& b, std::int32_t k, std::int32_t cut, const std::array<float, 3>& direction, float squared) const {
        const std::uint8_t *before = b.color(k, cut - 2), *behind = b.color(k, cut + 1);
        if (before == nullptr || behind == nullptr) return 0.0F;
        float way = 0.0F;
        for (std::size_t c = 0; c < 3; ++c) way += direction[c] * (nearest_float(behind[c]) - nearest_float(before[c]));
        return std::clamp(way / squared, 0.0F, 1.0F);
    }

    std::int32_t radius_, rows_;
    float stiffness_;
    buffer<float> costs_;
};

inline buffer<std::int32_t> cheapest_cut(const band& b, const traced_curve& t, const corner_map& lattice, float stiffness) {
    band_cut cut(b, stiffness, t.is_closed);
    if (!t.is_closed) {
        if (!lattice.on_border(t.corners.front())) cut.fix(0, 0);
        if (!lattice.on_border(t.corners.back())) cut.fix(b.size() - 1, 0);
        return cut.cheapest(0, b.size());
    }
    // The path must end where it starts. It starts halfway along the curve, at the cut that an unconstrained path has there.
    const std::int32_t period = b.size() - 1, middle = period / 2;
    cut.fix(middle, cut.cheapest(0, period)[middle]);
    const buffer<std::int32_t> round = cut.cheapest(middle, period + 1);
    buffer<std::int32_t> result(static_cast<std::size_t>(period + 1), 0);
    for (std::int32_t k = 0; k <= period; ++k) result[k] = round[(k + period - middle) % period];
    return result;
}

// A pixel between the old and the new curve, and a nearby pixel side of the old curve, as an index in `traced_curve::sides`.
struct swept_pixel {
    std::int32_t pixel, of_side;
    friend bool operator<(const swept_pixel& a, const swept_pixel& b) {
        return a.pixel != b.pixel ? a.pixel < b.pixel : a.of_side < b.of_side;
    }
};

// Appends the pixels whose centers lie in a quadrilateral, which may intersect itself.
inline void sweep(const std::array<point, 4>& corners, std::int32_t width, std::int32_t height, std::int32_t of_side,
                  buffer<swept_pixel>& swept) {
    const auto [top, bottom] = std::minmax_element(corners.begin(), corners.end(), [](point a, point b) { return a.y < b.y; });
    // First row, or column, whose center is at or after a position.
    const auto first_from = [](float place, std::int32_t count) {
        return static_cast<std::int32_t>(std::clamp(std::ceil(place - 0.5F), 0.0F, nearest_float(count)));
    };
    for (std::int32_t y = first_from(top->y, height), end = first_from(bottom->y, height); y < end; ++y) {
        const float at_y = nearest_float(y) + 0.5F;
        std::array<float, 4> crossings{};
        std::size_t count = 0;
        for (std::size_t i = 0; i < 4; ++i) {
            const point a = corners[i], b = corners[(i + 1) % 4];
            if ((a.y <= at_y) == (b.y <= at_y)) continue;
            const float crossing = a.x + (at_y - a.y) / (b.y - a.y) * (b.x - a.x);
            std::size_t place = count++;  // insertion sort
            for (; place > 0 && crossings[place - 1] > crossing; --place) crossings[place] = crossings[place - 1];
            crossings[place] = crossing;
        }
        for (std::size_t i = 0; i + 1 < count; i += 2)
            for (std::int32_t x = first_from(crossings[i], width), last = first_from(crossings[i + 1], width); x < last; ++x)
                swept.push_back({y * width + x, of_side});
    }
}

// Lists the pixels that a curve passes over when it moves. A pixel that the curve passes over twice keeps its side.
inline buffer<swept_pixel> swept_pixels(const plane_curve& curve, const buffer<std::int32_t>& cut, std::int32_t reach,
                                        const corner_map& lattice) {
    const auto moved = [&](std::int32_t k) {
        // Cuts are whole pixels. Averaging them over `even` corners on either side removes the stair steps. An end of the curve
        // keeps its own cut.
        const std::int32_t even = (std::min)({reach, k, cut.count() - 1 - k});
        float distance = 0.0F;
        for (std::int32_t i = k - even; i <= k + even; ++i) distance += nearest_float(cut[i]) / nearest_float(2 * even + 1);
        return point{curve.smooth[k].x + distance * curve.across[k].x, curve.smooth[k].y + distance * curve.across[k].y};
    };
    buffer<swept_pixel> all, result;
    for (std::int32_t k = 0; k + 1 < curve.corners.count(); ++k)
        sweep({curve.corners[k], curve.corners[k + 1], moved(k + 1), moved(k)}, lattice.width(), lattice.height(), k, all);
    std::sort(all.begin(), all.end());
    for (std::size_t i = 0, next = 0; i < all.size(); i = next) {
        while (next < all.size() && all[next].pixel == all[i].pixel) ++next;
        if ((next - i) % 2 == 1) result.push_back(all[i]);
    }
    return result;
}

// Sets swept front pixels to the back's disparity beside the curve, and swept back pixels to the front's disparity. Pixels of
// other surfaces do not change.
inline void change_sides(const traced_curve& t, const buffer<swept_pixel>& swept, const image<float>& before,
                         image_view<float> disparity) {
    const auto at = [&](std::int32_t pixel) { return before.data()[pixel]; };
    const std::size_t width = before.width();
    for (const swept_pixel& s : swept) {
        const discontinuity& d = t.sides[s.of_side];
        const float from_front = std::abs(at(s.pixel) - at(d.front)), from_back = std::abs(at(s.pixel) - at(d.back));
        const std::size_t pixel = static_cast<std::size_t>(s.pixel);
        if ((std::min)(from_front, from_back) < std::abs(at(d.front) - at(d.back)))
            disparity(pixel / width, pixel % width) = at(from_front < from_back ? d.back : d.front);
    }
}

// Traces the curves that may move: those with at least `min_length` sides.
inline buffer<traced_curve> long_curves(const image<float>& disparity, surface_rule surface, std::size_t min_length) {
    const std::int32_t width = static_cast<std::int32_t>(disparity.width()),
                       height = static_cast<std::int32_t>(disparity.height());
    const float* at = disparity.data();
    curve_tracer curves(width, height, {at, disparity.size()}, surface, [&](std::int32_t pixel, side s) {
        return !surface.same_surface(at[pixel], at[s == side::right ? pixel + 1 : pixel + width]);
    });
    curves.prune_spurs(min_length);
    buffer<traced_curve> result;
    curves.for_each_curve([&](traced_curve t) {
        if (t.sides.size() >= min_length) result.push_back(std::move(t));
    });
    return result;
}

inline void check_alignment(image_view<const float> disparity, image_view<const std::uint8_t> photo,
                            const alignment_options& options) {
    check_map_and_photo(disparity, photo, "align_silhouettes");
    check_pixel_count(disparity, "align_silhouettes");
    check_finite(disparity, "align_silhouettes");
    if (!(options.uncertainty >= 0.0F && options.uncertainty <= 256.0F) || !(options.stiffness >= 0.0F))
        raise(error_code::invalid_option, "alignment_options", "an uncertainty from 0 to 256 and a stiffness of at least 0",
              detail::to_text(options.uncertainty) + " and " + detail::to_text(options.stiffness));
}

}  // namespace detail::curves

/// Moves the silhouettes of a disparity map to the edges of the photo, in place.
///
/// disparity  H x W x 1, finite, with steps where one surface hides another
/// surface    rule that decides whether neighboring pixels belong to one surface
/// photo      H x W x 3
///
/// Raises mismatch unless the images have these shapes, invalid_data for disparities that are not finite, too_large for 2^31
/// pixels or more, and invalid_option if the uncertainty is not in [0, 256] or the stiffness is below 0. Time is linear in the
/// number of pixels and in the total length of all curves times the uncertainty. Memory is 10 bytes per pixel, and 8 for each
/// pixel that a curve passes over. In addition, each thread needs 26 * uncertainty bytes for each pixel side of the longest
/// curve.
template <executor Executor = const serial_executor>
void align_silhouettes(image_view<float> disparity, image_view<const std::uint8_t> photo, surface_rule surface = {},
                       const alignment_options& options = {}, Executor&& threads = {}) {
    using namespace detail::curves;
    check_alignment(disparity, photo, options);
    const std::int32_t radius = static_cast<std::int32_t>(std::lround(options.uncertainty));
    if (radius == 0 || photo.empty()) return;
    const image<float> before{image_view<const float>(disparity)};
    const buffer<traced_curve> traces = long_curves(before, surface, options.min_length);
    buffer<buffer<swept_pixel>> swept(traces.size());
    const corner_map lattice(static_cast<std::int32_t>(photo.width()), static_cast<std::int32_t>(photo.height()));
    parallel_for(threads, traces.size(), 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const std::int32_t reach = (std::max)(radius / 2, 1);
            const plane_curve curve = make_plane_curve(traces[i], lattice, reach);
            const band around(curve, traces[i], photo, before, radius);
            swept[i] = swept_pixels(curve, cheapest_cut(around, traces[i], lattice, options.stiffness), reach, lattice);
        }
    });
    for (std::size_t i = 0; i < traces.size(); ++i) change_sides(traces[i], swept[i], before, disparity);
}

}}  // namespace ldi
