// The growth of charts under the three constraints of charts/charts.hpp.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/charts/detail/contested_positions.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Grows charts one after the other. Two steps alternate: accept all reachable pixels that are not near another surface, then the
/// nearest contested pixel. `occupants_` stores for each lattice position the contested pixel that was accepted there last. If
/// that pixel belongs to an earlier chart, the position counts as free, so nothing must be cleared between charts. Uncontested
/// pixels need no entry: every pixel within the filter's range of such a pixel is on the same surface.
class chart_grower {
public:
    chart_grower(const graph_view& g, array_view<const float> disparity, surface_rule surface, std::int32_t max_side,
                 std::int32_t filter_range)
        : graph_(g),
          disparity_(disparity),
          range_(filter_range),
          threshold_(2 * surface.max_step),
          cap_x_(even_share(g.width(), max_side)),
          cap_y_(even_share(g.height(), max_side)),
          occupants_(g.position_count(), no_pixel),
          cell_shift_(cell_shift(filter_range)),
          cell_columns_((g.width() >> cell_shift_) + 1),
          cells_(static_cast<std::size_t>(std::int64_t{cell_columns_} * ((g.height() >> cell_shift_) + 1))) {
        const buffer<std::uint8_t> is_contested = contested_positions(g, filter_range);
        result_.chart_of.resize(g.size(), unset);
        for_each_run(g, [&](pixel_run run) {
            const std::uint8_t* const row = is_contested.data() + at(g.x()[run.first], g.y()[run.first]);
            std::int32_t* const marks = result_.chart_of.data() + run.first;
            for (std::int32_t i = 0; i < run.size(); ++i) marks[i] = row[i] == 0 ? uncontested : contested;
        });
    }

    chart_set grow_all() {
        const std::int32_t count = graph_.count();
        for (std::int32_t seed = 0; seed < count; ++seed)
            if (chart_of(seed) < 0) grow(seed);
        occupants_ = {}, cells_ = {}, queue_ = {}, waiting_ = {};  // releases memory before the charts get their pixels
        for (std::int32_t first = 0, last = 0; first < count; first = last) {
            const std::int32_t c = chart_of(first);
            while (last < count && chart_of(last) == c) ++last;
            result_.charts[c].pixels.add_run(first, last - first);
        }
        return std::move(result_);
    }

private:
    /// Pixels of one chart that are linked from left to right. Growth proceeds from strip to strip. Unlike those of a pixel_run,
    /// the pixels of a strip need not be adjacent in memory, because growth only follows links. The strip stores the position of
    /// its first pixel, because reading it again would cost a cache miss.
    struct strip {
        std::int32_t first, x, y, count;
    };

    /// A square of the lattice: the last chart that entered it, and the disparity range of that chart's pixels near other
    /// surfaces. Usually, this range alone proves that no pixel of the square is on another surface.
    struct cell {
        std::int32_t chart = -1;
        float lowest = 0, highest = 0;
    };

    /// Returns the binary logarithm of a cell's side length. Cells are so large that the window of a pixel overlaps at most two
    /// cells along each axis.
    static int cell_shift(std::int32_t range) {
        int shift = 1;
        while ((1 << shift) < 2 * range) ++shift;
        return shift;
    }

    static std::int32_t even_share(std::int32_t length, std::int32_t cap) {
        const std::int32_t pieces = (length - 1) / cap + 1;  // 1 for a length of 0
        return length / pieces + (length % pieces != 0 ? 1 : 0);
    }

    // Values of chart_of(pixel) before the pixel has a chart. `contested` - 1 - c marks a contested pixel that waits beside chart
    // c.
    static constexpr std::int32_t uncontested = -1, contested = -2;

    std::int32_t& chart_of(std::int32_t pixel) { return result_.chart_of[pixel]; }

    void grow(std::int32_t seed) {
        current_ = result_.charts.count();
        left_ = right_ = graph_.x()[seed], top_ = bottom_ = graph_.y()[seed];
        queue_.clear();
        visit(seed, graph_.x()[seed], graph_.y()[seed]);
        for (std::size_t next = 0;;) {
            for (; next < queue_.size(); ++next) {
                const strip r = queue_[next];
                grow_from(r, graph_.up(), r.y - 1);
                grow_from(r, graph_.down(), r.y + 1);
            }
            const auto [pixel, x, y] = nearest_contested();
            if (pixel == no_pixel) break;
            if (!fits_box(x, y) || occupant(x, y) != no_pixel || !is_clear_of_other_surfaces(pixel, x, y)) continue;
            accept_contested(pixel, x, y);
            for (const side s : all_sides) visit(graph_.neighbor(pixel, s), x + step_x(s), y + step_y(s));
        }
        chart grown;
        grown.x = left_, grown.y = top_, grown.width = right_ - left_ + 1, grown.height = bottom_ - top_ + 1;
        result_.charts.push_back(std::move(grown));
    }

