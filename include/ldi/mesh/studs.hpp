// Studs: vertical polylines inside charts that carry the interior vertices (paper, section "Meshing", Figure "meshing" c).
//
// As in the paper, studs stand as evenly as possible between the left and right end of a chart, and their edges are kept by the
// triangulation. Three things differ. Vertices are not evenly spaced but lie where disparity bends along the stud: evenly spaced
// ones cost several times the error at the same number of triangles. Between the studs there are single vertices where disparity
// bends along evenly spaced rows, for else everything upright and narrower than the distance between studs would be lost; they
// reduce the error by a quarter at the same number of vertices. And no vertex lies near the outline; the sweep that triangulates
// (triangulate.hpp) ties the first and last vertex of a stud to vertices of the outline, so outlines need no extra ones.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/outlines.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>

namespace ldi {

struct stud_options {
    /// The distance between studs, and between the rows with single vertices, that is aimed at, in pixels; at least 1.
    std::int32_t spacing = 24;
    /// How far disparity between two vertices along a stud or row may be from linear.
    float disparity_tolerance = 0.006F;
    /// No vertex has a pixel of another chart or surface within this many pixels, so studs keep clear of simplified outlines; and
    /// no single vertex lies this near to a stud. More than the tolerance of outlines; at most 64.
    std::int32_t clearance = 4;
    /// How far, in pixels, triangles may shift the texture when it is drawn (depth_range::texture_shift). On slanted surfaces
    /// studs and their vertices stand closer for it, though not closer than twice the clearance.
    float texture_tolerance = 0.5F;
};

/// Studs of all charts.
struct stud_set {
    buffer<outline_corner> vertices;    ///< stud by stud, from top to bottom; corners between four pixels of one chart
    buffer<std::int32_t> first_vertex;  ///< stud s has vertices [first_vertex[s], first_vertex[s + 1]); one or more
    buffer<std::int32_t> first_stud;    ///< chart c has studs [first_stud[c], first_stud[c + 1])
};

/// Places the studs of all charts. `outlines` are those of the same charts. Raises invalid_option.
stud_set make_studs(const graph& g, std::span<const float> disparity, const chart_set& charts, const chart_outlines& outlines,
                    const stud_options& options, const depth_range& range = {});

namespace detail {

/// Lines between the ends of an extent, as evenly as whole numbers allow. Tabulated, for they are asked for at every row of a
/// chart.
class even_lines {
public:
    even_lines(std::int32_t begin, std::int32_t length, std::int32_t spacing)
        : first_(begin), line_from_(static_cast<std::size_t>(length) + 1) {
        const std::int32_t count = (std::max)((length + spacing / 2) / spacing - 1, 0);
        positions_.reserve(static_cast<std::size_t>(count));
        for (std::int32_t line = 1; line <= count; ++line) positions_.push_back(begin + line * length / (count + 1));
        std::int32_t line = 0;
        for (std::int32_t offset = 0; offset <= length; ++offset) {
            while (line < count && position(line) < begin + offset) ++line;
            line_from_[offset] = line;
        }
    }

