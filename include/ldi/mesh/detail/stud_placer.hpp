// Places the studs of charts at the bends of sampled disparity (mesh/studs.hpp).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/detail/stud_lines.hpp>
#include <ldi/mesh/detail/stud_sampler.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/stud_set.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Converts the samples of stud_sampler to studs, chart by chart.
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

/// Places the studs of all charts. Checks only the options; the other arguments must fit together.
inline stud_set place_studs(const graph_view& g, array_view<const float> disparity, const depth_range& range,
                            const chart_set& charts, const chart_outlines& outlines, const stud_options& options) {
    if (options.spacing < 1 || options.clearance < 1 || options.clearance > 64 || !(options.disparity_tolerance >= 0) ||
        !(options.texture_tolerance > 0))
        raise(error_code::invalid_option, "stud_options",
              "spacing >= 1, clearance in 1..64, disparity_tolerance >= 0, texture_tolerance > 0",
              std::to_string(options.spacing) + ", " + std::to_string(options.clearance) + ", " +
                  to_text(options.disparity_tolerance) + ", " + to_text(options.texture_tolerance));
    stud_sampler sampler(g, disparity, outlines, options);
    sampler.sample(charts, range);
    stable_sort(sampler.singles, [](const auto& a, const auto& b) { return a.chart < b.chart; });
    stud_placer placer(sampler, options, range);
    const stud_sampler::single* first = sampler.singles.begin();
    for (std::int32_t c = 0; c < charts.charts.count(); ++c) {
        const stud_sampler::single* last = first;
        while (last != sampler.singles.end() && last->chart == c) ++last;
        placer.place(charts.charts[c], sampler.charts[c], {first, last});
        first = last;
    }
    return placer.finish();
}

}}}  // namespace ldi::detail
