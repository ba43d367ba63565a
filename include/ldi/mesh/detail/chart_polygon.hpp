// Polygon of a chart for triangulation: its simplified outline, then its studs.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/polygon.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/stud_set.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

static_assert(std::int64_t{4} * max_chart_box * max_chart_box <= max_polygon_vertices);  // see polygon_event()

/// Polygon for the triangulator. Per outline vertex, `corners` has the index of its corner in chart_outlines, and `edges` has the
/// boundary edge that starts there.
struct chart_polygon {
    polygon shape;
    buffer<std::int32_t> corners;
    buffer<boundary_edge> edges;
    buffer<std::uint8_t> fresh;  ///< per edge: simplified_boundary::is_fresh()

    void assign(const chart_outlines& outlines, const simplified_boundary& boundary, const chart& box, std::int32_t chart_index) {
        shape.clear(), corners.clear(), edges.clear(), fresh.clear();
        for (std::int32_t l = outlines.first_loop[chart_index]; l < outlines.first_loop[chart_index + 1]; ++l) {
            const std::int32_t loop_start = shape.points.count();
            for (std::int32_t s = outlines.first_step[l]; s < outlines.first_step[l + 1]; ++s) {
                const outline_step step = outlines.steps[s];
                const std::span<const std::int32_t> kept = boundary.corners(step.piece);
                const std::size_t last = kept.size() - 1;
                for (std::size_t i = 0; i < last; ++i) {
                    const std::int32_t id = kept[step.reversed ? last - i : i];
                    add(outlines.corners[id], box);
                    corners.push_back(id);
                    edges.push_back({step.piece, static_cast<std::int32_t>(step.reversed ? last - i - 1 : i)});
                    fresh.push_back(boundary.is_fresh(edges.back()) ? 1 : 0);
                }
            }
            shape.next.back() = loop_start;
        }
        shape.outline_count = shape.points.count();
    }

    void add_studs(const stud_set& studs, const chart& box, std::int32_t chart_index) {
        for (std::int32_t s = studs.first_stud[chart_index]; s < studs.first_stud[chart_index + 1]; ++s) {
            const std::int32_t end = studs.first_vertex[s + 1];
            for (std::int32_t v = studs.first_vertex[s]; v < end; ++v) add(studs.vertices[v], box);
            shape.next.back() = -1;
        }
    }

private:
    void add(const outline_corner& corner, const chart& box) {
        shape.points.push_back({corner.x - box.x, corner.y - box.y});
        shape.next.push_back(shape.points.count());
    }
};

}}}  // namespace ldi::detail
