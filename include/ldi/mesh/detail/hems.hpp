// Hems: strips that extend a hidden surface behind the nearer surface at which it ends. A hidden surface ends at another hidden
// surface of similar depth if the two cannot be linked (occlusion/detail/expansion.hpp). At the free end of a silhouette
// (core/trace_curves.hpp), a hidden surface ends at the surface that the photo shows. The outlines of the two surfaces are
// simplified independently and lie at different depths. Without a hem, a moving camera would see a gap between them.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/mesh/detail/outline_normals.hpp>
#include <ldi/mesh/detail/pixel_stacks.hpp>
#include <ldi/mesh/flat_mesh.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The outer end of a hem at a corner of an outline: its offset from the corner in pixels, and its disparity.
struct hem {
    float x = 0, y = 0;
    float disparity = 0;

    bool is_empty() const { return x == 0 && y == 0; }
};

/// Finds the hems of a mesh.
class hem_finder {
public:
    /// stacks     the pixels of the layered image
    /// max_width  maximum width of a hem in pixels: the padding of the atlas, which is the texture of hems
    hem_finder(const flat_mesh& flat, const pixel_stacks& stacks, const photo_facts& facts, std::int32_t max_width)
        : flat_(flat), stacks_(stacks), max_step_(facts.surface.max_step) {
        parallax_ = max_parallax(facts.camera.width, facts.camera.height, facts.motion);
        width_ = (std::min)(std::ceil(mesh_pixels + gap * max_step_ * parallax_), nearest_float(max_width));
    }

    /// Returns one hem per entry of flat_mesh::open_corners. Most hems are empty. If facts.motion is 0, all hems are empty.
    buffer<hem> find() {
        buffer<hem> result(flat_.open_corners.size());
        if (!(parallax_ > 0)) return result;
        for (std::int32_t p = 0; p < flat_.outlines.pieces.count(); ++p) find_ends(p);
        for (const end& e : ends_) result[e.corner] = hem_of(e);
        join(result);
        return result;
    }

private:
    /// Maximum difference in disparity between a hem and the nearer surface in front of it, as a multiple of
    /// surface_rule::max_step; tuned by experiment. A camera sees past a hem if the parallax of this difference exceeds the
    /// hem's width, so a narrow hem must lie closer to the nearer surface.
    static constexpr float gap = 0.2F;
    static_assert(mesh_pixels >= 2.0F * simplify_options{}.tolerance &&
                  mesh_disparity >= simplify_options{}.disparity_tolerance + stud_options{}.disparity_tolerance);
    /// Distances from an edge at which is_hidden() compares disparities, in pixels; positive distances lie outside the chart.
    static constexpr float sides[] = {-1.5F, -0.5F, 0.5F};
    static constexpr float nothing = -std::numeric_limits<float>::infinity();

    struct end {
        std::int32_t corner;  // index in flat_mesh::open_corners
        float disparity;
        plane_vector from, outward;  // start of the hem, and unit vector that points out of the chart
    };
    struct lattice_position {
        std::int32_t x, y;
    };

    const outline_corner& corner(std::int32_t i) const { return flat_.outlines.corners[flat_.open_corners[i]]; }

    /// Returns the lattice position that lies `distance` pixels outward from an end; it may be outside the lattice.
    static lattice_position position_at(const end& e, float distance) {
        return {static_cast<std::int32_t>(std::floor(e.from.x + distance * e.outward.x)),
                static_cast<std::int32_t>(std::floor(e.from.y + distance * e.outward.y))};
    }

