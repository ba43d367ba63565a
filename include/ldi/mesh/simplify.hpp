// Simplifies the boundaries of charts with the Douglas-Peucker algorithm (paper, section "Meshing", Figure "meshing" b). A piece
// between two charts is simplified once, so both charts have the same vertices along it and fit together without cracks.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/mesh/outlines.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of simplified_boundary.
struct simplify_options {
    /// Maximum distance of a corner from the simplified boundary, in pixels, at least 0. With 0, only corners on straight lines
    /// are dropped.
    float tolerance = 1.0F;
    /// Maximum difference in disparity between a corner and the simplified boundary, at least 0. This limit makes a boundary
    /// bend where its surface bends.
    float disparity_tolerance = 0.01F;
    /// Maximum shift of the texture, in pixels, above 0, that perspective-correct rendering may cause along an edge. Edges with a
    /// larger shift are split (depth_range::texture_shift).
    float texture_tolerance = 0.5F;
};

/// An edge of the simplified boundary: from the kept corner with index `index` of a piece to the next kept corner.
struct boundary_edge {
    std::int32_t piece, index;
    friend bool operator<(const boundary_edge& a, const boundary_edge& b) {
        return a.piece != b.piece ? a.piece < b.piece : a.index < b.index;
    }
    friend bool operator==(const boundary_edge&, const boundary_edge&) = default;
};

/// A corner at which to split an edge of the simplified boundary.
struct boundary_split {
    boundary_edge edge;
    std::int32_t corner;
    friend bool operator<(const boundary_split& a, const boundary_split& b) {
        return a.edge == b.edge ? a.corner < b.corner : a.edge < b.edge;
    }
    friend bool operator==(const boundary_split&, const boundary_split&) = default;
};

/// For every piece of a boundary, the indices of the corners that simplification keeps, from the piece's start to its end, both
/// included. split() refines individual edges if a simplified outline would cross itself.
class simplified_boundary {
public:
    /// Raises invalid_option if a tolerance is negative, or texture_tolerance is 0, and mismatch for a piece with corners that
    /// `outlines` does not have. `outlines` must outlive the result.
    simplified_boundary(const chart_outlines& outlines, const simplify_options& options, const depth_range& depths = {});
    simplified_boundary(const chart_outlines&&, const simplify_options&, const depth_range& = {}) = delete;

    std::span<const std::int32_t> corners(std::int32_t piece) const {
        const std::int32_t* const first = kept_.data() + stretches_[piece].first;
        return {first, first + stretches_[piece].count};
    }

    /// Returns the range [first, second) of the corners that an edge skips.
    std::pair<std::int32_t, std::int32_t> left_out(boundary_edge edge) const;

    /// Returns the corner farthest from an edge among those that the edge skips. The edge must skip at least one.
    std::int32_t farthest_left_out(boundary_edge edge) const;

    /// Splits several edges at once, at corners that they skip.
    ///
    /// splits  sorted, without duplicates, at corners within left_out() of their edges
    ///
    /// Raises mismatch for any other splits; the boundary then remains unchanged.
    void split(std::span<const boundary_split> splits);

    /// Whether the latest call of split() created this edge. Before the first call, all edges are fresh.
    bool is_fresh(boundary_edge edge) const {
        const stretch& r = stretches_[edge.piece];
        return r.split == splits_ && fresh_[r.first + edge.index] != 0;
    }

private:
    /// The kept corners of a piece: kept_[first .. first + count).
    struct stretch {
        std::int32_t first, count;
        std::int32_t split;  ///< number of the call of split() that created the stretch
    };

    const outline_corner& corner(std::int32_t id) const { return outlines_.corners[id]; }
    /// Whether the boundary has this edge, and the edge skips this corner.
    bool can_split(const boundary_split& s) const;

    const chart_outlines& outlines_;
    buffer<std::int32_t> kept_;
    /// Per element of kept_: whether the latest split of its piece created the edge that starts there.
    buffer<std::uint8_t> fresh_;
    buffer<stretch> stretches_;
    std::int32_t splits_ = 0;
};

namespace detail {

/// Marks the points of a polyline that Douglas-Peucker keeps, including both ends. The error of a corner is the larger of two
/// ratios: its distance to the segment over the tolerance, and its difference in disparity over disparity_tolerance. If no error
/// exceeds 1 but the segment shifts the texture too far, the segment is split in the middle.
inline void douglas_peucker(const buffer<outline_corner>& points, const simplify_options& options, const depth_range& range,
                            buffer<std::uint8_t>& keep, buffer<std::pair<std::int32_t, std::int32_t>>& stack) {
    keep.assign(points.size(), 0);
    keep.front() = keep.back() = 1;
    // A tolerance of 0 also drops points on the segment. The minimum of 1e-3 absorbs the rounding errors of the distances
    // computed below.
    const float inverse_tolerance = 1.0F / (std::max)(options.tolerance, 1e-3F);
    const float inverse_disparity_tolerance = 1.0F / (std::max)(options.disparity_tolerance, 1e-6F);
    stack.assign(1, {0, points.count() - 1});
    while (!stack.empty()) {
        const auto [first, last] = stack.back();
        stack.pop_back();
        if (last - first < 2) continue;
        const outline_corner a = points[first], b = points[last];
        const float dx = nearest_float(b.x - a.x), dy = nearest_float(b.y - a.y), dd = b.disparity - a.disparity;
        const float squared_length = dx * dx + dy * dy;
        const float inverse_length = squared_length > 0 ? 1.0F / squared_length : 0.0F;
        float worst = 1.0F;
        std::int32_t split = -1;
        for (std::int32_t i = first + 1; i < last; ++i) {
            const outline_corner& p = points[i];
            const float px = nearest_float(p.x - a.x), py = nearest_float(p.y - a.y);
            const float along = std::clamp((px * dx + py * dy) * inverse_length, 0.0F, 1.0F);
            const float ex = (px - along * dx) * inverse_tolerance, ey = (py - along * dy) * inverse_tolerance;
            const float ed = (p.disparity - a.disparity - along * dd) * inverse_disparity_tolerance;
            const float error = (std::max)(ex * ex + ey * ey, ed * ed);
            if (error > worst) worst = error, split = i;
        }
        if (split < 0 && range.texture_shift(std::sqrt(squared_length), a.disparity, b.disparity) > options.texture_tolerance)
            split = first + (last - first) / 2;
        if (split < 0) continue;
        keep[split] = 1;
        stack.emplace_back(first, split);
        stack.emplace_back(split, last);
    }
}

}  // namespace detail

