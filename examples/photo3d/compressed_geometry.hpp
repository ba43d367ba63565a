// Compresses geometry with EXT_meshopt_compression and KHR_mesh_quantization: sorts vertices and triangles so that they compress
// well, rounds positions to the coarsest grid without visible error, and encodes both with meshoptimizer.
#pragma once

#include <ldi/base/error.hpp>

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace ldi::examples {

/// One primitive of a GLB file.
struct primitive_geometry {
    std::vector<float> positions;                    ///< V x 3
    std::vector<std::uint16_t> texture_coordinates;  ///< V x 2, normalized
    std::vector<std::uint8_t> colors;                ///< V x 4, normalized, or empty
    std::vector<unsigned> triangles;                 ///< F x 3
    bool is_ordered = false;                         ///< draw order matters: triangles keep their order

    std::size_t vertex_count() const { return positions.size() / 3; }
};

/// Encoded vertex column or triangles.
struct compressed_stream {
    std::vector<std::byte> bytes;
    std::size_t count = 0, stride = 0;                   ///< number of decoded items; bytes of each
    const char *mode = "ATTRIBUTES", *filter = nullptr;  ///< names in EXT_meshopt_compression
};

/// Sorts triangles so that consecutive ones share vertices, and vertices in the order of their first use. Drops unused vertices.
inline void sort_for_compression(primitive_geometry& g) {
    std::vector<unsigned> sorted = g.triangles;
    if (!g.is_ordered) meshopt_optimizeVertexCacheStrip(sorted.data(), g.triangles.data(), g.triangles.size(), g.vertex_count());
    std::vector<unsigned> place(g.vertex_count());
    const std::size_t used = meshopt_optimizeVertexFetchRemap(place.data(), sorted.data(), sorted.size(), g.vertex_count());
    meshopt_remapIndexBuffer(g.triangles.data(), sorted.data(), sorted.size(), place.data());
    const auto sort = [&](auto& column, std::size_t values) {
        if (column.empty()) return;
        meshopt_remapVertexBuffer(column.data(), std::vector(column).data(), place.size(), values * sizeof column[0],
                                  place.data());
        column.resize(values * used);
    };
    sort(g.texture_coordinates, 2), sort(g.colors, 4);
    sort(g.positions, 3);
}

/// A grid of 2^bits positions along each axis. The file stores the positions as integers, which the mesh's node scales and
/// moves.
struct position_grid {
    std::array<float, 3> lowest, step;
    int bits;

    std::uint16_t place(float position, std::size_t axis) const {
        return static_cast<std::uint16_t>(std::lround((position - lowest[axis]) / step[axis]));
    }
    float position(std::uint16_t place, std::size_t axis) const { return lowest[axis] + static_cast<float>(place) * step[axis]; }
};

/// Projects two positions from the photo's camera, at the origin, onto the plane at distance 1. Returns the larger of the
/// horizontal and the vertical distance between the two projections.
inline float seen_apart(const float* a, const float* b) {
    return std::max(std::abs(a[0] / a[2] - b[0] / b[2]), std::abs(a[1] / a[2] - b[1] / b[2]));
}

/// Finds the coarsest grid on which no vertex moves by more than `precision` in the photo camera's view. Empty if 16 bits are
/// not enough, because near surfaces need a finer grid than far surfaces allow.
inline std::optional<position_grid> find_grid(std::span<const primitive_geometry> all, float precision) {
    std::array<float, 3> lowest, highest;
    lowest.fill(std::numeric_limits<float>::infinity()), highest.fill(-std::numeric_limits<float>::infinity());
    for (const primitive_geometry& g : all)
        for (std::size_t i = 0; i < g.positions.size(); ++i) {
            lowest[i % 3] = std::min(lowest[i % 3], g.positions[i]);
            highest[i % 3] = std::max(highest[i % 3], g.positions[i]);
        }
    const auto is_precise = [&](const position_grid& grid) {
        for (const primitive_geometry& g : all)
            for (std::size_t v = 0; v < g.positions.size(); v += 3) {
                std::array<float, 3> kept;
                for (std::size_t k = 0; k < 3; ++k) kept[k] = grid.position(grid.place(g.positions[v + k], k), k);
                if (!(seen_apart(kept.data(), &g.positions[v]) <= precision)) return false;
            }
        return true;
    };
    for (int bits = 10; bits <= 16; ++bits) {
        position_grid grid{lowest, {}, bits};
        const float places = static_cast<float>((1 << bits) - 1);
        for (std::size_t k = 0; k < 3; ++k) grid.step[k] = highest[k] > lowest[k] ? (highest[k] - lowest[k]) / places : 1.0F;
        if (is_precise(grid)) return grid;
    }
    return std::nullopt;
}

/// Compresses a vertex column.
///
/// stride  bytes per vertex, a multiple of 4
template <class Scalar>
compressed_stream compress_column(const std::vector<Scalar>& values, std::size_t stride) {
    compressed_stream result;
    result.stride = stride, result.count = values.size() * sizeof(Scalar) / stride;
    meshopt_encodeVertexVersion(0);  // the only version that the extension supports
    result.bytes.resize(meshopt_encodeVertexBufferBound(result.count, stride));
    result.bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(result.bytes.data()), result.bytes.size(),
                                                   values.data(), result.count, stride));
    return result;
}

