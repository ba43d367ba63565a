// Outlines of charts as closed polygons with vertices at the corners between pixels (paper, section "Meshing", Figure "meshing"
// a), divided into pieces that neighboring charts share.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/mesh/detail/boundary_walk.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Value of boundary_piece::left_chart along a silhouette or along the photo's border.
inline constexpr std::int32_t no_chart = -1;

/// A point between pixels. Linked pixels at one lattice point share one corner, even if they belong to different charts.
struct outline_corner {
    std::int32_t x, y;  ///< lattice point: the top left corner of pixel (x, y)
    float disparity;    ///< average over the pixels that share the corner
};

/// A section of a boundary with one chart on its right and one chart, or none, on its left. Pieces end where three or more
/// charts meet, where silhouettes begin or end, at the corners of the photo, and where an outline reaches the photo's border.
struct boundary_piece {
    std::int32_t right_chart;  ///< chart on the right
    std::int32_t left_chart;   ///< chart on the left, or no_chart
    std::int32_t start, end;   ///< indices of corners; equal if the piece is a closed loop
    std::int32_t first_inner;  ///< corners between start and end: corners[first_inner .. first_inner + inner_count)
    std::int32_t inner_count;
};

/// A piece as part of a chart's outline: forward for the chart on its right, backward for the chart on its left.
struct outline_step {
    std::int32_t piece;
    bool reversed;
};

/// Outlines of all charts. Each chart has one or more loops. Outer loops run clockwise as seen in the photo, and holes
/// counter-clockwise, so the chart always lies to the right. Where an outline touches itself, it visits the corner once for
/// each part of the chart that meets there.
struct chart_outlines {
    buffer<outline_corner> corners;
    buffer<boundary_piece> pieces;
    buffer<outline_step> steps;       ///< steps of all loops, loop by loop
    buffer<std::int32_t> first_step;  ///< loop l has steps [first_step[l], first_step[l + 1])
    buffer<std::int64_t> loop_area;   ///< area in pixels: positive for outer loops, otherwise negative or 0
    buffer<std::int32_t> first_loop;  ///< chart c has loops [first_loop[c], first_loop[c + 1])
    /// One per pixel: bit 0, 1, 2 or 3 is set if the pixel's upper, right, lower or left side is a boundary of its chart.
    buffer<std::uint8_t> boundary_sides;
    buffer<std::int32_t> boundary_pixels;  ///< pixels with any bit set, ascending
};

/// Traces the outlines of all charts.
///
/// g          in canonical order
/// disparity  K values, one per pixel
/// charts     a partition of the pixels; no two pixels of a chart share a position
///
/// Raises mismatch if a right neighbor is not the next pixel, as it is in canonical order, or if the arguments don't fit
/// together; and too_large for a chart larger than max_chart_box.
chart_outlines trace_outlines(const graph& g, std::span<const float> disparity, const chart_set& charts);
/// Does the same for a view of a graph. Also raises mismatch if the view violates an invariant of `graph`, even in release
/// builds.
chart_outlines trace_outlines(const graph_view& g, std::span<const float> disparity, const chart_set& charts);

namespace detail {

/// Traces the pieces one by one, and then connects them into loops. Traces each piece once, for both of its charts.
class outline_tracer {
public:
    outline_tracer(const graph_view& g, std::span<const float> disparity, const chart_set& charts, chart_outlines& result)
        : g_(g), disparity_(disparity.data()), chart_of_(charts.chart_of), result_(result), walk_(g, result.boundary_sides) {}

    void trace_pieces() {
        buffer<std::uint8_t>& sides = result_.boundary_sides;
        const buffer<std::int32_t>& boundary_pixels = result_.boundary_pixels;
        result_.corners.reserve(boundary_pixels.size());
        for (std::int32_t pixel : boundary_pixels)
            for (int s = 0; s < 4; ++s)
                if (walk_.is_boundary(pixel, s) && !is_traced({pixel, s})) trace_piece({pixel, s});
        for (std::int32_t pixel : boundary_pixels) sides[pixel] &= 0x0F;
    }

    void unite_junctions() {
        std::sort(junctions_.begin(), junctions_.end(),
                  [](const junction& a, const junction& b) { return a.key != b.key ? a.key < b.key : a.slot < b.slot; });
        for (std::size_t j = 0; j < junctions_.size(); ++j) {
            if (j == 0 || junctions_[j].key != junctions_[j - 1].key) result_.corners.push_back(junctions_[j].corner);
            const std::int32_t id = result_.corners.count() - 1;
            boundary_piece& piece = result_.pieces[junctions_[j].slot / 2];
            (junctions_[j].slot % 2 == 0 ? piece.start : piece.end) = id;
        }
    }

