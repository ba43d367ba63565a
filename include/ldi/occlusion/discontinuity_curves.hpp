// Depth discontinuities of a lifted photo, grouped into curves, with the lines at their ends that hidden surfaces must not grow
// past (paper, section "Occluded Surface Hallucination", and Figure "depth_expand").
//
// A discontinuity runs along the sides of pixels, between the corners of the lattice. Where three or more sides with a
// discontinuity meet in a corner there is a junction, and curves end.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

struct curve_options {
    /// Curves shorter than this, in pixel sides, are spurious and dropped: nothing grows behind them, and
    /// close_spurious_discontinuities() closes them.
    std::size_t shortest_length = 20;
    /// The direction of a curve at its end is taken over this many pixel sides.
    std::size_t tangent_length = 20;
};

/// One side of a pixel with a discontinuity.
struct discontinuity {
    std::int32_t back;   ///< the pixel on the far side
    std::int32_t front;  ///< the pixel on the near side
    side towards_front;  ///< the side of `back` that `front` lies on
};

/// A half line that the hidden surface behind a curve must not cross: it starts at the curve's end, perpendicular to the curve,
/// and points behind the front surface. All in lattice coordinates, where pixel (x, y) covers [x, x + 1) x [y, y + 1).
struct growth_constraint {
    float x, y;                              ///< the curve's end
    float outward_x, outward_y;              ///< unit vector along the curve, out of its end
    float perpendicular_x, perpendicular_y;  ///< unit vector along the half line
};

/// A maximal chain of discontinuities between ends or junctions, in order along the curve.
struct discontinuity_curve {
    buffer<discontinuity> sides;
    buffer<growth_constraint> constraints;  ///< at most one per end
    bool is_closed = false;
};

namespace detail::curves {

// Corners of the lattice, numbered y * (width + 1) + x, with one bit for each discontinuity that starts there.
class corner_map {
public:
    explicit corner_map(const graph& g) : stride_(g.width + 1), width_(g.width), height_(g.height) {
        present_.assign(static_cast<std::size_t>(std::int64_t{stride_} * (height_ + 1)), 0);
    }

    void add(std::int32_t corner, side towards) {
        if (present_[corner] == 0) used_.push_back(corner);
        present_[corner] |= bit(towards);
        const std::int32_t other = next(corner, towards);
        if (present_[other] == 0) used_.push_back(other);
        present_[other] |= bit(opposite(towards));
    }

    const buffer<std::int32_t>& used() const { return used_; }
    std::int32_t corner(std::int32_t x, std::int32_t y) const { return y * stride_ + x; }
    std::int32_t x(std::int32_t c) const { return c % stride_; }
    std::int32_t y(std::int32_t c) const { return c / stride_; }
    std::int32_t next(std::int32_t c, side towards) const { return c + step_x(towards) + step_y(towards) * stride_; }
    bool has(std::int32_t c, side towards) const { return (present_[c] & bit(towards)) != 0; }
    bool on_border(std::int32_t c) const { return x(c) == 0 || y(c) == 0 || x(c) == width_ || y(c) == height_; }
    int degree(std::int32_t c) const {
        int count = 0;
        for (side s : all_sides) count += has(c, s) ? 1 : 0;
        return count;
    }
    void remove(std::int32_t c, side towards) {
        LDI_ASSERT(has(c, towards));
        present_[c] ^= bit(towards);
        present_[next(c, towards)] ^= bit(opposite(towards));
    }

private:
    static std::uint8_t bit(side s) { return static_cast<std::uint8_t>(1U << static_cast<unsigned>(s)); }

    std::int32_t stride_, width_, height_;
    buffer<std::uint8_t> present_;
    buffer<std::int32_t> used_;
};

// A curve as it is traced: its corners, one more than its sides.
struct trace {
    buffer<std::int32_t> corners;
    buffer<discontinuity> sides;
    bool is_closed = false;
};

class tracer {
public:
    tracer(const graph& g, const buffer<float>& disparity) : graph_(g), disparity_(disparity), all_(g) {
        for (std::int32_t y = 0; y < g.height; ++y) {
            const std::int32_t start = y * g.width;
            for (std::int32_t x = 0; x + 1 < g.width; ++x)
                if (g.right[start + x] == no_pixel) all_.add(all_.corner(x + 1, y), side::down);
            if (y + 1 == g.height) break;
            for (std::int32_t x = 0; x < g.width; ++x)
                if (g.down[start + x] == no_pixel) all_.add(all_.corner(x, y + 1), side::right);
        }
    }

    // Calls visit(trace) for every curve: first those that start at an end or a junction, then the closed ones.
    template <class Visit>
    void for_each_curve(Visit&& visit) const {
        corner_map left = all_;
        for (std::int32_t corner : all_.used())
            if (all_.degree(corner) != 2)
                for (side s : all_sides)
                    if (left.has(corner, s)) visit(follow(left, corner, s));
        for (std::int32_t corner : all_.used())
            for (side s : all_sides)
                if (left.has(corner, s)) visit(follow(left, corner, s));
    }