    std::int32_t count() const { return static_cast<std::int32_t>(positions_.size()); }
    std::int32_t position(std::int32_t line) const { return positions_[line]; }
    /// The first line that does not lie before `at`, at most the end of the extent; count() if there is none.
    std::int32_t line_from(std::int32_t at) const { return line_from_[(std::max)(at - first_, 0)]; }
    bool has_line_at(std::int32_t at) const {
        const std::int32_t line = line_from(at);
        return line < count() && position(line) == at;
    }

private:
    std::int32_t first_;
    buffer<std::int32_t> positions_, line_from_;
};

/// Finds where a profile bends: what Douglas-Peucker keeps of it, its ends included.
class bend_finder {
public:
    /// Calls found(i) for ascending indices i in [margin, size - margin). A stretch [first, last] without bends is cut in the
    /// middle if is_too_long(first, last).
    template <class TooLong, class Function>
    void operator()(std::span<const float> profile, float tolerance, std::size_t margin, TooLong&& is_too_long,
                    Function&& found) {
        keep_.assign(profile.size(), 0);
        stack_.assign(1, {0, profile.size() - 1});
        while (!stack_.empty()) {
            const auto [first, last] = stack_.back();
            stack_.pop_back();
            const float slope = (profile[last] - profile[first]) / static_cast<float>(std::max<std::size_t>(last - first, 1));
            float worst = tolerance, expected = profile[first];
            std::size_t split = 0;
            for (std::size_t i = first + 1; i < last; ++i) {
                expected += slope;
                const float error = std::abs(profile[i] - expected);
                if (error > worst) worst = error, split = i;
            }
            if (split == 0 && last - first > 1 && is_too_long(first, last)) split = first + (last - first) / 2;
            if (split == 0) continue;
            keep_[split] = 1;
            stack_.emplace_back(first, split);
            stack_.emplace_back(split, last);
        }
        for (std::size_t i = margin; i + margin < profile.size(); ++i)
            if (keep_[i] != 0) found(i);
    }

private:
    buffer<std::uint8_t> keep_;
    buffer<std::pair<std::size_t, std::size_t>> stack_;
};

/// Reads disparity along studs and rows in one pass over the rows of charts, in the order in which pixels lie in memory.
class stud_sampler {
public:
    enum presence : std::uint8_t { absent, continued, begun };  // begun: not connected to the row above

    /// Column k of a chart has one sample for each row of the chart's bounding box.
    struct columns {
        even_lines lines;
        std::size_t first_sample;
    };
    buffer<columns> charts;
    buffer<float> samples;
    buffer<std::uint8_t> present;
    buffer<std::pair<std::int32_t, outline_corner>> singles;  ///< chart and vertex

    stud_sampler(const graph& g, std::span<const float> disparity, const chart_set& all, const chart_outlines& outlines,
                 const stud_options& options, const depth_range& range)
        : g_(g), disparity_(disparity), sides_(outlines.boundary_sides), clearance_(options.clearance) {
        std::size_t total = 0;
        buffer<even_lines> rows;
        for (const chart& c : all.charts) {
            charts.push_back({even_lines(c.x, c.width, spacing_for(c, options, range)), total});
            rows.emplace_back(c.y, c.height, options.spacing);
            total += static_cast<std::size_t>(charts.back().lines.count()) * static_cast<std::size_t>(c.height);
        }
        samples.resize(total);
        present.assign(total, absent);
        std::int32_t begin = 0;
        for (std::int32_t pixel : outlines.boundary_pixels) {
            // A row of one chart: pixels begin to end - 1. In canonical order they lie side by side.
            const std::uint8_t at_pixel = sides_[pixel];
            if ((at_pixel & side_bit(3)) != 0) begin = pixel;
            if ((at_pixel & side_bit(1)) == 0) continue;
            const std::int32_t end = pixel + 1;
            if (end - begin < 2 * clearance_) continue;
            const std::size_t c = static_cast<std::size_t>(all.chart_of[pixel]);
            sample_columns(begin, end, all.charts[c], charts[c]);
            if (rows[c].has_line_at(g.y[pixel]))
                sample_row(begin, end, static_cast<std::int32_t>(c), charts[c].lines, options.disparity_tolerance);
        }
    }

private:
    /// The distance between studs at which nine tenths of the chart keep within the tolerance of the texture.
    std::int32_t spacing_for(const chart& c, const stud_options& options, const depth_range& range) {
        // Every so many pixels, the slope over so many: about a thousand samples tell as much as all.
        const std::size_t stride = std::max<std::size_t>(61, c.pixels.size() / 1024), reach = 8;
        shifts_.clear();
        const float spacing = static_cast<float>(options.spacing);
        for (std::size_t i = 0; i + reach < c.pixels.size(); i += stride) {
            const std::size_t a = static_cast<std::size_t>(c.pixels[i]), b = static_cast<std::size_t>(c.pixels[i + reach]);
            if (b != a + reach || g_.y[a] != g_.y[b] || g_.x[b] != g_.x[a] + static_cast<std::int32_t>(reach)) continue;
            shifts_.push_back(range.texture_shift(spacing * spacing / static_cast<float>(reach), disparity_[a], disparity_[b]));
        }
        if (shifts_.empty()) return options.spacing;
        const auto rank = shifts_.begin() + static_cast<std::ptrdiff_t>(shifts_.size() * 9 / 10);
        std::nth_element(shifts_.begin(), rank, shifts_.end());
        if (*rank <= options.texture_tolerance) return options.spacing;
        const std::int32_t closer = static_cast<std::int32_t>(spacing * std::sqrt(options.texture_tolerance / *rank));
        return (std::min)((std::max)(closer, 2 * options.clearance), options.spacing);
    }

