// Measures the share of a novel view that shows texture stretched between the two surfaces of a silhouette.
#pragma once

#include "metrics.hpp"
#include "subjects.hpp"
#include "true_silhouettes.hpp"

#include <ldi/base/buffer.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ldi_quality {

struct stretch_options {
    /// Maximum distance from a true silhouette, as a fraction of the photo's longer side (12 pixels of 1152). Degraded depth
    /// blurs a step over about this distance.
    double reach = 12.0 / 1152;
    /// Minimum factor by which a triangle's steepest line becomes longer between the two views.
    double min_factor = 2;
};

namespace detail {

/// A corner of a triangle as seen by the photo's camera.
struct photo_corner {
    double x, y, inverse_depth;
};

/// Maximum change of inverse depth per pixel of the photo; infinite for triangles seen edge-on.
inline double steepness(const std::array<photo_corner, 3>& t) {
    const double ax = t[1].x - t[0].x, ay = t[1].y - t[0].y, a = t[1].inverse_depth - t[0].inverse_depth;
    const double bx = t[2].x - t[0].x, by = t[2].y - t[0].y, b = t[2].inverse_depth - t[0].inverse_depth;
    const double area = ax * by - ay * bx, rise = std::hypot(a * by - b * ay, b * ax - a * bx);
    return rise > 0 ? rise / std::abs(area) : 0;
}

}  // namespace detail

/// Marks each triangle with 1 if it spans a true silhouette. Such a triangle meets two conditions. Seen from the photo's
/// viewpoint, one of its corners, a middle of its sides or its own middle is close to a true silhouette. In the other view, it
/// is at least `min_factor` times as long in its steepest direction, which happens only between two surfaces.
inline ldi::buffer<std::uint8_t> spanning_triangles(const ldi::textured_mesh& mesh, const subject& s,
                                                    const std::vector<true_side>& truth, const stretch_options& options = {}) {
    std::vector<side_middle> middles;
    for (const true_side& side : truth) middles.push_back(side.middle());
    const std::size_t height = s.photo.height(), width = s.photo.width();
    const nearest_side nearest(middles, height, width);
    const std::int32_t reach =
        static_cast<std::int32_t>(std::lround(options.reach * static_cast<double>(std::max(height, width))));
    const auto is_near = [&](double x, double y) {
        const auto half_pixels = [](double at) { return static_cast<std::int32_t>(std::lround(2 * at)); };
        return nearest.find({half_pixels(x), half_pixels(y)}, reach).second >= 0;
    };
    const ldi::depth_range range = s.range();
    const double disparity_per_inverse_depth = 1 / static_cast<double>(range.inverse_depth(1) - range.inverse_depth(0));
    ldi::buffer<std::uint8_t> result(mesh.triangle_count(), std::uint8_t{0});
    for (std::size_t i = 0; i < mesh.triangle_count(); ++i) {
        std::array<detail::photo_corner, 3> t;
        for (std::size_t k = 0; k < 3; ++k) {
            const float* p = mesh.positions.data() + 3 * mesh.triangles[3 * i + k];
            const auto [x, y] = s.camera.project({p[0], p[1], p[2]});
            t[k] = {static_cast<double>(x), static_cast<double>(y), disparity_per_inverse_depth / static_cast<double>(-p[2])};
        }
        if (detail::steepness(t) * s.parallax() < options.min_factor - 1) continue;
        bool near = is_near((t[0].x + t[1].x + t[2].x) / 3, (t[0].y + t[1].y + t[2].y) / 3);
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = a; b < 3; ++b) near = near || is_near((t[a].x + t[b].x) / 2, (t[a].y + t[b].y) / 2);
        result[i] = near ? 1 : 0;
    }
    return result;
}

/// Pixels in which the other view shows one of the marked triangles in front.
template <ldi::executor Executor>
mask shown_triangles(const ldi::textured_mesh& mesh, const ldi::buffer<std::uint8_t>& marked, const ldi::view& from,
                     Executor& threads) {
    ldi::textured_mesh flat;  // no two triangles share a vertex, so that each has its own color
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const std::size_t vertex = mesh.triangles[i];
        for (std::size_t k = 0; k < 3; ++k) flat.positions.push_back(mesh.positions[3 * vertex + k]);
        flat.texture_coordinates.push_back(marked[i / 3] != 0 ? 0.75F : 0.25F);
        flat.texture_coordinates.push_back(0.5F);
        flat.pixels.push_back(mesh.pixels[vertex]);
        flat.triangles.push_back(static_cast<std::uint32_t>(i));
    }
    picture black_and_white(1, 2, 3, std::uint8_t{0});
    for (std::size_t c = 0; c < 3; ++c) black_and_white(0, 1, c) = 255;
    ldi::raster_options raster;
    raster.z_near = 1e-3F;
    const picture shown = ldi::rasterize(flat, black_and_white, from, raster, threads).color;
    mask result(shown.height(), shown.width(), 1, std::uint8_t{0});
    for (std::size_t i = 0; i < result.size(); ++i) result.data()[i] = shown.data()[3 * i] >= 128 ? 1 : 0;
    return result;
}

}  // namespace ldi_quality
