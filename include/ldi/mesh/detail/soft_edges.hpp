// Soft edges: a narrow translucent strip along the silhouettes of foreground surfaces. The strip starts half opaque at the edge
// of the mesh, and fades out over a pixel or two at the same depth. Its colors come from the padding of the atlas, which
// continues the surface. Where the photo's foreground colors extend farther, as with hair, the matte (inpaint/mixed_colors.hpp)
// makes the strip wider. The method is similar to that of Zitnick et al., High-Quality Video View Interpolation Using a Layered
// Representation (SIGGRAPH 2004).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/mesh/detail/outline_normals.hpp>
#include <ldi/mesh/detail/pixel_stacks.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/mesh_options.hpp>
#include <ldi/mesh/textured_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Maximum factor by which the miter at a corner widens the strip, so that sharp corners don't reach far. The exact factor is
/// 1 / cos(turn / 2), which exceeds this limit only for turns above 96 degrees.
inline constexpr float max_miter = 1.5F;

/// Limits the widths of the strip to what the padding of the atlas can color. The strip's outermost half texel may lie beyond the
/// padding, because it is almost transparent.
inline soft_edge_options limited_to(soft_edge_options options, std::int32_t padding) {
    const float limit = (nearest_float(padding) + 0.5F) / max_miter;
    options.min_width = (std::min)(options.min_width, limit), options.max_width = (std::min)(options.max_width, limit);
    return options;
}

/// Builds the strip of one mesh, piece by piece.
class soft_edge_builder {
public:
    /// stacks  the pixels of the layered image
    /// matte   the matte of each pixel
    soft_edge_builder(const flat_mesh& flat, const pixel_stacks& stacks, array_view<const std::uint8_t> matte,
                      surface_rule surface, const pinhole_camera& camera, const depth_range& range,
                      const soft_edge_options& options)
        : flat_(flat), stacks_(stacks), matte_(matte), surface_(surface), camera_(camera), range_(range), options_(options) {}

    /// Selects the silhouette edges that have a strip: the `count` edges with the largest steps in disparity.
    void choose(std::size_t count) {
        buffer<float> steps;
        min_step_ = 0;
        for (std::int32_t p = 0; p < flat_.outlines.pieces.count(); ++p) {
            load(p);
            for (const float step : steps_)
                if (step > 0) steps.push_back(step);
        }
        if (steps.size() <= count) return;
        std::nth_element(steps.begin(), steps.begin() + (steps.size() - count), steps.end());
        min_step_ = count > 0 ? steps[steps.size() - count] : std::numeric_limits<float>::infinity();
    }

    /// Adds the strip along a piece.
    ///
    /// to_atlas  offset from the lattice to texels
    /// scale     factor from texels to texture coordinates
    void add_piece(std::int32_t piece, std::array<std::int32_t, 2> to_atlas, std::array<float, 2> scale) {
        to_atlas_ = to_atlas, scale_ = scale;
        load(piece);
        find_rims();
        add_quads();
    }

    /// Returns the strip, sorted from far to near.
    soft_edge_strip finish() {
        std::sort(quads_.begin(), quads_.end(), [](const quad& a, const quad& b) {
            return a.disparity != b.disparity ? a.disparity < b.disparity : a.a < b.a;
        });
        for (const quad& q : quads_) {
            if (q.outer_b != q.b) strip_.triangles.insert(strip_.triangles.end(), {q.a, q.b, q.outer_b});
            if (q.outer_a != q.a) strip_.triangles.insert(strip_.triangles.end(), {q.a, q.outer_b, q.outer_a});
        }
        return std::move(strip_);
    }

private:
    struct quad {
        float disparity;
        std::uint32_t a, b, outer_a, outer_b;
    };
    /// Opacity at the edge of the mesh, where the surface covers half of a pixel. Higher values thicken outlines: in the views
    /// of bench/quality, a value of 255 lowers PSNR by 0.8 dB within two pixels of the outlines.
    static constexpr std::uint8_t opacity_at_edge = 128;
    static constexpr std::uint32_t no_vertex = ~std::uint32_t{0};

    const outline_corner& corner(std::int32_t i) const { return flat_.outlines.corners[corners_[i]]; }
    std::int32_t edge_count() const { return (std::max)(corners_.count() - 1, 0); }

    /// Returns the step in disparity from a corner to the farthest surface visible beside it. Returns 0 if a nearer surface is
    /// visible there, or if only the corner's own surface is.
    float step_at(const outline_corner& c) const {
        float nearest = c.disparity, farthest = c.disparity;
        for (const std::int32_t y : {c.y - 1, c.y})
            for (const std::int32_t x : {c.x - 1, c.x}) {
                const std::int32_t seen = stacks_.nearest(x, y);
                if (seen == no_pixel) continue;
                nearest = (std::max)(nearest, stacks_.disparity(seen)), farthest = (std::min)(farthest, stacks_.disparity(seen));
            }
        const bool is_in_front = surface_.same_surface(nearest, c.disparity) && !surface_.same_surface(farthest, c.disparity);
        return is_in_front ? c.disparity - farthest : 0.0F;
    }

    /// Computes the steps and normals of a piece's edges.
    void load(std::int32_t piece) {
        corners_.assign(flat_.open_corners.begin() + flat_.first_open_corner[piece],
                        flat_.open_corners.begin() + flat_.first_open_corner[piece + 1]);
        is_closed_ = flat_.outlines.pieces[piece].start == flat_.outlines.pieces[piece].end;
        normals_.clear(), steps_.clear();
        float step_before = corners_.empty() ? 0.0F : step_at(corner(0));
        for (std::int32_t i = 0; i < edge_count(); ++i) {
            const outline_corner &a = corner(i), &b = corner(i + 1);
            const bool has_length = a.x != b.x || a.y != b.y;
            const bool on_border =
                (a.x == b.x && (a.x == 0 || a.x == camera_.width)) || (a.y == b.y && (a.y == 0 || a.y == camera_.height));
            const float step_after = step_at(b);
            const bool has_step = has_length && !on_border && step_before > 0 && step_after > 0;
            steps_.push_back(has_step ? 0.5F * (step_before + step_after) : 0.0F);
            normals_.push_back(outward_normal(a, b));
            step_before = step_after;
        }
    }

