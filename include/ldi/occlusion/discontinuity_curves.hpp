// Groups depth discontinuities of a lifted photo into curves, and computes the lines at their ends that hidden surfaces must not
// cross (paper, section "Occluded Surface Hallucination", and Figure "depth_expand").
//
// A discontinuity runs along the sides of pixels, between the corners of the lattice. If three or more sides with a discontinuity
// meet at a corner, the corner is a junction, and curves end there. If four sides but only two depths meet, two curves pass each
// other instead.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/discontinuity.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/core/trace_curves.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Ends of curves at which a growth_constraint keeps the hidden surface from spreading sideways.
enum class constrained_ends : std::uint8_t {
    midground,  ///< at junctions, the ends of curves between a midground and the surface in front of it
    all,        ///< every end inside the photo, even of curves in front of the background; for comparison with `midground`
    none,       ///< surfaces grow in all directions, as in Hedman and Kopf, "Instant 3D Photography" (SIGGRAPH 2018)
};

/// Options of find_discontinuity_curves().
struct curve_options {
    /// Groups of connected curves, and branches with a free end, are spurious if they have fewer pixel sides than this: surfaces
    /// do not grow behind them, and close_spurious_discontinuities() closes them. The paper drops every shorter curve. Here, a
    /// short curve between two junctions of a valid silhouette remains: closing it would leave a bridge across the silhouette.
    std::size_t min_length = 20;
    /// Number of pixel sides over which the direction of a curve at its end is measured.
    std::size_t tangent_length = 20;
    /// Ends of curves at which the hidden surface must not spread sideways.
    constrained_ends constraints = constrained_ends::midground;
    /// Maximum number of pixel sides in all curves, per pixel of the photo, 0 to 2. 117 photographs and sensor depth maps had at
    /// most 0.05. Maps above the limit are mostly noise. From such maps, find_discontinuity_curves() drops curves shorter than
    /// min_length, then the shortest remaining curves until the limit holds. Processing a map of noise then takes only a few
    /// times as long as processing the map of a photograph.
    float max_density = 0.2F;
    /// Maximum number of pixel sides in all curves. Limits the number of charts. With the default max_density, it is the tighter
    /// limit for photos of more than 2.5 megapixels.
    std::size_t max_sides = 500'000;
};

/// A ray that the hidden surface behind a curve must not cross. It starts at the curve's end, is perpendicular to the curve, and
/// points behind the front surface. Coordinates are those of the lattice: pixel (x, y) covers [x, x + 1) x [y, y + 1).
struct growth_constraint {
    float x, y;  ///< end of the curve
    /// Unit vector along the curve, pointing out of its end; zero if the curve loops back to this end.
    float outward_x, outward_y;
    float perpendicular_x, perpendicular_y;  ///< unit vector along the ray, or zero
};

/// A maximal chain of discontinuities between ends or junctions, in order along the curve.
struct discontinuity_curve {
    buffer<discontinuity> sides;
    buffer<growth_constraint> constraints;  ///< at most one per end; see curve_options::constraints
    bool is_closed = false;
};