    void sample_columns(std::int32_t begin, std::int32_t end, const chart& box, const columns& target) {
        const std::int32_t x = g_.x[begin], y = g_.y[begin];
        for (std::int32_t k = target.lines.line_from(x + clearance_); k < target.lines.count(); ++k) {
            const std::int32_t at = target.lines.position(k);
            if (at > x + (end - begin) - clearance_) break;
            const std::int32_t pixel = begin + at - x;
            const std::size_t sample = target.first_sample + static_cast<std::size_t>(k) * static_cast<std::size_t>(box.height) +
                                       static_cast<std::size_t>(y - box.y);
            samples[sample] = between(pixel);
            present[sample] = (sides_around(pixel) & side_bit(0)) != 0 ? begun : continued;
        }
    }

    void sample_row(std::int32_t begin, std::int32_t end, std::int32_t c, const even_lines& studs, float tolerance) {
        profile_.assign(1, disparity_[static_cast<std::size_t>(begin)]);
        for (std::int32_t i = begin + 1; i < end; ++i) profile_.push_back(between(i));
        profile_.push_back(disparity_[static_cast<std::size_t>(end) - 1]);
        const auto never = [](std::size_t, std::size_t) { return false; };
        find_bends_(profile_, tolerance, static_cast<std::size_t>(clearance_), never, [&](std::size_t i) {
            const std::int32_t pixel = begin + static_cast<std::int32_t>(i);
            const std::int32_t x = g_.x[pixel], stud = studs.line_from(x - clearance_);
            if (stud < studs.count() && studs.position(stud) <= x + clearance_) return;
            if ((sides_around(pixel) & side_bit(0)) != 0) return;
            const std::int32_t above = g_.up[pixel];
            if (!is_clear(pixel, 2) || !is_clear(above, 0)) return;
            const float d = 0.5F * (between(pixel) + between(above));
            singles.emplace_back(c, outline_corner{x, g_.y[pixel], d});
        });
    }

    /// Disparity on the left side of a pixel that continues the row of the pixel before it.
    float between(std::int32_t pixel) const {
        return 0.5F * (disparity_[static_cast<std::size_t>(pixel) - 1] + disparity_[static_cast<std::size_t>(pixel)]);
    }

    /// The boundary sides of all pixels of a row within the clearance of a pixel's left side.
    std::uint8_t sides_around(std::int32_t pixel) const {
        const std::uint8_t* at = sides_.data() + (pixel - clearance_);
        const std::uint8_t* const end = sides_.data() + (pixel + clearance_);
        std::uint64_t eight = 0, all = 0;
        for (; end - at >= 8; at += 8) std::memcpy(&eight, at, 8), all |= eight;
        for (const int half : {32, 16, 8}) all |= all >> half;
        std::uint8_t around = static_cast<std::uint8_t>(all);
        for (; at != end; ++at) around = static_cast<std::uint8_t>(around | *at);
        return around;
    }

    /// Whether the rows from that of `pixel` on towards side `s` (0 up, 2 down) belong to the chart all around, over the
    /// clearance.
    bool is_clear(std::int32_t pixel, int s) const {
        for (std::int32_t row = 1;; ++row) {
            const std::int32_t first = pixel - clearance_, last = pixel + clearance_ - 1;
            for (std::int32_t i = first; i < last; ++i)
                if ((sides_[i] & side_bit(1)) != 0) return false;
            if (row == clearance_) return true;
            if ((sides_around(pixel) & side_bit(s)) != 0) return false;
            pixel = (s == 0 ? g_.up : g_.down)[pixel];
        }
    }

