// Simplifies the boundaries of charts after Douglas and Peucker (paper, section "Meshing", Figure "meshing" b). A piece that two
// charts share is simplified once, so both have the same vertices along it and fit together without cracks.
#pragma once

#include <ldi/core/error.hpp>
#include <ldi/mesh/outlines.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi {

struct simplify_options {
    /// How far, in pixels, a corner may lie from the simplified boundary. 0 only drops corners inside straight stretches.
    float tolerance = 1.0F;
    /// How far the disparity of a corner may be from that of the simplified boundary: a shared boundary bends where its surface
    /// does.
    float disparity_tolerance = 0.004F;
};

/// What is left of every piece: indices of corners, from the start of the piece to its end, both included. Single pieces can be
/// refined when a simplified outline would cross itself.
class simplified_boundary {
public:
    simplified_boundary(const chart_outlines& outlines, const simplify_options& options);

    std::span<const std::int32_t> corners(std::int32_t piece) const {
        const range& r = ranges_[static_cast<std::size_t>(piece)];
        return {kept_.data() + r.first, r.count};
    }

    /// Simplifies a piece again, more carefully: with half the tolerance each time, and from the third time on not at all.
    /// Returns false if nothing was left to refine.
    bool refine(std::int32_t piece);

private:
    struct range {
        std::size_t first, count;
        std::uint8_t level;
    };
    static constexpr std::uint8_t detailed = 3;

    void simplify(std::int32_t piece);

    const chart_outlines& outlines_;
    simplify_options options_;
    std::vector<std::int32_t> kept_;
    std::vector<range> ranges_;
    std::vector<outline_corner> points_;
    std::vector<std::uint8_t> keep_;
    std::vector<std::pair<std::int32_t, std::int32_t>> stack_;
};

namespace detail {

/// Marks what Douglas-Peucker keeps of a polyline, its ends included. A corner's error is its distance to the segment in units of
/// the tolerance, or that of its disparity in units of the other, whichever is larger.
inline void douglas_peucker(std::span<const outline_corner> points, float tolerance, float disparity_tolerance,
                            std::vector<std::uint8_t>& keep, std::vector<std::pair<std::int32_t, std::int32_t>>& stack) {
    keep.assign(points.size(), 0);
    keep.front() = keep.back() = 1;
    // A tolerance of zero still lets go of points on the segment itself, to within the rounding of the arithmetic below.
    const float inverse_tolerance = 1.0F / std::max(tolerance, 1e-3F);
    const float inverse_disparity_tolerance = 1.0F / std::max(disparity_tolerance, 1e-6F);
    stack.assign(1, {0, static_cast<std::int32_t>(points.size()) - 1});
    while (!stack.empty()) {
        const auto [first, last] = stack.back();
        stack.pop_back();
        if (last - first < 2) continue;
        const outline_corner a = points[static_cast<std::size_t>(first)], b = points[static_cast<std::size_t>(last)];
        const float dx = static_cast<float>(b.x - a.x), dy = static_cast<float>(b.y - a.y), dd = b.disparity - a.disparity;
        const float squared_length = dx * dx + dy * dy;
        const float inverse_length = squared_length > 0 ? 1.0F / squared_length : 0.0F;
        float worst = 1.0F;
        std::int32_t split = -1;
        for (std::int32_t i = first + 1; i < last; ++i) {
            const outline_corner& p = points[static_cast<std::size_t>(i)];
            const float px = static_cast<float>(p.x - a.x), py = static_cast<float>(p.y - a.y);
            const float along = std::clamp((px * dx + py * dy) * inverse_length, 0.0F, 1.0F);
            const float ex = (px - along * dx) * inverse_tolerance, ey = (py - along * dy) * inverse_tolerance;
            const float ed = (p.disparity - a.disparity - along * dd) * inverse_disparity_tolerance;
            const float error = std::max(ex * ex + ey * ey, ed * ed);
            if (error > worst) worst = error, split = i;
        }
        if (split < 0) continue;
        keep[static_cast<std::size_t>(split)] = 1;
        stack.emplace_back(first, split);
        stack.emplace_back(split, last);
    }
}

}  // namespace detail

inline simplified_boundary::simplified_boundary(const chart_outlines& outlines, const simplify_options& options)
    : outlines_(outlines), options_(options), ranges_(outlines.pieces.size(), range{0, 0, 0}) {
    if (!(options.tolerance >= 0) || !(options.disparity_tolerance >= 0))
        raise(error_code::invalid_option, "simplify_options", "tolerances of at least 0",
              std::to_string(options.tolerance) + " and " + std::to_string(options.disparity_tolerance));
    for (std::size_t p = 0; p < outlines.pieces.size(); ++p) simplify(static_cast<std::int32_t>(p));
}

inline bool simplified_boundary::refine(std::int32_t piece) {
    range& r = ranges_[static_cast<std::size_t>(piece)];
    const std::size_t all = static_cast<std::size_t>(outlines_.pieces[static_cast<std::size_t>(piece)].inner_count) + 2;
    const std::size_t before = r.count;
    while (r.level < detailed && r.count == before && before < all) {
        ++r.level;
        simplify(piece);
    }
    return r.count != before;
}

inline void simplified_boundary::simplify(std::int32_t piece) {
    const boundary_piece& p = outlines_.pieces[static_cast<std::size_t>(piece)];
    range& r = ranges_[static_cast<std::size_t>(piece)];
    const auto inner = outlines_.corners.begin() + p.first_inner;
    points_.assign(1, outlines_.corners[static_cast<std::size_t>(p.start)]);
    points_.insert(points_.end(), inner, inner + p.inner_count);
    points_.push_back(outlines_.corners[static_cast<std::size_t>(p.end)]);
    if (r.level < detailed)
        detail::douglas_peucker(points_, std::ldexp(options_.tolerance, -r.level), options_.disparity_tolerance, keep_, stack_);
    else
        keep_.assign(points_.size(), 1);
    r.first = kept_.size();
    kept_.push_back(p.start);
    for (std::int32_t i = 0; i < p.inner_count; ++i)
        if (keep_[static_cast<std::size_t>(i) + 1] != 0) kept_.push_back(p.first_inner + i);
    kept_.push_back(p.end);
    r.count = kept_.size() - r.first;
}

}  // namespace ldi