namespace detail::curves {

// For every curve, counts the sides of all curves connected to it through junctions.
inline buffer<std::size_t> group_lengths(const buffer<traced_curve>& traces) {
    buffer<std::pair<std::int32_t, std::int32_t>> ends;  // a corner, and a curve that ends there
    for (std::int32_t i = 0; i < traces.count(); ++i)
        if (!traces[i].is_closed) ends.emplace_back(traces[i].corners.front(), i), ends.emplace_back(traces[i].corners.back(), i);
    std::sort(ends.begin(), ends.end());
    disjoint_sets groups(traces.size());
    for (std::size_t i = 1; i < ends.size(); ++i)
        if (ends[i].first == ends[i - 1].first) groups.merge(ends[i].second, ends[i - 1].second);
    buffer<std::size_t> total(traces.size(), 0), lengths(traces.size(), 0);
    for (std::int32_t i = 0; i < traces.count(); ++i) total[groups.find(i)] += traces[i].sides.size();
    for (std::int32_t i = 0; i < traces.count(); ++i) lengths[i] = total[groups.find(i)];
    return lengths;
}

// Returns the smallest length, `min_length` or more, such that the curves of this length or longer have at most `max_sides` sides
// in total. Returns 0 if all curves fit.
inline std::size_t min_length_within(const curve_tracer& tracer, std::size_t max_sides, std::size_t min_length) {
    if (tracer.corners().side_count() <= max_sides) return 0;
    buffer<std::size_t> sides;  // per curve length: number of sides of all curves of this length
    tracer.for_each_curve([&](const traced_curve& t) {
        if (t.sides.size() >= sides.size()) sides.resize(t.sides.size() + 1);
        sides[t.sides.size()] += t.sides.size();
    });
    std::size_t shortest = sides.size(), total = 0;
    while (shortest > min_length && total + sides[shortest - 1] <= max_sides) total += sides[--shortest];
    return shortest;
}

}  // namespace detail::curves

namespace detail {

/// Raises mismatch for curves that do not fit the layer. Each side must separate two neighboring pixels that are not linked, and
/// the front must not be farther than the back. Each constraint must start inside the lattice, and its directions must be unit
/// vectors or zero.
inline void check_curves(std::span<const discontinuity_curve> curves, const graph_view& g, array_view<const float> disparity,
                         const char* where) {
    const auto refuse = [&](const discontinuity_curve& c, const std::string& found) {
        raise(error_code::mismatch, where,
              "curves along the missing links of a layer of " + std::to_string(g.width()) + " x " + std::to_string(g.height()),
              "curve " + std::to_string(&c - curves.data()) + " with " + found);
    };
    const float width = nearest_float(g.width()), height = nearest_float(g.height());
    const auto is_direction = [](float x, float y) {
        const float length = vector_length(x, y);
        return length == 0.0F || std::abs(length - 1.0F) < 0.01F;
    };
    for (const discontinuity_curve& c : curves) {
        for (const discontinuity& d : c.sides) {
            const bool is_inside = d.back >= 0 && d.front >= 0 && d.back < g.count() && d.front < g.count();
            if (!is_inside || !is_side(d.toward_front) || g.x()[d.back] + step_x(d.toward_front) != g.x()[d.front] ||
                g.y()[d.back] + step_y(d.toward_front) != g.y()[d.front] || g.neighbor(d.back, d.toward_front) != no_pixel ||
                disparity[d.front] < disparity[d.back])
                refuse(c, "a side between pixels " + std::to_string(d.back) + " and " + std::to_string(d.front));
        }
        for (const growth_constraint& e : c.constraints)
            if (!(e.x >= 1.0F && e.y >= 1.0F && e.x < width && e.y < height && is_direction(e.outward_x, e.outward_y) &&
                  is_direction(e.perpendicular_x, e.perpendicular_y)))
                refuse(c, "a constraint at (" + to_text(e.x) + ", " + to_text(e.y) + ")");
    }
}

}  // namespace detail