    const corner_map& corners() const { return all_; }

    // The pixels around a corner that is not on the border.
    std::array<std::int32_t, 4> pixels_around(std::int32_t corner) const {
        const std::int32_t below_right = all_.y(corner) * graph_.width + all_.x(corner);
        return {below_right - graph_.width - 1, below_right - graph_.width, below_right - 1, below_right};
    }

private:
    trace follow(corner_map& left, std::int32_t corner, side towards) const {
        trace t;
        t.corners.push_back(corner);
        while (true) {
            t.sides.push_back(discontinuity_between(corner, towards));
            left.remove(corner, towards);
            corner = all_.next(corner, towards);
            t.corners.push_back(corner);
            if (all_.degree(corner) != 2) return t;
            bool found = false;
            for (side s : all_sides)
                if (!found && left.has(corner, s)) towards = s, found = true;
            if (!found) {  // back at the start of a closed curve
                t.is_closed = true;
                return t;
            }
        }
    }

    // The two pixels on either side of the lattice edge that leaves `corner`.
    discontinuity discontinuity_between(std::int32_t corner, side towards) const {
        const bool vertical = towards == side::up || towards == side::down;
        const std::int32_t x = all_.x(corner) - (towards == side::left ? 1 : 0),
                           y = all_.y(corner) - (towards == side::up ? 1 : 0);
        const std::int32_t second = y * graph_.width + x, first = second - (vertical ? 1 : graph_.width);
        const side first_to_second = vertical ? side::right : side::down;
        if (disparity_[first] > disparity_[second]) return {second, first, opposite(first_to_second)};
        return {first, second, first_to_second};
    }

    const graph& graph_;
    const buffer<float>& disparity_;
    corner_map all_;
};

}  // namespace detail::curves

/// At junctions only curves between a midground and what is in front of it are constrained: the farthest of the surfaces that
/// meet may grow freely under all others. Ends on the photo's border are not constrained. Curves come in a fixed order.
template <payload_column... Columns>
buffer<discontinuity_curve> find_discontinuity_curves(const single_layer<Columns...>& layer, const curve_options& options = {}) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    const buffer<float>& disparity = layer.template column<disparity_column>();
    buffer<discontinuity_curve> curves;
    const detail::curves::tracer tracer(layer.topology, disparity);
    const detail::curves::corner_map& corners = tracer.corners();

    const auto is_constrained = [&](std::int32_t corner, const discontinuity& last) {
        if (corners.on_border(corner)) return false;
        if (corners.degree(corner) == 1) return true;
        float farthest = disparity[last.back];
        for (std::int32_t pixel : tracer.pixels_around(corner)) farthest = (std::min)(farthest, disparity[pixel]);
        return !layer.surface.same_surface(disparity[last.back], farthest);
    };
    const auto constraint_at = [&](const detail::curves::trace& t, bool at_start) {
        const std::size_t length = (std::min)(options.tangent_length, t.sides.size());
        const std::size_t last = t.corners.size() - 1;
        const std::int32_t end = t.corners[at_start ? 0 : last], inner = t.corners[at_start ? length : last - length];
        const float x = detail::nearest_float(corners.x(end)), dx = x - detail::nearest_float(corners.x(inner)),
                    y = detail::nearest_float(corners.y(end)), dy = y - detail::nearest_float(corners.y(inner));
        const float norm = (std::max)(std::hypot(dx, dy), 1e-6F);
        growth_constraint c{x, y, dx / norm, dy / norm, -dy / norm, dx / norm};
        float towards_front = 0.0F;
        for (std::size_t i = 0; i < length; ++i) {
            const side s = t.sides[at_start ? i : t.sides.size() - 1 - i].towards_front;
            towards_front +=
                c.perpendicular_x * detail::nearest_float(step_x(s)) + c.perpendicular_y * detail::nearest_float(step_y(s));
        }
        if (towards_front < 0.0F) c.perpendicular_x = -c.perpendicular_x, c.perpendicular_y = -c.perpendicular_y;
        return c;
    };

    tracer.for_each_curve([&](detail::curves::trace t) {
        if (t.sides.size() < options.shortest_length) return;
        discontinuity_curve curve;
        curve.is_closed = t.is_closed;
        if (!t.is_closed) {
            if (is_constrained(t.corners.front(), t.sides.front())) curve.constraints.push_back(constraint_at(t, true));
            if (is_constrained(t.corners.back(), t.sides.back())) curve.constraints.push_back(constraint_at(t, false));
        }
        curve.sides = std::move(t.sides);
        curves.push_back(std::move(curve));
    });
    return curves;
}

}  // namespace ldi
