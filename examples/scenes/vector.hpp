// Points, directions and colors of the analytic scenes. They are in double precision, because the scenes are the ground truth
// of tests.
#pragma once

#include <cmath>

namespace ldi::scenes {

struct vector3 {
    double x = 0, y = 0, z = 0;
};

inline vector3 operator+(const vector3& a, const vector3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vector3 operator-(const vector3& a, const vector3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline vector3 operator-(const vector3& a) { return {-a.x, -a.y, -a.z}; }
inline vector3 operator*(const vector3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline vector3 operator*(double s, const vector3& a) { return a * s; }
/// Multiplies channel by channel, such as light by a surface's color.
inline vector3 operator*(const vector3& a, const vector3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

inline double dot(const vector3& a, const vector3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline vector3 cross(const vector3& a, const vector3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const vector3& a) { return std::sqrt(dot(a, a)); }
inline vector3 normalized(const vector3& a) { return a * (1.0 / length(a)); }
inline vector3 mix(const vector3& a, const vector3& b, double t) { return a * (1 - t) + b * t; }

/// A position and three orthonormal axes, right-handed.
struct frame {
    vector3 origin;
    vector3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

    vector3 direction_to_local(const vector3& d) const { return {dot(d, x), dot(d, y), dot(d, z)}; }
    vector3 to_local(const vector3& p) const { return direction_to_local(p - origin); }
    vector3 direction_to_world(const vector3& d) const { return d.x * x + d.y * y + d.z * z; }
    vector3 to_world(const vector3& p) const { return origin + direction_to_world(p); }
    /// Transforms a child frame, given in this frame's coordinates, to the world.
    frame frame_to_world(const frame& child) const {
        return {to_world(child.origin), direction_to_world(child.x), direction_to_world(child.y), direction_to_world(child.z)};
    }
};

/// Returns a frame at `origin`, rotated by `about_y` radians about the y axis, then by `about_x` radians about its own x axis.
inline frame turned(const vector3& origin, double about_y, double about_x = 0) {
    const double c = std::cos(about_y), s = std::sin(about_y), k = std::cos(about_x), t = std::sin(about_x);
    return {origin, {c, 0, -s}, {s * t, k, c * t}, {s * k, -t, c * k}};
}

/// Returns a frame whose y axis points along `axis`, which may have any length except 0.
inline frame along(const vector3& origin, const vector3& axis) {
    const vector3 y = normalized(axis);
    const vector3 x = normalized(cross(y, std::abs(y.z) < 0.9 ? vector3{0, 0, 1} : vector3{1, 0, 0}));
    return {origin, x, y, cross(x, y)};
}

}  // namespace ldi::scenes
