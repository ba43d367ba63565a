// Studs: vertical polylines inside charts that carry the interior vertices (paper, section "Meshing", Figure "meshing" c).
//
// As in the paper, studs stand as evenly as possible between the left and right end of a chart, and constrain the triangulation.
// Two things differ. Their vertices are not evenly spaced but lie where disparity bends along the stud: evenly spaced ones cost
// about four times the error at the same number of triangles. And no vertex lies near the outline; the sweep that triangulates
// (triangulate.hpp) ties the first and last vertex of a stud to vertices of the outline, so no outline needs extra vertices.
#pragma once

#include <ldi/core/error.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/texture/charts.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ldi {

struct stud_options {
    /// The distance between studs, in pixels, that is aimed at; at least 1.
    std::int32_t spacing = 24;
    /// How far the disparity of a stud may be from that of its column.
    float disparity_tolerance = 0.004F;
    /// No vertex of a stud has a pixel of another chart or surface within this many pixels, so studs keep clear of simplified
    /// outlines. More than the tolerance of the outline; at most 64.
    std::int32_t clearance = 4;
};

/// Studs of all charts.
struct stud_set {
    std::vector<outline_corner> vertices;    ///< stud by stud, from top to bottom; corners between four pixels of one chart
    std::vector<std::int32_t> first_vertex;  ///< stud s has vertices [first_vertex[s], first_vertex[s + 1])
    std::vector<std::int32_t> first_stud;    ///< chart c has studs [first_stud[c], first_stud[c + 1])
};

/// Places the studs of all charts. `outlines` are those of the same charts. Raises invalid_option.
stud_set make_studs(const graph& g, std::span<const float> disparity, const chart_set& charts, const chart_outlines& outlines,
                    const stud_options& options);

namespace detail {

/// Columns of disparity where studs can stand. Column k of a chart has a sample a row of its bounding box.
struct stud_columns {
    enum presence : std::uint8_t { absent, continued, begun };  // begun: not connected to the row above

    struct chart_columns {
        std::int32_t count = 0, height = 0;
        std::size_t first_sample = 0;
    };
    std::vector<chart_columns> charts;
    std::vector<float> samples;
    std::vector<std::uint8_t> present;

    static std::int32_t position(const chart& c, std::int32_t count, std::int32_t column) {
        return c.x + (column + 1) * c.width / (count + 1);
    }
};

inline stud_columns sample_stud_columns(const graph& g, std::span<const float> disparity, const chart_set& charts,
                                        const chart_outlines& outlines, const stud_options& options) {
    stud_columns columns;
    columns.charts.resize(charts.charts.size());
    std::size_t total = 0;
    for (std::size_t c = 0; c < charts.charts.size(); ++c) {
        const chart& shape = charts.charts[c];
        const std::int32_t count = std::max((shape.width + options.spacing / 2) / options.spacing - 1, 0);
        columns.charts[c] = {count, shape.height, total};
        total += static_cast<std::size_t>(count) * static_cast<std::size_t>(shape.height);
    }
    columns.samples.resize(total);
    columns.present.assign(total, stud_columns::absent);

    const std::vector<std::uint8_t>& sides = outlines.boundary_sides;
    const std::int32_t clearance = options.clearance;
    std::int32_t begin = 0;
    for (std::int32_t pixel_on_boundary : outlines.boundary_pixels) {
        // A row of one chart: pixels begin to end - 1. In canonical order they lie side by side.
        const std::uint8_t at_pixel = sides[static_cast<std::size_t>(pixel_on_boundary)];
        if ((at_pixel & side_bit(3)) != 0) begin = pixel_on_boundary;
        if ((at_pixel & side_bit(1)) == 0) continue;
        const std::int32_t end = pixel_on_boundary + 1;
        if (end - begin < 2 * clearance) continue;
        const std::size_t c = static_cast<std::size_t>(charts.chart_of[static_cast<std::size_t>(begin)]);
        const stud_columns::chart_columns& target = columns.charts[c];
        if (target.count == 0) continue;
        const chart& shape = charts.charts[c];
        const std::int32_t x = g.x[static_cast<std::size_t>(begin)], y = g.y[static_cast<std::size_t>(begin)];
        const std::int32_t x_first = x + clearance, x_last = x + (end - begin) - clearance;
        std::int32_t k = std::max((x_first - shape.x) * (target.count + 1) / shape.width - 1, 0);
        for (; k < target.count; ++k) {
            const std::int32_t at = stud_columns::position(shape, target.count, k);
            if (at < x_first) continue;
            if (at > x_last) break;
            const std::size_t pixel = static_cast<std::size_t>(begin + at - x);
            std::uint8_t around = 0;
            for (std::size_t i = pixel - static_cast<std::size_t>(clearance); i < pixel + static_cast<std::size_t>(clearance);
                 ++i)
                around = static_cast<std::uint8_t>(around | sides[i]);
            const std::size_t sample = target.first_sample +
                                       static_cast<std::size_t>(k) * static_cast<std::size_t>(target.height) +
                                       static_cast<std::size_t>(y - shape.y);
            columns.samples[sample] = 0.5F * (disparity[pixel - 1] + disparity[pixel]);
            columns.present[sample] = (around & side_bit(0)) != 0 ? stud_columns::begun : stud_columns::continued;
        }
    }
    return columns;
}

}  // namespace detail

