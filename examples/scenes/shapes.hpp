// Solids of the analytic scenes: intersections with rays, and descriptions of their surfaces.
#pragma once

#include "textures.hpp"
#include "vector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ldi::scenes {

struct ray {
    vector3 origin, direction;  ///< the direction may have any length, which is the unit of distances
    vector3 at(double distance) const { return origin + direction * distance; }
};

/// A shape around the origin of its own frame.
struct shape {
    enum class kind {
        rectangle,  ///< |x| <= size.x, |y| <= size.y, z = 0; a ray hits it at most once
        box,        ///< |x| <= size.x, |y| <= size.y, |z| <= size.z
        sphere,     ///< radius size.x
        rod,        ///< a cylinder of radius size.x about the y axis, |y| <= size.y, with flat ends
    };
    kind what = kind::sphere;
    frame place;
    vector3 size{1, 1, 1};
};

inline shape make_rectangle(const frame& place, double width, double height) {
    return {shape::kind::rectangle, place, {0.5 * width, 0.5 * height, 0}};
}
inline shape make_box(const frame& place, double width, double height, double depth) {
    return {shape::kind::box, place, {0.5 * width, 0.5 * height, 0.5 * depth}};
}
inline shape make_sphere(const frame& place, double radius) { return {shape::kind::sphere, place, {radius, radius, radius}}; }
inline shape make_rod(const vector3& from, const vector3& to, double radius) {
    return {shape::kind::rod, along(0.5 * (from + to), to - from), {radius, 0.5 * length(to - from), radius}};
}

/// Intersections of a ray's line with a shape, including those behind the ray's origin. `count` is 0, 1 or 2; distances ascend.
struct crossings {
    int count = 0;
    std::array<double, 2> distance{};
};

/// Properties of a surface at a point.
struct surface_description {
    vector3 normal;  ///< length 1, outward; +z of a rectangle's frame
    surface_point where;
};

namespace detail {

/// Shrinks [first, last] to the part with |start + distance * step| <= limit.
inline void clip_slab(double start, double step, double limit, double& first, double& last) {
    if (step == 0) {
        if (std::abs(start) > limit) last = -std::numeric_limits<double>::infinity();
        return;
    }
    const double a = (-limit - start) / step, b = (limit - start) / step;
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
}

/// Shrinks [first, last] to the part with a d^2 + 2 b d + c <= 0.
inline void clip_quadratic(double a, double b, double c, double& first, double& last) {
    const double discriminant = b * b - a * c;
    if (a == 0 ? c > 0 : discriminant <= 0) {
        last = -std::numeric_limits<double>::infinity();
    } else if (a != 0) {
        const double root = std::sqrt(discriminant);
        first = std::max(first, (-b - root) / a);
        last = std::min(last, (-b + root) / a);
    }
}

}  // namespace detail

/// Intersects a ray's line with a shape.
inline crossings intersect(const shape& s, const ray& r) {
    const vector3 o = s.place.to_local(r.origin), d = s.place.direction_to_local(r.direction);
    double first = -std::numeric_limits<double>::infinity(), last = -first;
    switch (s.what) {
        case shape::kind::rectangle: {
            if (d.z == 0) return {};
            const double distance = -o.z / d.z;
            const bool inside = std::abs(o.x + distance * d.x) <= s.size.x && std::abs(o.y + distance * d.y) <= s.size.y;
            return {inside ? 1 : 0, {distance, 0}};
        }
        case shape::kind::box:
            detail::clip_slab(o.x, d.x, s.size.x, first, last);
            detail::clip_slab(o.y, d.y, s.size.y, first, last);
            detail::clip_slab(o.z, d.z, s.size.z, first, last);
            break;
        case shape::kind::sphere:
            detail::clip_quadratic(dot(d, d), dot(o, d), dot(o, o) - s.size.x * s.size.x, first, last);
            break;
        case shape::kind::rod:
            detail::clip_slab(o.y, d.y, s.size.y, first, last);
            detail::clip_quadratic(d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - s.size.x * s.size.x,
                                   first, last);
            break;
    }
    return first < last ? crossings{2, {first, last}} : crossings{};
}

/// Describes the surface at `point`, which lies on the shape.
inline surface_description describe(const shape& s, const vector3& point) {
    const vector3 p = s.place.to_local(point);
    surface_description result;
    result.where.local = p;
    switch (s.what) {
        case shape::kind::rectangle:
            result.normal = s.place.z;
            result.where.u = p.x, result.where.v = p.y;
            break;
        case shape::kind::box: {
            const double gap_x = s.size.x - std::abs(p.x), gap_y = s.size.y - std::abs(p.y), gap_z = s.size.z - std::abs(p.z);
            if (gap_x <= gap_y && gap_x <= gap_z) {
                result.normal = s.place.x * std::copysign(1.0, p.x);
                result.where.u = p.z, result.where.v = p.y;
            } else if (gap_y <= gap_z) {
                result.normal = s.place.y * std::copysign(1.0, p.y);
                result.where.u = p.x, result.where.v = p.z;
            } else {
                result.normal = s.place.z * std::copysign(1.0, p.z);
                result.where.u = p.x, result.where.v = p.y;
            }
            break;
        }
        case shape::kind::sphere:
            result.normal = normalized(point - s.place.origin);
            result.where.u = std::atan2(p.x, p.z) * s.size.x;
            result.where.v = std::asin(std::clamp(p.y / s.size.x, -1.0, 1.0)) * s.size.x;
            break;
        case shape::kind::rod:
            if (s.size.y - std::abs(p.y) < s.size.x - std::hypot(p.x, p.z)) {
                result.normal = s.place.y * std::copysign(1.0, p.y);
                result.where.u = p.x, result.where.v = p.z;
            } else {
                result.normal = s.place.direction_to_world(normalized({p.x, 0, p.z}));
                result.where.u = std::atan2(p.x, p.z) * s.size.x, result.where.v = p.y;
            }
            break;
    }
    return result;
}

}  // namespace ldi::scenes
