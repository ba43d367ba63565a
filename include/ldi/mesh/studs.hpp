// Studs: vertical polylines inside charts that carry the interior vertices (paper, section "Meshing", Figure "meshing" c).
//
// As in the paper, studs are distributed evenly between the left and right end of a chart, and the triangulation keeps their
// edges. This code differs in three ways. First, the vertices of a stud are not evenly spaced but lie where disparity bends:
// with even spacing the error is several times as large for the same number of triangles. Second, extra vertices between
// the studs mark bends of disparity along evenly spaced rows. Without them, everything upright and narrower than the distance
// between studs would be lost; they reduce the error by a quarter for the same number of vertices. Third, no vertex lies near
// the outline: the sweep that triangulates (triangulate.hpp) connects the first and last vertex of a stud to vertices of the
// outline, so outlines need no extra vertices.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/mesh/detail/boundary_walk.hpp>
#include <ldi/mesh/detail/outline_clearance.hpp>
#include <ldi/mesh/detail/stud_lines.hpp>
#include <ldi/mesh/outlines.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct stud_options {
    /// Target distance between studs, and between the rows with single vertices, in pixels; at least 1. A smaller distance or
    /// tolerance means more triangles and a smaller error; both were tuned by experiment.
    std::int32_t spacing = 24;
    /// Maximum error of disparity interpolated between two vertices along a stud or row.
    float disparity_tolerance = 0.006F;
    /// Minimum distance in pixels from a vertex to other charts and surfaces, and from a single vertex to a stud; at most 64.
    /// It must be larger than the tolerance of outlines, so that studs keep clear of simplified outlines.
    std::int32_t clearance = 4;
    /// Maximum shift of the texture over a triangle when it is drawn, in pixels (depth_range::texture_shift). On slanted
    /// surfaces this moves studs and their vertices closer together, but not closer than twice the clearance.
    float texture_tolerance = 0.5F;
};

/// Studs of all charts. Single vertices are studs with one vertex.
struct stud_set {
    buffer<outline_corner> vertices;    ///< stud by stud, from top to bottom; corners between four pixels of one chart
    buffer<std::int32_t> first_vertex;  ///< stud s has vertices [first_vertex[s], first_vertex[s + 1]); one or more
    buffer<std::int32_t> first_stud;    ///< chart c has studs [first_stud[c], first_stud[c + 1])
};

/// Places the studs of all charts. Raises invalid_option.
///
/// layers    in canonical order
/// range     distances at disparity 1 and 0
/// charts    a partition of the pixels (make_charts)
/// outlines  outlines of these charts (trace_outlines)
template <has_columns<disparity_column> Layers>
stud_set make_studs(const Layers& layers, const depth_range& range, const chart_set& charts, const chart_outlines& outlines,
                    const stud_options& options = {});

namespace detail {

/// Reads disparity along studs and rows in one pass over the rows of charts, in memory order.
class stud_sampler {
public:
    enum presence : std::uint8_t { absent, continued, begun };  // begun: not connected to the row above

    /// Vertical lines of a chart, on which its studs lie. Each line has one sample for each row of the chart's bounding box.
    struct columns {
        even_lines lines;
        std::size_t first_sample;
    };
    /// A vertex between studs.
    struct single {
        std::int32_t chart;
        outline_corner vertex;
    };
    buffer<columns> charts;
    buffer<float> samples;
    buffer<std::uint8_t> present;
    buffer<single> singles;

    stud_sampler(const graph_view& g, array_view<const float> disparity, const chart_outlines& outlines,
                 const stud_options& options)
        : g_(g),
          disparity_(disparity),
          outlines_(outlines),
          sides_(outlines.boundary_sides),
          options_(options),
          clearance_(g, outlines.boundary_sides, options.clearance) {}

    void sample(const chart_set& all, const depth_range& range) {
        std::size_t total = 0;
        buffer<even_lines> rows;
        for (const chart& c : all.charts) {
            charts.push_back({even_lines(c.x, c.width, spacing_for(c, range)), total});
            rows.emplace_back(c.y, c.height, options_.spacing);
            total += sample_offset(c, charts.back().lines.count(), 0);
        }
        samples.resize(total);
        present.assign(total, absent);
        std::int32_t begin = 0;
        for (std::int32_t pixel : outlines_.boundary_pixels) {
            // The pixels from `begin` to `pixel` are a row of one chart. They are adjacent in memory because of the canonical
            // order.
            const std::uint8_t at_pixel = sides_[pixel];
            if ((at_pixel & side_bit(3)) != 0) begin = pixel;
            if ((at_pixel & side_bit(1)) == 0) continue;
            const pixel_run row{begin, pixel + 1};
            if (row.size() < 2 * options_.clearance) continue;
            const std::int32_t c = all.chart_of[pixel];
            sample_columns(row, all.charts[c], charts[c]);
            if (rows[c].has_line_at(g_.y()[pixel])) sample_row(row, c, charts[c].lines);
        }
    }

