// Triangles in screen space: clipped, projected, rounded to fixed point, and divided into spans of samples. After rounding, spans
// are computed in integers, so triangles with a common edge neither miss nor share samples, on any machine.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/render/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Fixed-point units per sample distance. Sample (x, y) is at position (x + 0.5, y + 0.5).
inline constexpr std::int64_t subsample_steps = 256;

/// Maximum distance of positions from the optical axis, in samples, so that products of two differences fit in 64 bits.
inline constexpr double guard_band = 1048576;

struct screen_vertex {
    std::int64_t x = 0, y = 0;  ///< in 1 / subsample_steps of a sample; y down
    double inverse_depth = 0;
    double u = 0, v = 0;  ///< texture coordinates
    double opacity = 1;
};

using screen_triangle = std::array<screen_vertex, 3>;

/// Returns twice the area; positive if the triangle is clockwise on the screen.
inline std::int64_t signed_area(const screen_triangle& t) {
    return (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x);
}

inline std::int64_t floor_division(std::int64_t a, std::int64_t positive) { return a / positive - (a % positive < 0 ? 1 : 0); }

/// Calls span(y, first_x, last_x) for every row in [first_row, last_row) in which the triangle covers the samples [first_x,
/// last_x), within [0, width). Requires signed_area(t) > 0. A sample exactly on an edge belongs to the triangle on the right of
/// the edge, or below it.
template <class Span>
void for_each_span(const screen_triangle& t, std::int64_t width, std::int64_t first_row, std::int64_t last_row, Span&& span) {
    constexpr std::int64_t one = subsample_steps, half = subsample_steps / 2;
    const std::int64_t top = (std::min)({t[0].y, t[1].y, t[2].y}), bottom = (std::max)({t[0].y, t[1].y, t[2].y});
    first_row = (std::max)(first_row, floor_division(top - half, one));
    last_row = (std::min)(last_row, floor_division(bottom - half, one) + 1);
    for (std::int64_t y = first_row; y < last_row; ++y) {
        std::int64_t first = 0, last = width;
        for (std::size_t i = 0; i < 3; ++i) {
            const screen_vertex &a = t[i], &b = t[(i + 1) % 3];
            const std::int64_t dx = b.x - a.x, dy = b.y - a.y;
            // A point p is inside if dx (py - ay) - dy (px - ax) > 0, or = 0 on a left or top edge.
            const bool owns_edge = dy < 0 || (dy == 0 && dx > 0);
            const std::int64_t at_zero = dx * (y * one + half - a.y) - dy * (half - a.x) - (owns_edge ? 0 : 1);
            if (dy < 0)
                first = (std::max)(first, -floor_division(at_zero, -dy * one));
            else if (dy > 0)
                last = (std::min)(last, floor_division(at_zero, dy * one) + 1);
            else if (at_zero < 0)
                last = first;
        }
        if (first < last) span(y, first, last);
    }
}

/// A value that is affine on the screen.
struct screen_plane {
    double value, per_x, per_y;  ///< value at the first vertex; change per sample

    screen_plane(const screen_triangle& t, double first, double second, double third) : value(first) {
        const double x1 = nearest_double(t[1].x - t[0].x), y1 = nearest_double(t[1].y - t[0].y);
        const double x2 = nearest_double(t[2].x - t[0].x), y2 = nearest_double(t[2].y - t[0].y);
        const double scale = nearest_double(subsample_steps) / nearest_double(signed_area(t));
        per_x = ((second - first) * y2 - (third - first) * y1) * scale;
        per_y = ((third - first) * x1 - (second - first) * x2) * scale;
    }
    /// x, y  relative to the first vertex, in samples
    double at(double x, double y) const { return value + per_x * x + per_y * y; }
};

/// Depth and texture coordinates at the samples of a triangle. Two kinds of values are affine on the screen: inverse depth, and
/// texture coordinates divided by depth.
class screen_values {
public:
    explicit screen_values(const screen_triangle& t)
        : inverse_(t, t[0].inverse_depth, t[1].inverse_depth, t[2].inverse_depth),
          u_(t, t[0].u * t[0].inverse_depth, t[1].u * t[1].inverse_depth, t[2].u * t[2].inverse_depth),
          v_(t, t[0].v * t[0].inverse_depth, t[1].v * t[1].inverse_depth, t[2].v * t[2].inverse_depth),
          min_((std::min)({t[0].inverse_depth, t[1].inverse_depth, t[2].inverse_depth})),
          max_((std::max)({t[0].inverse_depth, t[1].inverse_depth, t[2].inverse_depth})),
          x0_(nearest_double(t[0].x) / nearest_double(subsample_steps) - 0.5),
          y0_(nearest_double(t[0].y) / nearest_double(subsample_steps) - 0.5) {}

    /// Returns the inverse depth, clamped to the triangle's range, because rounding errors in slivers could exceed this range.
    double inverse_depth(std::int64_t x, std::int64_t y) const { return std::clamp(at(inverse_, x, y), min_, max_); }
    double u(std::int64_t x, std::int64_t y) const { return at(u_, x, y) / inverse_depth(x, y); }
    double v(std::int64_t x, std::int64_t y) const { return at(v_, x, y) / inverse_depth(x, y); }

protected:
    double at(const screen_plane& plane, std::int64_t x, std::int64_t y) const {
        return plane.at(nearest_double(x) - x0_, nearest_double(y) - y0_);
    }

private:
    screen_plane inverse_, u_, v_;
    double min_, max_, x0_, y0_;
};