    void grow_from(const strip& r, array_view<const std::int32_t> links, std::int32_t y) {
        const std::int32_t *const neighbors = links.data(), *const charts = result_.chart_of.data();
        std::int32_t pixel = r.first;
        for (std::int32_t x = r.x; x < r.x + r.count; pixel = graph_.right()[pixel]) {
            // Among pixels adjacent in memory, `++pixel` does not have to wait until the link to the right is loaded.
            const std::int32_t first = pixel;
            while (x + pixel - first + 1 < r.x + r.count && graph_.right()[pixel] == pixel + 1) ++pixel;
            for (std::int32_t p = first; p <= pixel; ++p, ++x)
                if (neighbors[p] != no_pixel && charts[neighbors[p]] < 0) visit(neighbors[p], x, y);
        }
    }

    /// Adds a pixel, and the pixels linked to its right and left, to the chart. Queues contested pixels instead. Skips a pixel
    /// that already has a chart or would make the bounding box too large.
    void visit(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        if (may_add(pixel, x, y)) add_strip(pixel, x, y);
    }

    /// Adds an uncontested pixel, and all such pixels that links connect to it on the right and left, as one strip.
    void add_strip(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        extend_box(x, y);
        std::int32_t* const charts = result_.chart_of.data();
        const std::int32_t *const right = graph_.right().data(), *const left = graph_.left().data();
        strip r{pixel, x, y, 0};
        const std::int32_t max_count = left_ + cap_x_ - x;  // of pixels that fit in the box from x to the right
        for (std::int32_t last = pixel;; last = right[last]) {
            for (charts[last] = current_, ++r.count; r.count < max_count; ++r.count) {
                if (right[last] != last + 1 || charts[last + 1] != uncontested) break;
                charts[++last] = current_;
            }
            if (!may_add(right[last], x + r.count, y)) break;
        }
        extend_box(x + r.count - 1, y);
        for (; may_add(left[r.first], r.x - 1, y); ++r.count) {
            r.first = left[r.first], --r.x;
            charts[r.first] = current_;
            extend_box(r.x, y);
        }
        queue_.push_back(r);
    }

    /// Whether a pixel is uncontested, has no chart, and fits in the bounding box. Queues a contested pixel.
    bool may_add(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        if (pixel == no_pixel || chart_of(pixel) >= 0) return false;
        if (chart_of(pixel) == uncontested) return fits_box(x, y);
        wait(pixel, x, y);
        return false;
    }

    bool fits_box(std::int32_t x, std::int32_t y) const {
        return right_ - x < cap_x_ && x - left_ < cap_x_ && bottom_ - y < cap_y_ && y - top_ < cap_y_;
    }

    /// Queues a contested pixel, at most once per chart: a chart that rejects a pixel once would also reject it later.
    void wait(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        const std::int32_t mark = contested - 1 - current_;
        if (chart_of(pixel) == mark) return;
        chart_of(pixel) = mark;
        const std::int32_t level = level_of(disparity_[pixel]);
        waiting_[static_cast<std::size_t>(level)].push_back({pixel, x, y});
        nearest_ = (std::min)(nearest_, level);
    }

    static std::int32_t level_of(float disparity) {
        const float farness = (1.0F - disparity) * 200.0F;
        return farness < 0.0F ? 0 : farness < nearest_float(levels - 1) ? static_cast<std::int32_t>(farness) : levels - 1;
    }

    struct waiting_pixel {
        std::int32_t pixel, x, y;
    };

    /// Removes the nearest contested pixel from the queue and returns it, or no_pixel if the queue is empty.
    waiting_pixel nearest_contested() {
        for (; nearest_ < levels; ++nearest_) {
            buffer<waiting_pixel>& here = waiting_[static_cast<std::size_t>(nearest_)];
            if (here.empty()) continue;
            const waiting_pixel p = here.back();
            here.pop_back();
            return p;
        }
        return {no_pixel, 0, 0};
    }

    void extend_box(std::int32_t x, std::int32_t y) {
        left_ = (std::min)(left_, x), right_ = (std::max)(right_, x);
        top_ = (std::min)(top_, y), bottom_ = (std::max)(bottom_, y);
    }