    /// Returns the index of the sample in row `row` of column k, relative to the chart's first sample.
    static std::size_t sample_offset(const chart& box, std::int32_t k, std::int32_t row) {
        return static_cast<std::size_t>(std::int64_t{k} * box.height + row);
    }

private:
    /// Returns the spacing between studs at which nine tenths of the chart's texture shift by no more than texture_tolerance. A
    /// limit for the whole texture would let a single crease determine the spacing of the chart. The share was tuned by
    /// experiment.
    std::int32_t spacing_for(const chart& c, const depth_range& range) {
        // About a thousand slopes suffice: on 121 charts of 17 photos, the spacing (up to 24 pixels) differs by 0.4 pixels on
        // average from the spacing with 16,000 slopes, and takes an eighth of the time to compute. Each slope spans 8 pixels, and
        // slopes start at least 61 pixels apart; both numbers were tuned by experiment.
        constexpr std::int32_t reach = 8;
        const std::int32_t stride = (std::max)(61, c.pixels.count() / 1024);
        shifts_.clear();
        const float spacing = nearest_float(options_.spacing);
        for (std::int32_t i = 0; i + reach < c.pixels.count(); i += stride) {
            const std::int32_t a = c.pixels[i], b = c.pixels[i + reach];
            if (b != a + reach || g_.y()[a] != g_.y()[b] || g_.x()[b] != g_.x()[a] + reach) continue;
            shifts_.push_back(range.texture_shift(spacing * spacing / nearest_float(reach), disparity_[a], disparity_[b]));
        }
        if (shifts_.empty()) return options_.spacing;
        float* const rank = shifts_.begin() + shifts_.size() * 9 / 10;
        std::nth_element(shifts_.begin(), rank, shifts_.end());
        if (*rank <= options_.texture_tolerance) return options_.spacing;
        const std::int32_t closer = static_cast<std::int32_t>(spacing * std::sqrt(options_.texture_tolerance / *rank));
        return (std::min)((std::max)(closer, 2 * options_.clearance), options_.spacing);
    }

    void sample_columns(pixel_run row, const chart& box, const columns& target) {
        const std::int32_t x = g_.x()[row.first], y = g_.y()[row.first];
        for (std::int32_t k = target.lines.line_from(x + options_.clearance); k < target.lines.count(); ++k) {
            const std::int32_t at = target.lines.position(k);
            if (at > x + row.size() - options_.clearance) break;
            const std::int32_t pixel = row.first + at - x;
            const std::size_t sample = target.first_sample + sample_offset(box, k, y - box.y);
            samples[sample] = between(pixel);
            present[sample] = clearance_.ends_above(pixel) ? begun : continued;
        }
    }

    void sample_row(pixel_run row, std::int32_t c, const even_lines& studs) {
        const std::int32_t clearance = options_.clearance;
        profile_.assign(1, disparity_[row.first]);
        for (std::int32_t i = row.first + 1; i < row.last; ++i) profile_.push_back(between(i));
        profile_.push_back(disparity_[row.last - 1]);
        const auto never = [](std::int32_t, std::int32_t) { return false; };
        find_bends_(profile_, options_.disparity_tolerance, clearance, never, [&](std::int32_t i) {
            const std::int32_t pixel = row.first + i;
            const std::int32_t x = g_.x()[pixel], stud = studs.line_from(x - clearance);
            if (stud < studs.count() && studs.position(stud) <= x + clearance) return;
            if (clearance_.ends_above(pixel)) return;
            const std::int32_t above = g_.up()[pixel];
            if (!clearance_.is_clear(pixel, 2) || !clearance_.is_clear(above, 0)) return;
            const float d = 0.5F * (between(pixel) + between(above));
            singles.push_back({c, {x, g_.y()[pixel], d}});
        });
    }

    /// Returns the disparity at the left side of a pixel. The previous pixel in memory must be its left neighbor.
    float between(std::int32_t pixel) const { return 0.5F * (disparity_[pixel - 1] + disparity_[pixel]); }

    graph_view g_;
    array_view<const float> disparity_;
    const chart_outlines& outlines_;
    const buffer<std::uint8_t>& sides_;
    const stud_options& options_;
    outline_clearance clearance_;
    buffer<float> profile_, shifts_;
    bend_finder find_bends_;
};

/// Converts samples to studs, chart by chart.
class stud_placer {
public:
    stud_placer(const stud_sampler& sampled, const stud_options& options, const depth_range& range)
        : sampled_(sampled), options_(options), range_(range) {
        result_.first_vertex.push_back(0), result_.first_stud.push_back(0);
    }