/// Finds the discontinuity curves of a layer, in a deterministic order.
///
/// surface        the rule by which lift() linked the layer
/// dropped_sides  if given, set to the number of pixel sides in the curves that curve_options::max_density or max_sides dropped
///
/// Raises invalid_option for a density outside [0, 2].
///
/// A curve between a midground and the surface in front of it is constrained where it ends in a junction, so that the farthest
/// of the meeting surfaces can grow behind all others. Unlike in the paper, other ends are not constrained. At such an end, the
/// disparity step is still as large as the threshold, so a camera that moves along the curve uncovers some of the back surface
/// past the end. Runs in linear time, except for sorting the ends of curves. Uses 5 bytes of memory per pixel, 16 per pixel
/// side and 500 per curve.
template <payload_column... Columns>
buffer<discontinuity_curve> find_discontinuity_curves(const single_layer<Columns...>& layer, surface_rule surface = {},
                                                      const curve_options& options = {}, std::size_t* dropped_sides = nullptr) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    if (!(options.max_density >= 0.0F && options.max_density <= 2.0F))
        raise(error_code::invalid_option, "curve_options::max_density", "0 to 2", detail::to_text(options.max_density));
    const auto disparity = layer.template column<disparity_column>();
    buffer<discontinuity_curve> curves;
    const auto& g = layer.topology();
    curve_tracer tracer(g.width(), g.height(), disparity, surface,
                        [&](std::int32_t pixel, side s) { return g.neighbor(pixel, s) == no_pixel; });
    tracer.prune_spurs(options.min_length);
    const corner_map& corners = tracer.corners();

    const auto is_constrained = [&](std::int32_t corner, const discontinuity& last) {
        if (options.constraints == constrained_ends::none || corners.on_border(corner)) return false;
        if (options.constraints == constrained_ends::all) return true;
        if (corners.degree(corner) == 1) return false;
        float farthest = disparity[last.back];
        for (std::int32_t pixel : tracer.pixels_around(corner)) farthest = (std::min)(farthest, disparity[pixel]);
        return !surface.same_surface(disparity[last.back], farthest);
    };
    const auto constraint_at = [&](const traced_curve& t, bool at_start) {
        const std::size_t length = (std::min)(options.tangent_length, t.sides.size());
        const std::size_t last = t.corners.size() - 1;
        const std::int32_t end = t.corners[at_start ? 0 : last], inner = t.corners[at_start ? length : last - length];
        const float x = detail::nearest_float(corners.x(end)), dx = x - detail::nearest_float(corners.x(inner)),
                    y = detail::nearest_float(corners.y(end)), dy = y - detail::nearest_float(corners.y(inner));
        const float norm = (std::max)(detail::vector_length(dx, dy), 1e-6F);
        growth_constraint c{x, y, dx / norm, dy / norm, -dy / norm, dx / norm};
        float toward_front = 0.0F;
        for (std::size_t i = 0; i < length; ++i) {
            const side s = t.sides[at_start ? i : t.sides.size() - 1 - i].toward_front;
            toward_front +=
                c.perpendicular_x * detail::nearest_float(step_x(s)) + c.perpendicular_y * detail::nearest_float(step_y(s));
        }
        if (toward_front < 0.0F) c.perpendicular_x = -c.perpendicular_x, c.perpendicular_y = -c.perpendicular_y;
        return c;
    };

    const std::size_t max_sides = (std::min)(
        options.max_sides, static_cast<std::size_t>(options.max_density * detail::nearest_float(layer.topology().size())));
    const std::size_t shortest = detail::curves::min_length_within(tracer, max_sides, options.min_length);
    buffer<traced_curve> traces;
    std::size_t kept = 0;
    tracer.for_each_curve([&](traced_curve t) {
        if (t.sides.size() >= shortest) kept += t.sides.size(), traces.push_back(std::move(t));
    });
    if (dropped_sides != nullptr) *dropped_sides = corners.side_count() - kept;
    const buffer<std::size_t> lengths = detail::curves::group_lengths(traces);
    for (std::size_t i = 0; i < traces.size(); ++i) {
        if (lengths[i] < options.min_length) continue;
        traced_curve& t = traces[i];
        discontinuity_curve curve;
        curve.is_closed = t.is_closed;
        if (!t.is_closed) {
            if (is_constrained(t.corners.front(), t.sides.front())) curve.constraints.push_back(constraint_at(t, true));
            if (is_constrained(t.corners.back(), t.sides.back())) curve.constraints.push_back(constraint_at(t, false));
        }
        curve.sides = std::move(t.sides);
        curves.push_back(std::move(curve));
    }
    return curves;
}

}}  // namespace ldi
