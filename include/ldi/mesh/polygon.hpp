// Polygons with holes and inner polylines, and their triangulations: input and output of the sweep (triangulate.hpp).
// Coordinates are integers, so every geometric predicate is exact in 64 bits.
#pragma once

#include <ldi/base/buffer.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A vertex of a polygon: a corner between pixels.
struct lattice_point {
    std::int32_t x, y;  ///< within +-2^16

    friend bool operator==(const lattice_point&, const lattice_point&) = default;
};

/// A polygon that consists of chains, with at most 2^28 vertices in total. `next` stores the successor of each vertex, or -1 at
/// the end of a chain. Closed chains are outlines: the interior lies to the right (y downward: outer loops clockwise, holes
/// counter-clockwise). Open chains and single vertices must lie in the interior.
///
/// An outline may touch itself from outside, at vertices and along whole edges. Such a vertex is listed once for each part of
/// the interior that meets there, in the order of a walk along the inside of the outline.
struct polygon {
    buffer<lattice_point> points;
    buffer<std::int32_t> next;
    std::int32_t outline_count = 0;  ///< vertices [0, outline_count) belong to closed chains, the others to open chains

    void clear() { points.clear(), next.clear(), outline_count = 0; }
};

/// A triangulation with F triangles. Half-edge 3 f + i runs from vertex i of triangle f to its next vertex.
struct triangulation {
    buffer<std::uint32_t> triangles;  ///< F x 3 vertex indices, counter-clockwise on screen
    buffer<std::int32_t> mates;       ///< F x 3: the opposite half-edge, or -1 if the edge belongs to a chain
};

namespace detail {

/// Whether the sweep reaches a before b: from top to bottom, then from left to right.
inline bool above(lattice_point a, lattice_point b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }

/// Positive if a, b, c turn right on screen.
inline std::int64_t turn(lattice_point a, lattice_point b, lattice_point c) {
    return std::int64_t{b.x - a.x} * (c.y - b.y) - std::int64_t{b.y - a.y} * (c.x - b.x);
}

/// Number of bits that polygon_event() uses for a vertex index.
inline constexpr int polygon_vertex_bits = 28;
inline constexpr std::int32_t max_polygon_vertices = 1 << polygon_vertex_bits;

/// Encodes a vertex as a number that sorts by y, then x: y, x and vertex in 18, 18 and 28 bits.
///
/// 28 bits suffice for the vertices of every chart. Coordinates are 0 to max_chart_box. Each vertex is the first corner of a
/// pixel side (clockwise around the pixel), and no two vertices share a side. The bounding box has at most max_chart_box^2
/// pixels with four sides each, so a chart has at most 4 max_chart_box^2 = 2^28 vertices.
inline std::uint64_t polygon_event(lattice_point p, std::int32_t vertex) {
    constexpr std::int32_t offset = 1 << 17;
    const std::int64_t event =
        std::int64_t{p.y + offset} << (18 + polygon_vertex_bits) | std::int64_t{p.x + offset} << polygon_vertex_bits | vertex;
    return static_cast<std::uint64_t>(event);
}
inline std::int32_t vertex_of(std::uint64_t event) { return static_cast<std::int32_t>(event & (max_polygon_vertices - 1)); }
inline bool at_same_point(std::uint64_t event, std::uint64_t other) {
    return event >> polygon_vertex_bits == other >> polygon_vertex_bits;
}

}  // namespace detail

}}  // namespace ldi