    void assemble_loops(std::size_t chart_count) {
        buffer<loop> loops;
        buffer<outline_step> steps;
        find_loops(loops, steps);
        stable_sort(loops, [](const loop& a, const loop& b) { return a.chart < b.chart; });
        result_.first_loop.assign(chart_count + 1, 0);
        result_.steps.reserve(steps.size());
        for (const loop& l : loops) {
            result_.first_step.push_back(result_.steps.count());
            std::int64_t area = 0;
            for (std::int32_t s = l.first; s < l.first + l.count; ++s) {
                const outline_step step = steps[s];
                const std::int64_t swept = area_swept(result_.pieces[step.piece]);
                area += step.reversed ? -swept : swept;
                result_.steps.push_back(step);
            }
            result_.loop_area.push_back(area);
            ++result_.first_loop[l.chart + 1];
        }
        result_.first_step.push_back(result_.steps.count());
        for (std::size_t c = 0; c < chart_count; ++c) result_.first_loop[c + 1] += result_.first_loop[c];
    }

private:
    struct piece_ends {
        pixel_side first, last;  // as seen from the chart on the right
    };
    struct junction {
        std::int64_t key;
        std::size_t slot;  // 2 * piece for its start, 2 * piece + 1 for its end
        outline_corner corner;
    };
    struct running_mean {
        float sum = 0, count = 0;
        void add(float value) { sum += value, count += 1.0F; }
        float value() const { return sum / count; }
    };
    struct loop {
        std::int32_t chart, first, count;
    };

    static std::int64_t key(pixel_side e) { return std::int64_t{e.pixel} * 4 + e.side; }
    bool is_traced(pixel_side e) const { return (result_.boundary_sides[e.pixel] & side_bit(e.side + 4)) != 0; }
    void set_traced(pixel_side e) { result_.boundary_sides[e.pixel] |= side_bit(e.side + 4); }

    /// Returns the chart across a boundary side, or a negative number: one value for silhouettes and one for each border of the
    /// photo.
    std::int32_t partner(pixel_side e) const {
        const std::int32_t n = walk_.neighbor(e.pixel, e.side);
        if (n != no_pixel) return chart_of_[n];
        const bool on_border = e.side == 0   ? g_.y()[e.pixel] == 0
                               : e.side == 1 ? g_.x()[e.pixel] == g_.width() - 1
                               : e.side == 2 ? g_.y()[e.pixel] == g_.height() - 1
                                             : g_.x()[e.pixel] == 0;
        return on_border ? -2 - e.side : no_chart;
    }

    /// Returns the signed area between a piece and the y axis: the piece's contribution to the area of a loop that runs forward
    /// through it.
    std::int64_t area_swept(const boundary_piece& piece) const {
        const outline_corner* before = &result_.corners[piece.start];
        std::int64_t area = 0;
        const auto advance = [&](const outline_corner& to) {
            area += std::int64_t{before->x} * (to.y - before->y);  // exact, because every step is horizontal or vertical
            before = &to;
        };
        for (std::int32_t i = 0; i < piece.inner_count; ++i) advance(result_.corners[piece.first_inner + i]);
        advance(result_.corners[piece.end]);
        return area;
    }

    /// Finds the loops of all charts, in arbitrary order. The steps of each loop are consecutive.
    void find_loops(buffer<loop>& loops, buffer<outline_step>& steps) const {
        // Each piece has two halves: half 2 * p is piece p traversed forward, and half 2 * p + 1 is the same piece traversed
        // backward. The first side of a half identifies it.
        buffer<std::pair<std::int64_t, std::int32_t>> first_sides;
        first_sides.reserve(2 * ends_.size());
        for (std::int32_t p = 0; p < ends_.count(); ++p) {
            first_sides.emplace_back(key(ends_[p].first), 2 * p);
            if (result_.pieces[p].left_chart != no_chart) first_sides.emplace_back(key(walk_.twin(ends_[p].last)), 2 * p + 1);
        }
        std::sort(first_sides.begin(), first_sides.end());
        const auto successor = [&](std::int32_t half) {
            const piece_ends& e = ends_[half / 2];
            const pixel_side next = walk_.next(half % 2 == 0 ? e.last : walk_.twin(e.first));
            return std::lower_bound(first_sides.begin(), first_sides.end(), std::pair(key(next), std::int32_t{0}))->second;
        };
        buffer<std::uint8_t> used(2 * ends_.size(), 0);
        for (const auto& [side, first_half] : first_sides) {
            if (used[first_half]) continue;
            const boundary_piece& piece = result_.pieces[first_half / 2];
            loops.push_back({first_half % 2 == 0 ? piece.right_chart : piece.left_chart, steps.count(), 0});
            std::int32_t half = first_half;
            do {
                used[half] = 1;
                steps.push_back({half / 2, half % 2 != 0});
                half = successor(half);
            } while (half != first_half);
            loops.back().count = steps.count() - loops.back().first;
        }
    }