    /// Appends to ends_ the corners of a piece at which a hidden surface ends.
    void find_ends(std::int32_t piece) {
        const std::int32_t first = flat_.first_open_corner[piece], last = flat_.first_open_corner[piece + 1] - 1;
        if (last <= first) return;
        const bool is_closed = flat_.open_corners[first] == flat_.open_corners[last];
        const auto normal_after = [&](std::int32_t i) { return outward_normal(corner(i), corner(i + 1)); };
        for (std::int32_t i = first; i <= last; ++i) {
            const plane_vector after = normal_after(i < last ? i : is_closed ? first : last - 1);
            const plane_vector before = normal_after(i > first ? i - 1 : is_closed ? last - 1 : first);
            plane_vector normal = before + after;
            // Edges that double back within 29 degrees (2 asin(0.5 / 2)) form a spike, whose mean normal is unreliable.
            if (normal.length() < 0.5F) normal = before;
            const float length = normal.length();
            if (!(length > 0)) continue;
            // Several surfaces may share the end corners of an open piece, so start half a pixel along the edge.
            const float step = is_closed || (i > first && i < last) ? 0.0F : i == first ? 0.5F : -0.5F;
            const plane_vector from{nearest_float(corner(i).x) - step * normal.y / length,
                                    nearest_float(corner(i).y) + step * normal.x / length};
            const float disparity = corner(step > 0 ? first + 1 : step < 0 ? last - 1 : i).disparity;
            const end e{i, disparity, from, normal / length};
            if (is_hidden(e)) ends_.push_back(e);
        }
    }

    /// Whether a nearer surface is visible at an end. Checks both sides of the edge, because simplified outlines may be off by a
    /// pixel. A surface counts as nearer if it lies more than half of max_step_ in front of the end, a threshold tuned by
    /// experiment.
    bool is_hidden(const end& e) const {
        return std::any_of(std::begin(sides), std::end(sides), [&](float distance) {
            const auto [x, y] = position_at(e, distance);
            const std::int32_t pixel = stacks_.nearest(x, y);
            return pixel != no_pixel && stacks_.disparity(pixel) > e.disparity + 0.5F * max_step_;
        });
    }

    /// Returns the disparity of the farthest surface at a position among the surfaces of similar depth: from gap * max_step_
    /// behind `disparity` to max_joined_step * max_step_ in front of it. Returns negative infinity if there is none.
    float nearer_surface(lattice_position at, float disparity) const {
        float farthest = nothing;
        stacks_.for_each(at.x, at.y, [&](std::int32_t pixel) {
            const float there = stacks_.disparity(pixel), step = there - disparity;
            if (step > -gap * max_step_ && step <= max_joined_step * max_step_ && (farthest == nothing || there < farthest))
                farthest = there;
        });
        return farthest;
    }

    /// Returns the outer end of the hem at a corner. The hem extends outward behind nearer surfaces of similar depth, by at
    /// most width_. Its outer end is farther away than these surfaces.
    hem hem_of(const end& e) const {
        hem result;
        float reach = 0;
        for (float t = 0.5F; t < width_; t += 1.0F) {
            const float there = nearer_surface(position_at(e, t), e.disparity);
            if (there == nothing && t > 1.0F) break;  // the outline may be off by a pixel
            if (there == nothing) continue;
            result.disparity = reach > 0 ? (std::min)(result.disparity, there) : there, reach = t + 0.5F;
        }
        const float behind = (std::min)(gap * max_step_, (std::max)(reach - mesh_pixels, 0.5F) / (std::max)(parallax_, 1.0F));
        result.x = reach * e.outward.x, result.y = reach * e.outward.y, result.disparity -= behind;
        return result;
    }

    /// Moves hems that share a corner to the mean of their outer ends, so that no gap remains between them. Skips hems that point
    /// in opposite directions.
    void join(buffer<hem>& hems) const {
        struct sum {
            hem total;
            float count = 0;
        };
        buffer<sum> sums(flat_.outlines.corners.size());
        for (const end& e : ends_) {
            const hem& h = hems[e.corner];
            if (h.is_empty()) continue;
            auto& [total, count] = sums[flat_.open_corners[e.corner]];
            total = {total.x + h.x, total.y + h.y, total.disparity + h.disparity}, count += 1.0F;
        }
        for (const end& e : ends_) {
            const auto& [total, count] = sums[flat_.open_corners[e.corner]];
            const bool is_opposite = vector_length(total.x, total.y) < count;  // the mean offset is shorter than a pixel
            if (!hems[e.corner].is_empty() && !is_opposite)
                hems[e.corner] = {total.x / count, total.y / count, total.disparity / count};
        }
    }

    const flat_mesh& flat_;
    const pixel_stacks& stacks_;
    float max_step_;
    float parallax_ = 0;  // maximum parallax of a difference in disparity of 1, in pixels
    float width_ = 0;     // maximum width of a hem, in pixels
    buffer<end> ends_;
};

}}}  // namespace ldi::detail