    void accept_contested(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        chart_of(pixel) = current_;
        occupants_[at(x, y)] = pixel;
        extend_box(x, y);
        const float disparity = disparity_[pixel];
        cell& c = cell_at(x, y);
        if (c.chart != current_) c = {current_, disparity, disparity};
        c.lowest = (std::min)(c.lowest, disparity), c.highest = (std::max)(c.highest, disparity);
    }

    cell& cell_at(std::int32_t x, std::int32_t y) {
        return cells_[std::int64_t{y >> cell_shift_} * cell_columns_ + (x >> cell_shift_)];
    }

    /// Returns the current chart's contested pixel at a lattice position, or no_pixel.
    std::int32_t occupant(std::int32_t x, std::int32_t y) {
        const std::int32_t pixel = occupants_[at(x, y)];
        return pixel != no_pixel && chart_of(pixel) == current_ ? pixel : no_pixel;
    }

    /// The lattice positions within the filter's range of one position.
    struct window {
        std::int32_t left, right, top, bottom;
    };
    window around(std::int32_t x, std::int32_t y) const {
        return {std::max<std::int32_t>(x - range_, 0), std::min<std::int32_t>(x + range_, graph_.width() - 1),
                std::max<std::int32_t>(y - range_, 0), std::min<std::int32_t>(y + range_, graph_.height() - 1)};
    }

    bool is_clear_of_other_surfaces(std::int32_t pixel, std::int32_t x, std::int32_t y) {
        const window w = around(x, y);
        const float disparity = disparity_[pixel];
        const auto has_others = [&](const cell& c) {
            return c.chart == current_ && (c.lowest < disparity - threshold_ || c.highest > disparity + threshold_);
        };
        if (!has_others(cell_at(w.left, w.top)) && !has_others(cell_at(w.right, w.top)) &&
            !has_others(cell_at(w.left, w.bottom)) && !has_others(cell_at(w.right, w.bottom)))
            return true;
        for (std::int32_t v = w.top; v <= w.bottom; ++v)
            for (std::int32_t u = w.left; u <= w.right; ++u) {
                const std::int32_t other = occupant(u, v);
                if (other == no_pixel || !differ(other, pixel)) continue;
                if (is_off_surface(pixel, u - x, v - y, other) || is_off_surface(other, x - u, y - v, pixel)) return false;
            }
        return true;
    }

    /// Whether `other`, which is `steps_x` columns and `steps_y` rows away, lies on a different surface than `pixel`. Follows
    /// links from `pixel` along two paths, one horizontal and then vertical, the other vertical and then horizontal, as far as
    /// links exist. The result is true if the disparities at the ends of both paths differ from that of `other`.
    bool is_off_surface(std::int32_t pixel, std::int32_t steps_x, std::int32_t steps_y, std::int32_t other) const {
        array_view<const std::int32_t> along_x = steps_x < 0 ? graph_.left() : graph_.right();
        array_view<const std::int32_t> along_y = steps_y < 0 ? graph_.up() : graph_.down();
        const auto walk = [&](array_view<const std::int32_t> first, std::int32_t first_steps,
                              array_view<const std::int32_t> second, std::int32_t second_steps) {
            std::int32_t at = pixel;
            for (std::int32_t step = 0; step < first_steps + second_steps; ++step) {
                const std::int32_t next = (step < first_steps ? first : second)[at];
                if (next == no_pixel) break;
                at = next;
            }
            return at;
        };
        return differ(other, walk(along_x, std::abs(steps_x), along_y, std::abs(steps_y))) &&
               differ(other, walk(along_y, std::abs(steps_y), along_x, std::abs(steps_x)));
    }

    /// Whether two pixels belong to different surfaces: their disparities differ by more than twice surface_rule::max_step. The
    /// limit for links in expand() is almost the same (max_joined_step).
    bool differ(std::int32_t a, std::int32_t b) const { return std::abs(disparity_[a] - disparity_[b]) > threshold_; }

    std::size_t at(std::int32_t x, std::int32_t y) const { return graph_.position(x, y); }

    graph_view graph_;
    array_view<const float> disparity_;
    std::int32_t range_;
    float threshold_;
    std::int32_t cap_x_, cap_y_;
    buffer<std::int32_t> occupants_;
    int cell_shift_;
    std::int32_t cell_columns_;
    buffer<cell> cells_;
    buffer<strip> queue_;
    static constexpr std::int32_t levels = 256;          // of disparity, from 1 down to -0.28
    std::array<buffer<waiting_pixel>, levels> waiting_;  // contested pixels beside the current chart, nearest level first
    std::int32_t nearest_ = levels;                      // first level with a pixel
    std::int32_t current_ = 0, left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
    chart_set result_;
};

}}}  // namespace ldi::detail
