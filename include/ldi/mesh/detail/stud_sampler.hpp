// Samples disparity along the lines on which studs lie, and finds the single vertices between them (mesh/studs.hpp).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/mesh/detail/boundary_walk.hpp>
#include <ldi/mesh/detail/outline_clearance.hpp>
#include <ldi/mesh/detail/stud_lines.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/stud_set.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

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
    /// Returns the spacing between studs at which nine tenths of the chart's texture shift by at most texture_tolerance. If the
    /// limit applied to the whole texture, a single crease would determine the spacing. The fraction was tuned by experiment.
    std::int32_t spacing_for(const chart& c, const depth_range& range) {
        // About a thousand slopes suffice. On 121 charts of 17 photos, the spacing (up to 24 pixels) differs on average by only
        // 0.4 pixels from the spacing with 16,000 slopes, whose computation takes eight times as long. Each slope spans 8
        // pixels, and slopes start at least 61 pixels apart. Both numbers were tuned by experiment.
        constexpr std::int32_t reach = 8;
        const std::int32_t stride = (std::max)(61, static_cast<std::int32_t>(c.pixels.size() / 1024));
        shifts_.clear();
        const float spacing = nearest_float(options_.spacing);
        std::int32_t skipped = 0;  // pixels of the next run before the start of the next slope
        for (const chart_pixels::run& r : c.pixels.runs()) {
            for (; skipped < r.count; skipped += stride) {
                const std::int32_t a = r.first + skipped, b = a + reach;
                if (reach >= r.count - skipped || g_.y()[a] != g_.y()[b] || g_.x()[b] != g_.x()[a] + reach) continue;
                const float shift = range.texture_shift(spacing * spacing / nearest_float(reach), disparity_[a], disparity_[b]);
                if (!std::isnan(shift)) shifts_.push_back(shift);  // NaN if both inverse depths are 0, at negative disparities
            }
            skipped -= r.count;
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

}}}  // namespace ldi::detail