/// Adds opacity to screen_values, for translucent triangles.
class translucent_values : public screen_values {
public:
    explicit translucent_values(const screen_triangle& t)
        : screen_values(t),
          opacity_(t, t[0].opacity * t[0].inverse_depth, t[1].opacity * t[1].inverse_depth, t[2].opacity * t[2].inverse_depth) {}

    float opacity(std::int64_t x, std::int64_t y) const {
        return static_cast<float>(std::clamp(at(opacity_, x, y) / inverse_depth(x, y), 0.0, 1.0));
    }

private:
    screen_plane opacity_;
};

/// A vertex before projection, in the camera's axes.
struct camera_vertex {
    std::array<double, 3> position;
    double u, v, opacity;
};

/// Clips triangles at the near plane and at the guard band, and projects them to the screen.
class projection {
public:
    projection(const view& from, std::int32_t samples, float z_near)
        : from_(from), samples_(samples), z_near_(z_near), slope_(guard_band / (double{from.camera.focal_length} * samples)) {}

    /// Appends the screen triangles of one triangle of a mesh or strip. Each is clockwise on the screen, so signed_area() is
    /// positive.
    template <class Mesh>
    void append(const Mesh& mesh, std::size_t triangle, bool both_sides, buffer<screen_triangle>& result) const {
        std::array<camera_vertex, 8> corners;  // each plane can add one corner to the first three
        std::size_t count = 3;
        for (std::size_t i = 0; i < 3; ++i) corners[i] = to_camera(mesh, mesh.triangles[3 * triangle + i]);
        for (int plane = 0; plane < 5; ++plane) count = clip(corners, count, plane);
        for (std::size_t i = 2; i < count; ++i) {
            screen_triangle t{to_screen(corners[0]), to_screen(corners[i - 1]), to_screen(corners[i])};
            const std::int64_t area = signed_area(t);
            if (area == 0 || (area > 0 && !both_sides)) continue;
            if (area < 0) std::swap(t[1], t[2]);
            result.push_back(t);
        }
    }

private:
    /// Returns the point where an edge intersects a plane. Moves this point exactly onto the plane. Otherwise, on a very long
    /// edge, rounding could move the point to a position that cannot be projected.
    camera_vertex cut(const camera_vertex& a, const camera_vertex& b, double t, int plane) const {
        camera_vertex result{{}, (1 - t) * a.u + t * b.u, (1 - t) * a.v + t * b.v, (1 - t) * a.opacity + t * b.opacity};
        for (std::size_t i = 0; i < 3; ++i) result.position[i] = (1 - t) * a.position[i] + t * b.position[i];
        const double side = -result.position[2] * slope_;
        switch (plane) {
            case 0: result.position[2] = -z_near_; break;
            case 1: result.position[0] = -side; break;
            case 2: result.position[0] = side; break;
            case 3: result.position[1] = -side; break;
            default: result.position[1] = side; break;
        }
        return result;
    }

    template <class Mesh>
    camera_vertex to_camera(const Mesh& mesh, std::size_t vertex) const {
        // Double precision cannot overflow for finite float positions.
        std::array<double, 3> moved{};
        for (std::size_t i = 0; i < 3; ++i) moved[i] = double{mesh.positions[3 * vertex + i]} - from_.position[i];
        std::array<double, 3> seen{};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) seen[i] += from_.rotation[3 * j + i] * moved[j];
        double opacity = 1;
        if constexpr (requires { mesh.opacity; }) opacity = mesh.opacity[vertex] / 255.0;
        return {seen, mesh.texture_coordinates[2 * vertex], mesh.texture_coordinates[2 * vertex + 1], opacity};
    }

    /// Returns the distance of a vertex from the near plane, or from one side of the guard band; positive inside.
    double inside(const camera_vertex& v, int plane) const {
        const double depth = -v.position[2];
        switch (plane) {
            case 0: return depth - z_near_;
            case 1: return depth * slope_ + v.position[0];
            case 2: return depth * slope_ - v.position[0];
            case 3: return depth * slope_ + v.position[1];
            default: return depth * slope_ - v.position[1];
        }
    }

    /// Clips a polygon at a plane and returns its number of corners. Cuts every edge from its inner to its outer end, so that
    /// the triangles on both sides of the edge are cut at the same point.
    std::size_t clip(std::array<camera_vertex, 8>& corners, std::size_t count, int plane) const {
        std::array<double, 8> distance{};
        bool any_outside = false;
        for (std::size_t i = 0; i < count; ++i) {
            distance[i] = inside(corners[i], plane);
            any_outside = any_outside || distance[i] < 0;
        }
        if (!any_outside) return count;
        const std::array<camera_vertex, 8> before = corners;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t next = (i + 1) % count;
            if (distance[i] >= 0) corners[kept++] = before[i];
            if (distance[i] >= 0 && distance[next] < 0)
                corners[kept++] = cut(before[i], before[next], distance[i] / (distance[i] - distance[next]), plane);
            else if (distance[i] < 0 && distance[next] >= 0)
                corners[kept++] = cut(before[next], before[i], distance[next] / (distance[next] - distance[i]), plane);
        }
        return kept;
    }

    screen_vertex to_screen(const camera_vertex& v) const {
        const double inverse_depth = -1 / v.position[2];
        const double scale = from_.camera.focal_length * inverse_depth;
        const double steps = nearest_double(subsample_steps) * samples_;
        return {std::llround((double{from_.axis_x()} + v.position[0] * scale) * steps),
                std::llround((double{from_.axis_y()} - v.position[1] * scale) * steps),
                inverse_depth,
                v.u,
                v.v,
                v.opacity};
    }

    view from_;
    std::int32_t samples_;
    double z_near_, slope_;
};

}}}  // namespace ldi::detail