    /// Places the studs of a chart, then its single vertices.
    void place(const chart& box, const stud_sampler::columns& columns, std::span<const stud_sampler::single> singles) {
        for (std::int32_t k = 0; k < columns.lines.count(); ++k) place_column(box, columns, k);
        for (const stud_sampler::single& s : singles) {
            result_.vertices.push_back(s.vertex);
            end_stud();
        }
        result_.first_stud.push_back(result_.first_vertex.count() - 1);
    }

    stud_set finish() { return std::move(result_); }

private:
    /// Connected rows of a column, for one stud. The samples of the adjacent columns are `height` elements away.
    struct stretch {
        const float* samples;
        const std::uint8_t* present;
        std::int32_t begin, end, height;
        bool has_left, has_right;
    };

    void place_column(const chart& box, const stud_sampler::columns& columns, std::int32_t k) {
        const std::size_t first = columns.first_sample + stud_sampler::sample_offset(box, k, 0);
        stretch s{&sampled_.samples[first], &sampled_.present[first], 0, 0, box.height, k > 0, k + 1 < columns.lines.count()};
        for (; s.begin < s.height; s.begin = s.end) {
            s.end = s.begin + 1;
            if (s.present[s.begin] == stud_sampler::absent) continue;
            while (s.end < s.height && s.present[s.end] == stud_sampler::continued) ++s.end;
            if (s.end - s.begin < 2 * options_.clearance) continue;
            // Vertices lie between rows. The ends of the profile are too close to the outline to become vertices, but their
            // samples still count for the error.
            profile_.assign(1, s.samples[s.begin]);
            for (std::int32_t row = s.begin + 1; row < s.end; ++row)
                profile_.push_back(0.5F * (s.samples[row - 1] + s.samples[row]));
            profile_.push_back(s.samples[s.end - 1]);
            const auto is_too_long = [&](std::int32_t a, std::int32_t b) {
                return b - a >= 2 * options_.clearance && texture_shift(s, a, b) > options_.texture_tolerance;
            };
            find_bends_(profile_, options_.disparity_tolerance, options_.clearance, is_too_long, [&](std::int32_t i) {
                result_.vertices.push_back({columns.lines.position(k), box.y + s.begin + i, profile_[i]});
            });
            end_stud();
        }
    }

    /// Returns the larger shift of the texture: along the stud between two indices of its profile, or toward the adjacent
    /// columns at these indices.
    float texture_shift(const stretch& s, std::int32_t a, std::int32_t b) const {
        const float length = nearest_float(b - a);
        float shift = range_.texture_shift(length, profile_[a], profile_[b]);
        for (const std::int32_t i : {a, b}) {
            const std::int32_t row = (std::min)(s.begin + i, s.end - 1);
            const auto compare = [&](std::ptrdiff_t next) {
                if (s.present[next] == stud_sampler::absent) return;
                shift = (std::max)(shift, range_.texture_shift(length, s.samples[row], s.samples[next]));
            };
            if (s.has_left) compare(row - s.height);
            if (s.has_right) compare(row + s.height);
        }
        return shift;
    }

    void end_stud() {
        const std::int32_t end = result_.vertices.count();
        if (end > result_.first_vertex.back()) result_.first_vertex.push_back(end);
    }

    const stud_sampler& sampled_;
    const stud_options& options_;
    const depth_range& range_;
    stud_set result_;
    buffer<float> profile_;
    bend_finder find_bends_;
};

}  // namespace detail

template <has_columns<disparity_column> Layers>
stud_set make_studs(const Layers& layers, const depth_range& range, const chart_set& charts, const chart_outlines& outlines,
                    const stud_options& options) {
    if (options.spacing < 1 || options.clearance < 1 || options.clearance > 64 || !(options.disparity_tolerance >= 0) ||
        !(options.texture_tolerance > 0))
        raise(error_code::invalid_option, "stud_options",
              "spacing >= 1, clearance in 1..64, disparity_tolerance >= 0, texture_tolerance > 0",
              std::to_string(options.spacing) + ", " + std::to_string(options.clearance) + ", " +
                  detail::to_text(options.disparity_tolerance) + ", " + detail::to_text(options.texture_tolerance));
    detail::stud_sampler sampler(layers.topology(), layers.template column<disparity_column>(), outlines, options);
    sampler.sample(charts, range);
    stable_sort(sampler.singles, [](const auto& a, const auto& b) { return a.chart < b.chart; });
    detail::stud_placer placer(sampler, options, range);
    const detail::stud_sampler::single* first = sampler.singles.begin();
    for (std::int32_t c = 0; c < charts.charts.count(); ++c) {
        const detail::stud_sampler::single* last = first;
        while (last != sampler.singles.end() && last->chart == c) ++last;
        placer.place(charts.charts[c], sampler.charts[c], {first, last});
        first = last;
    }
    return placer.finish();
}

}}  // namespace ldi