    bool is_soft(std::int32_t edge) const { return steps_[edge] > 0 && steps_[edge] >= min_step_; }

    /// Integrates the matte outward from the edge. Beyond the edge, the matte is the fraction of foreground color in each
    /// background pixel.
    float matte_beyond(const outline_corner& c, plane_vector normal) const {
        float sum = 0;
        for (float t = 0.5F; t < options_.max_width; t += 1.0F) {
            const std::int32_t x = static_cast<std::int32_t>(std::floor(nearest_float(c.x) + t * normal.x));
            const std::int32_t y = static_cast<std::int32_t>(std::floor(nearest_float(c.y) + t * normal.y));
            const std::int32_t seen = stacks_.nearest(x, y);
            if (seen == no_pixel) break;
            const float there = stacks_.disparity(seen);
            if (there >= c.disparity || surface_.same_surface(there, c.disparity)) break;
            sum += nearest_float(matte_[seen]) / 255.0F;
        }
        return sum;
    }

    /// Computes the offset from each corner of the piece to the outer end of the strip.
    void find_rims() {
        rims_.assign(corners_.size(), plane_vector{});
        const std::int32_t last = edge_count();
        for (std::int32_t i = 0; i < corners_.count(); ++i) {
            const std::int32_t before = i > 0 ? i - 1 : is_closed_ ? last - 1 : -1, after = i < last ? i : is_closed_ ? 0 : -1;
            if (before < 0 || after < 0 || !is_soft(before) || !is_soft(after)) continue;  // the strip tapers off here
            const plane_vector sum = normals_[before] + normals_[after];
            const float squared = sum.x * sum.x + sum.y * sum.y;
            if (squared < 0.5F) continue;  // a spike: the edges double back within 41 degrees (2 asin(sqrt(0.5) / 2))
            const plane_vector normal = sum / std::sqrt(squared);
            // The integral of a matte that falls linearly from 1 to 0 is half of the width over which it falls.
            const float width = std::clamp(2.0F * matte_beyond(corner(i), normal), options_.min_width, options_.max_width);
            const float miter = (std::min)(2.0F / std::sqrt(squared), max_miter);
            rims_[i] = {width * miter * normal.x, width * miter * normal.y};
        }
    }

    void add_quads() {
        vertices_.assign(corners_.size(), {no_vertex, no_vertex});
        for (std::int32_t i = 0; i < edge_count(); ++i) {
            const bool is_point = rims_[i].x == 0 && rims_[i].y == 0 && rims_[i + 1].x == 0 && rims_[i + 1].y == 0;
            if (!is_soft(i) || is_point) continue;
            const auto [a, outer_a] = vertices_at(i);
            const auto [b, outer_b] = vertices_at(i + 1);
            quads_.push_back({0.5F * (corner(i).disparity + corner(i + 1).disparity), a, b, outer_a, outer_b});
        }
    }

    /// Returns the two vertices of a corner: at the edge of the mesh and at the outer end of the strip. They are equal where the
    /// strip tapers off.
    std::pair<std::uint32_t, std::uint32_t> vertices_at(std::int32_t i) {
        auto& [inner, outer] = vertices_[i];
        if (inner != no_vertex) return vertices_[i];
        inner = outer = add_vertex(corner(i), {}, opacity_at_edge);
        if (rims_[i].x != 0 || rims_[i].y != 0) outer = add_vertex(corner(i), rims_[i], 0);
        return vertices_[i];
    }

    std::uint32_t add_vertex(const outline_corner& c, plane_vector offset, std::uint8_t opacity) {
        const float x = nearest_float(c.x) + offset.x, y = nearest_float(c.y) + offset.y;
        const std::array<float, 3> point = camera_.unproject(x, y, range_.depth(std::clamp(c.disparity, 0.0F, 1.0F)));
        strip_.positions.append(point.begin(), point.end());
        strip_.texture_coordinates.push_back(std::clamp((x + nearest_float(to_atlas_[0])) * scale_[0], 0.0F, 1.0F));
        strip_.texture_coordinates.push_back(std::clamp((y + nearest_float(to_atlas_[1])) * scale_[1], 0.0F, 1.0F));
        strip_.opacity.push_back(opacity);
        return static_cast<std::uint32_t>(strip_.opacity.count() - 1);
    }

    const flat_mesh& flat_;
    const pixel_stacks& stacks_;
    array_view<const std::uint8_t> matte_;
    surface_rule surface_;
    const pinhole_camera& camera_;
    const depth_range& range_;
    soft_edge_options options_;
    std::array<std::int32_t, 2> to_atlas_{};
    std::array<float, 2> scale_{};
    bool is_closed_ = false;
    float min_step_ = 0;
    buffer<std::int32_t> corners_;  // corners of the piece
    buffer<float> steps_;           // per edge: step in disparity to the surface behind it; 0 if hard
    buffer<plane_vector> normals_;  // per edge: outward normal
    buffer<plane_vector> rims_;     // per corner: offset to the outer end of the strip
    buffer<std::pair<std::uint32_t, std::uint32_t>> vertices_;
    buffer<quad> quads_;
    soft_edge_strip strip_;
};

}}}  // namespace ldi::detail