/// Compresses positions as integers on the grid. Each vertex has a fourth integer, 0, because the size of a vertex must be a
/// multiple of 4 bytes.
inline compressed_stream compress_positions(const std::vector<float>& positions, const position_grid& grid) {
    std::vector<std::uint16_t> places(positions.size() / 3 * 4);
    for (std::size_t i = 0; i < positions.size(); ++i) places[i / 3 * 4 + i % 3] = grid.place(positions[i], i % 3);
    return compress_column(places, 8);
}

/// Compresses positions as floats with as few bits as `precision` allows; the coordinates of a vertex share an exponent. Replaces
/// `positions` with the decoded values. Use this function for scenes whose depth range is too large for a grid.
inline compressed_stream compress_positions(std::vector<float>& positions, float precision) {
    const std::size_t count = positions.size() / 3;
    std::vector<std::uint32_t> filtered(positions.size()), decoded;
    std::vector<float> kept(positions.size());
    for (int bits = 12; bits <= 24; ++bits) {
        meshopt_encodeFilterExp(filtered.data(), count, 12, bits, positions.data());
        decoded = filtered;
        meshopt_decodeFilterExp(decoded.data(), count, 12);
        std::memcpy(kept.data(), decoded.data(), 4 * decoded.size());
        bool is_precise = true;
        for (std::size_t v = 0; v < positions.size() && is_precise; v += 3)
            is_precise = seen_apart(&kept[v], &positions[v]) <= precision;
        if (is_precise) break;
    }
    positions = kept;
    compressed_stream result = compress_column(filtered, 12);
    result.filter = "EXPONENTIAL";
    return result;
}

inline compressed_stream compress_triangles(const primitive_geometry& g) {
    compressed_stream result;
    result.stride = g.vertex_count() < 65536 ? 2 : 4, result.count = g.triangles.size(), result.mode = "TRIANGLES";
    meshopt_encodeIndexVersion(1);  // the only version that the extension supports
    result.bytes.resize(meshopt_encodeIndexBufferBound(result.count, g.vertex_count()));
    result.bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(result.bytes.data()), result.bytes.size(),
                                                  g.triangles.data(), result.count));
    return result;
}

/// Grid of integer texture coordinates, in texels or fractions of a texel. Most coordinates are corners of texels, and these
/// lie on the grid.
struct texel_grid {
    std::array<float, 2> parts;  ///< number of grid cells along each side of the texture

    std::uint16_t place(std::uint16_t normalized, std::size_t axis) const {
        return static_cast<std::uint16_t>(std::lround(static_cast<float>(normalized) / 65535.0F * parts[axis]));
    }
};

/// Finds the coarsest grid, of whole, half, quarter or eighth texels, on which all coordinates lie. Empty if there is none.
inline std::optional<texel_grid> find_texel_grid(const primitive_geometry& g, std::size_t width, std::size_t height) {
    for (std::size_t parts = 1; parts <= 8; parts *= 2) {
        const texel_grid grid{{static_cast<float>(parts * width), static_cast<float>(parts * height)}};
        if (std::max(grid.parts[0], grid.parts[1]) > 65535.0F) break;
        bool is_on_grid = true;
        for (std::size_t i = 0; i < g.texture_coordinates.size() && is_on_grid; ++i) {
            const std::uint16_t normalized = g.texture_coordinates[i];
            const float back = static_cast<float>(grid.place(normalized, i % 2)) / grid.parts[i % 2] * 65535.0F;
            is_on_grid = std::abs(back - static_cast<float>(normalized)) <= 0.52F;
        }
        if (is_on_grid) return grid;
    }
    return std::nullopt;
}

}  // namespace ldi::examples