inline simplified_boundary::simplified_boundary(const chart_outlines& outlines, const simplify_options& options,
                                                const depth_range& depths)
    : outlines_(outlines) {
    if (!(options.tolerance >= 0) || !(options.disparity_tolerance >= 0) || !(options.texture_tolerance > 0))
        raise(error_code::invalid_option, "simplify_options", "tolerances of at least 0, and a texture_tolerance above 0",
              detail::to_text(options.tolerance) + ", " + detail::to_text(options.disparity_tolerance) + " and " +
                  detail::to_text(options.texture_tolerance));
    buffer<outline_corner> points;
    buffer<std::uint8_t> keep;
    buffer<std::pair<std::int32_t, std::int32_t>> stack;
    stretches_.reserve(outlines.pieces.size());
    const std::int32_t count = outlines.corners.count();
    for (const boundary_piece& p : outlines.pieces) {
        if ((std::min)({p.start, p.end, p.first_inner, p.inner_count}) < 0 || (std::max)(p.start, p.end) >= count ||
            p.inner_count > count - p.first_inner)
            raise(error_code::mismatch, "simplified_boundary", "pieces with indices of " + std::to_string(count) + " corners",
                  "an index out of range");
        const auto inner = outlines.corners.begin() + p.first_inner;
        points.assign(1, corner(p.start));
        points.insert(points.end(), inner, inner + p.inner_count);
        points.push_back(corner(p.end));
        detail::douglas_peucker(points, options, depths, keep, stack);
        const std::int32_t first = kept_.count();
        kept_.push_back(p.start);
        for (std::int32_t i = 0; i < p.inner_count; ++i)
            if (keep[i + 1] != 0) kept_.push_back(p.first_inner + i);
        kept_.push_back(p.end);
        stretches_.push_back({first, kept_.count() - first, 0});
    }
    fresh_.assign(kept_.size(), 1);
}

inline std::pair<std::int32_t, std::int32_t> simplified_boundary::left_out(boundary_edge edge) const {
    const boundary_piece& p = outlines_.pieces[edge.piece];
    const stretch& r = stretches_[edge.piece];
    const std::int32_t* const kept = kept_.data() + r.first;
    const std::int32_t i = edge.index;
    return {i == 0 ? p.first_inner : kept[i] + 1, i + 2 == r.count ? p.first_inner + p.inner_count : kept[i + 1]};
}

inline std::int32_t simplified_boundary::farthest_left_out(boundary_edge edge) const {
    const auto [first, last] = left_out(edge);
    LDI_ASSERT(first < last);
    const std::int32_t at = stretches_[edge.piece].first + edge.index;
    const outline_corner &a = corner(kept_[at]), &b = corner(kept_[at + 1]);
    const std::int64_t dx = b.x - a.x, dy = b.y - a.y;
    // If all skipped corners lie on the edge itself, return the middle one.
    std::int32_t farthest = first + (last - first) / 2;
    std::int64_t distance = 0;
    for (std::int32_t c = first; c < last; ++c) {
        const std::int64_t px = corner(c).x - a.x, py = corner(c).y - a.y;
        const std::int64_t d = dx == 0 && dy == 0 ? px * px + py * py : std::abs(dx * py - dy * px);
        if (d > distance) distance = d, farthest = c;
    }
    return farthest;
}

inline bool simplified_boundary::can_split(const boundary_split& s) const {
    const auto [piece, index] = s.edge;
    if (piece < 0 || piece >= stretches_.count() || index < 0 || index + 1 >= stretches_[piece].count) return false;
    const auto [first, last] = left_out(s.edge);
    return s.corner >= first && s.corner < last;
}

inline void simplified_boundary::split(std::span<const boundary_split> splits) {
    for (std::size_t s = 0; s < splits.size(); ++s)
        if (!can_split(splits[s]) || (s > 0 && !(splits[s - 1] < splits[s])))
            raise(error_code::mismatch, "simplified_boundary", "ascending splits at corners that the edges skip",
                  "a split of edge " + std::to_string(splits[s].edge.index) + " of piece " +
                      std::to_string(splits[s].edge.piece) + " at corner " + std::to_string(splits[s].corner));
    ++splits_;
    for (std::size_t s = 0; s < splits.size();) {
        const std::int32_t piece = splits[s].edge.piece;
        const stretch before = stretches_[piece];
        const std::int32_t first_kept = kept_.count();
        for (std::int32_t i = 0; i < before.count; ++i) {
            kept_.push_back(kept_[before.first + i]), fresh_.push_back(0);
            const boundary_edge edge{piece, i};
            for (; s < splits.size() && splits[s].edge == edge; ++s) {
                fresh_.back() = 1;
                kept_.push_back(splits[s].corner), fresh_.push_back(1);
            }
        }
        stretches_[piece] = {first_kept, kept_.count() - first_kept, splits_};
    }
}

}}  // namespace ldi
