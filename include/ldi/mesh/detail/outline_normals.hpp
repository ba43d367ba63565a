// Normals of outlines, along which hems and soft edges extend a chart.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/mesh/outlines.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A vector in the plane of the lattice, in pixels.
struct plane_vector {
    float x = 0, y = 0;

    float length() const { return vector_length(x, y); }
    friend plane_vector operator+(plane_vector a, plane_vector b) { return {a.x + b.x, a.y + b.y}; }
    friend plane_vector operator/(plane_vector a, float divisor) { return {a.x / divisor, a.y / divisor}; }
};

/// Returns an outline edge's unit normal, which points out of the chart. The chart lies to the right of the edge. Returns the
/// zero vector for an edge between equal corners.
inline plane_vector outward_normal(const outline_corner& from, const outline_corner& to) {
    const plane_vector normal{nearest_float(to.y - from.y), -nearest_float(to.x - from.x)};
    const float length = normal.length();
    return length > 0 ? normal / length : plane_vector{};
}

}}}  // namespace ldi::detail