    void trace_piece(pixel_side seed) {
        const std::int32_t other = partner(seed);
        const auto mark = [&](pixel_side e) {
            set_traced(e);
            if (other >= 0) set_traced(walk_.twin(e));
        };
        running_mean mean;
        const auto visit = [&](std::int32_t pixel) { mean.add(disparity_[pixel]); };

        forward_.clear(), backward_.clear();
        bool closed = false;
        pixel_side last = seed;
        std::int32_t x = corner_x(g_, seed.pixel, clockwise(seed.side)), y = corner_y(g_, seed.pixel, clockwise(seed.side));
        while (true) {
            mark(last);
            mean = {};
            const pixel_side following = walk_.next(last, visit);
            if (partner(following) != other) break;
            // The piece continues if the two sides are also consecutive on the boundary of the other chart. Otherwise, a third
            // chart or a silhouette begins here.
            if (other >= 0 && !(walk_.next(walk_.twin(following), visit) == walk_.twin(last))) break;
            forward_.push_back({x, y, mean.value()});
            last = following;
            if (last == seed) {
                closed = true;
                break;
            }
            x += heading_x(last.side), y += heading_y(last.side);
        }
        pixel_side first = seed;
        x = corner_x(g_, seed.pixel, seed.side), y = corner_y(g_, seed.pixel, seed.side);
        while (!closed) {
            mean = {};
            const pixel_side preceding = walk_.previous(first, visit);
            if (partner(preceding) != other) break;
            if (other >= 0 && !(walk_.next(walk_.twin(first), visit) == walk_.twin(preceding))) break;
            backward_.push_back({x, y, mean.value()});
            first = preceding;
            mark(first);
            x -= heading_x(first.side), y -= heading_y(first.side);
        }
        add_piece(seed, first, closed ? walk_.previous(seed, [](std::int32_t) {}) : last, other, closed);
    }

    void add_piece(pixel_side seed, pixel_side first, pixel_side last, std::int32_t other, bool closed) {
        buffer<outline_corner>& corners = result_.corners;
        boundary_piece piece{chart_of_[seed.pixel], other < 0 ? no_chart : other, 0, 0, 0, 0};
        piece.first_inner = corners.count();
        corners.insert(corners.end(), std::reverse_iterator(backward_.end()), std::reverse_iterator(backward_.begin()));
        corners.insert(corners.end(), forward_.begin(), forward_.end());
        const std::size_t index = result_.pieces.size();
        piece.inner_count = corners.count() - piece.first_inner - (closed ? 1 : 0);
        if (closed) {
            piece.start = piece.end = corners.count() - 1;
        } else {
            add_junction(first.pixel, first.side, 2 * index);
            add_junction(last.pixel, clockwise(last.side), 2 * index + 1);
        }
        result_.pieces.push_back(piece);
        ends_.push_back({first, last});
    }

    void add_junction(std::int32_t pixel, int corner, std::size_t slot) {
        running_mean mean;
        const pixel_corner first =
            walk_.visit_corner_class({pixel, corner}, [&](std::int32_t member) { mean.add(disparity_[member]); });
        const outline_corner at{corner_x(g_, pixel, corner), corner_y(g_, pixel, corner), mean.value()};
        junctions_.push_back({std::int64_t{first.pixel} * 4 + first.corner, slot, at});
    }

    graph_view g_;
    const float* disparity_;
    const buffer<std::int32_t>& chart_of_;
    chart_outlines& result_;
    boundary_walker walk_;
    buffer<piece_ends> ends_;
    buffer<junction> junctions_;
    buffer<outline_corner> forward_, backward_;
};

/// trace_outlines() for a graph whose invariants hold.
inline chart_outlines outlines_of_sound(const graph_view& g, std::span<const float> disparity, const chart_set& charts) {
    if (disparity.size() != g.size())
        raise(error_code::mismatch, "trace_outlines", std::to_string(g.size()) + " disparities",
              std::to_string(disparity.size()));
    check_charts(charts, g, "trace_outlines");
    chart_outlines result;
    result.boundary_sides = mark_boundary_sides(g, charts.chart_of);
    result.boundary_pixels = pixels_with_boundary(result.boundary_sides);
    outline_tracer tracer(g, disparity, charts, result);
    tracer.trace_pieces();
    tracer.unite_junctions();
    tracer.assemble_loops(charts.charts.size());
    return result;
}

}  // namespace detail

inline chart_outlines trace_outlines(const graph& g, std::span<const float> disparity, const chart_set& charts) {
    return detail::outlines_of_sound(g, disparity, charts);
}
inline chart_outlines trace_outlines(const graph_view& g, std::span<const float> disparity, const chart_set& charts) {
    check_topology(g, "trace_outlines");
    return detail::outlines_of_sound(g, disparity, charts);
}

}}  // namespace ldi