    const graph& g_;
    std::span<const float> disparity_;
    const buffer<std::uint8_t>& sides_;
    std::int32_t clearance_;
    buffer<float> profile_, shifts_;
    bend_finder find_bends_;
};

}  // namespace detail

inline stud_set make_studs(const graph& g, std::span<const float> disparity, const chart_set& charts,
                           const chart_outlines& outlines, const stud_options& options, const depth_range& range) {
    if (options.spacing < 1 || options.clearance < 1 || options.clearance > 64 || !(options.disparity_tolerance >= 0) ||
        !(options.texture_tolerance > 0))
        raise(error_code::invalid_option, "stud_options",
              "spacing >= 1, clearance in 1..64, disparity_tolerance >= 0, texture_tolerance > 0",
              std::to_string(options.spacing) + ", " + std::to_string(options.clearance) + ", " +
                  std::to_string(options.disparity_tolerance) + ", " + std::to_string(options.texture_tolerance));
    detail::stud_sampler sampled(g, disparity, charts, outlines, options, range);
    stable_sort(sampled.singles, [](const auto& a, const auto& b) { return a.first < b.first; });
    stud_set result;
    result.first_vertex.push_back(0), result.first_stud.push_back(0);
    const auto end_stud = [&] {
        const std::int32_t end = static_cast<std::int32_t>(result.vertices.size());
        if (end > result.first_vertex.back()) result.first_vertex.push_back(end);
    };
    buffer<float> profile;
    detail::bend_finder find_bends;
    auto single = sampled.singles.begin();
    for (std::size_t c = 0; c < charts.charts.size(); ++c) {
        const detail::stud_sampler::columns& columns = sampled.charts[c];
        const std::int32_t height = charts.charts[c].height, top = charts.charts[c].y;
        for (std::int32_t k = 0; k < columns.lines.count(); ++k) {
            const std::size_t first = columns.first_sample + static_cast<std::size_t>(k) * static_cast<std::size_t>(height);
            const float* const samples = sampled.samples.data() + first;
            const std::uint8_t* const present = sampled.present.data() + first;
            for (std::int32_t begin = 0, end = 0; begin < height; begin = end) {
                end = begin + 1;
                if (present[begin] == detail::stud_sampler::absent) continue;
                while (end < height && present[end] == detail::stud_sampler::continued) ++end;
                if (end - begin < 2 * options.clearance) continue;
                // Vertices lie between rows. The ends, near the outline, only serve to measure the others.
                profile.assign(1, samples[begin]);
                for (std::int32_t row = begin + 1; row < end; ++row) profile.push_back(0.5F * (samples[row - 1] + samples[row]));
                profile.push_back(samples[end - 1]);
                // The texture shifts along the stud, and on the way to the next stud where that is nearer or farther.
                const std::size_t shortest = 2 * static_cast<std::size_t>(options.clearance);
                const auto is_too_long = [&](std::size_t a, std::size_t b) {
                    if (b - a < shortest) return false;
                    const float length = static_cast<float>(b - a);
                    float shift = range.texture_shift(length, profile[a], profile[b]);
                    for (std::size_t i : {a, b}) {
                        const std::size_t row =
                            (std::min)(static_cast<std::size_t>(begin) + i, static_cast<std::size_t>(end) - 1);
                        for (const std::ptrdiff_t to_next :
                             {-static_cast<std::ptrdiff_t>(height), static_cast<std::ptrdiff_t>(height)}) {
                            if (to_next < 0 ? k == 0 : k + 1 == columns.lines.count()) continue;
                            const std::ptrdiff_t next = static_cast<std::ptrdiff_t>(row) + to_next;
                            if (present[next] != detail::stud_sampler::absent)
                                shift = (std::max)(shift, range.texture_shift(length, samples[row], samples[next]));
                        }
                    }
                    return shift > options.texture_tolerance;
                };
                find_bends(profile, options.disparity_tolerance, static_cast<std::size_t>(options.clearance), is_too_long,
                           [&](std::size_t i) {
                               const std::int32_t y = top + begin + static_cast<std::int32_t>(i);
                               result.vertices.push_back({columns.lines.position(k), y, profile[i]});
                           });
                end_stud();
            }
        }
        for (; single != sampled.singles.end() && single->first == static_cast<std::int32_t>(c); ++single) {
            result.vertices.push_back(single->second);
            end_stud();
        }
        result.first_stud.push_back(static_cast<std::int32_t>(result.first_vertex.size()) - 1);
    }
    return result;
}

}  // namespace ldi