inline stud_set make_studs(const graph& g, std::span<const float> disparity, const chart_set& charts,
                           const chart_outlines& outlines, const stud_options& options) {
    if (options.spacing < 1 || options.clearance < 1 || options.clearance > 64 || !(options.disparity_tolerance >= 0))
        raise(error_code::invalid_option, "stud_options", "spacing >= 1, clearance in 1..64, disparity_tolerance >= 0",
              std::to_string(options.spacing) + ", " + std::to_string(options.clearance) + ", " +
                  std::to_string(options.disparity_tolerance));
    const detail::stud_columns columns = detail::sample_stud_columns(g, disparity, charts, outlines, options);
    stud_set result;
    result.first_vertex.push_back(0), result.first_stud.push_back(0);
    std::vector<outline_corner> profile;
    std::vector<std::uint8_t> keep;
    std::vector<std::pair<std::int32_t, std::int32_t>> stack;
    for (std::size_t c = 0; c < charts.charts.size(); ++c) {
        const chart& shape = charts.charts[c];
        const detail::stud_columns::chart_columns& source = columns.charts[c];
        for (std::int32_t k = 0; k < source.count; ++k) {
            const std::size_t first = source.first_sample + static_cast<std::size_t>(k) * static_cast<std::size_t>(source.height);
            const float* const samples = columns.samples.data() + first;
            const std::uint8_t* const present = columns.present.data() + first;
            const std::int32_t x = detail::stud_columns::position(shape, source.count, k);
            for (std::int32_t begin = 0, end = 0; begin < source.height; begin = end) {
                end = begin + 1;
                if (present[begin] == detail::stud_columns::absent) continue;
                while (end < source.height && present[end] == detail::stud_columns::continued) ++end;
                if (end - begin < 2 * options.clearance) continue;
                // Corners lie between rows; the first and last one, near the outline, only serve to measure the others.
                profile.assign(1, {x, shape.y + begin, samples[begin]});
                for (std::int32_t row = begin + 1; row < end; ++row)
                    profile.push_back({x, shape.y + row, 0.5F * (samples[row - 1] + samples[row])});
                profile.push_back({x, shape.y + end, samples[end - 1]});
                detail::douglas_peucker(profile, 1.0F, options.disparity_tolerance, keep, stack);
                for (std::int32_t i = options.clearance; i + options.clearance <= end - begin; ++i)
                    if (keep[static_cast<std::size_t>(i)] != 0) result.vertices.push_back(profile[static_cast<std::size_t>(i)]);
                if (static_cast<std::int32_t>(result.vertices.size()) > result.first_vertex.back())
                    result.first_vertex.push_back(static_cast<std::int32_t>(result.vertices.size()));
            }
        }
        result.first_stud.push_back(static_cast<std::int32_t>(result.first_vertex.size()) - 1);
    }
    return result;
}

}  // namespace ldi
