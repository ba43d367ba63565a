// The layout of a layered image whose surfaces continue past the photo's border (occlusion/past_frame.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/occlusion/detail/border_lines.hpp>
#include <ldi/occlusion/detail/frame_pixels.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Lays out old and new pixels in canonical order, row by row from the top. Each run that reaches the left or the right border
/// continues past this border. Each pixel of the first row continues upward, and each pixel of the last row downward. This
/// includes the new pixels of these rows, so the corners are filled.
class frame_growth {
public:
    /// g       in canonical order, with at least one pixel
    /// reach   reach(pixel) returns the number of steps by which the surface of a border pixel continues, 0 or more
    template <class Reach>
    frame_growth(const graph_view& g, array_view<const std::uint8_t> color, array_view<const std::uint8_t> known,
                 array_view<const float> disparity, Reach&& reach)
        : graph_(g),
          disparity_(disparity),
          runs_(runs_of(g)),
          first_run_(static_cast<std::size_t>(g.height()) + 1),
          left_(g, color, known, runs_, side::right),
          right_(g, color, known, runs_, side::left),
          top_(g, color, known, runs_, side::down),
          bottom_(g, color, known, runs_, side::up) {
        for (const pixel_run& r : runs_) ++first_run_[g.y()[r.first] + 1];
        for (std::size_t y = 1; y < first_run_.size(); ++y) first_run_[y] += first_run_[y - 1];
        for (const pixel_run& r : runs_) {
            if (g.x()[r.first] == 0) left_.pixels.push_back(r.first);
            if (g.x()[r.last - 1] + 1 == g.width()) right_.pixels.push_back(r.last - 1);
            for (std::int32_t i = r.first; g.y()[r.first] == 0 && i < r.last; ++i) top_.pixels.push_back(i);
            for (std::int32_t i = r.first; g.y()[r.first] + 1 == g.height() && i < r.last; ++i) bottom_.pixels.push_back(i);
        }
        for (border_side* b : {&left_, &right_, &top_, &bottom_}) {
            b->slopes = b->lines.slopes(b->pixels);
            for (const std::int32_t pixel : b->pixels) b->reach.push_back(reach(pixel));
            for (const std::int32_t steps : b->reach) margin_ = (std::max)(margin_, steps);
        }
    }

    /// Width of the new lattice's margin on each side.
    std::int32_t margin() const { return margin_; }
    /// Number of old and new pixels.
    std::int64_t count() const {
        std::int64_t total = graph_.count();
        const std::int32_t last = graph_.height() - 1;
        for (const border_side* b : {&left_, &right_, &top_, &bottom_})
            for (std::size_t i = 0; i < b->pixels.size(); ++i) {
                const std::int64_t reach = b->reach[i];
                total += reach;
                if (b != &left_ && b != &right_) continue;
                const std::int32_t y = graph_.y()[b->pixels[i]];  // at a corner of the photo, new pixels fill a square
                total += reach * reach * ((y == 0 ? 1 : 0) + (y == last ? 1 : 0));
            }
        return total;
    }

    /// old  the graph of the constructor
    template <executor Executor>
    grown_pixels run(graph_builder old, Executor& threads) {
        pixels_ = frame_pixels(graph_, margin_);
        const std::int32_t last = graph_.height() - 1;
        left_strips_.resize(left_.pixels.size()), right_strips_.resize(right_.pixels.size());
        buffer<line> lines;
        buffer<std::int32_t> row;
        for (std::int32_t y = 0; y <= last; ++y) {
            find_lines(y, lines);
            buffer<std::int32_t> above;
            if (y == 0) above = add_outer_rows(lines, side::up, {});
            add_row(lines, y, row);
            for (std::int32_t c = 0; c < above.count(); ++c)
                if (above[c] != no_pixel) pixels_.link(above[c], side::down, row[c]);
            if (y == last) add_outer_rows(lines, side::down, std::move(row));
        }
        for (const border_side* b : {&left_, &right_, &top_, &bottom_})
            for (const std::int32_t pixel : b->pixels) repaint_rim(*b, pixel);
        return pixels_.finish(std::move(old), threads);
    }

    /// An old pixel, and the pixel whose color it gets.
    struct repainted_pixel {
        std::int32_t pixel, source;
    };
    /// Returns the pixels of rims, in the order in which the caller must repaint them.
    const buffer<repainted_pixel>& repainted() const { return repainted_; }
    /// Returns the pixels that run() added.
    const frame_pixels& pixels() const { return pixels_; }

private:
    /// A run of old pixels, and the lengths of its continuations to the left and to the right.
    struct line {
        std::int32_t first, last, left, right;
    };
    /// A column of `reach` new pixels above or below the photo. It continues an old or a new pixel of the photo's first or last
    /// row. `source` is that pixel if it is old, else the old pixel whose color that pixel repeats. `border` is the border
    /// pixel whose disparity the column gets.
    struct column {
        std::int32_t x, border, source, reach;
        float slope;
        bool follows;  ///< whether it is linked to the previous column
    };
    /// The new pixels beside a border pixel, in its row.
    struct strip {
        std::int32_t nearest = 0, count = 0;  ///< nearest: the pixel next to the border pixel
    };

    std::int32_t left_of(const pixel_run& r) const { return graph_.x()[r.first] == 0 ? left_.reach[left_.find(r.first)] : 0; }
    std::int32_t right_of(const pixel_run& r) const {
        return graph_.x()[r.last - 1] + 1 == graph_.width() ? right_.reach[right_.find(r.last - 1)] : 0;
    }

    /// Whether the run that begins at `x` precedes the run that begins at `other_x` in canonical order. The first pixels of the
    /// runs have the disparities of `pixel` and `other`.
    bool is_before(std::int32_t x, std::int32_t pixel, std::int32_t other_x, std::int32_t other) const {
        return run_precedes(x, pixel, other_x, other, [this](std::int32_t border) { return disparity_[border]; });
    }

    /// Sets `lines` to the runs of row y, in the canonical order of the continued runs.
    void find_lines(std::int32_t y, buffer<line>& lines) const {
        lines.clear();
        for (std::size_t r = first_run_[y]; r < first_run_[static_cast<std::size_t>(y) + 1]; ++r)
            lines.push_back({runs_[r].first, runs_[r].last - 1, left_of(runs_[r]), right_of(runs_[r])});
        std::sort(lines.begin(), lines.end(), [&](const line& a, const line& b) {
            return is_before(graph_.x()[a.first] - a.left, a.first, graph_.x()[b.first] - b.left, b.first);
        });
    }

    /// Lists the rim's pixels from a border pixel inward, with the pixels whose colors they get.
    void repaint_rim(const border_side& b, std::int32_t pixel) {
        path_.clear();
        for (std::int32_t k = b.add_path(pixel, 0, path_); k-- > 0;) {
            repainted_.push_back({pixel, path_[k]});
            pixel = graph_.neighbor(pixel, b.inward);
        }
    }

    /// Adds row y. Sets `row` to the pixels of the row; in rows between the first and the last, to the new pixels only.
    void add_row(const buffer<line>& lines, std::int32_t y, buffer<std::int32_t>& row) {
        row.clear();
        for (const line& l : lines) {
            left_.find_shown(l.first, l.left, shown_left_), right_.find_shown(l.last, l.right, shown_right_);
            pixels_.add_piece(l.left);
            for (std::int32_t k = l.left; k > 0; --k) row.push_back(pixels_.add_new(-k, y, l.first, shown_left_[k - 1]));
            if (l.left > 0) link_strip(l.first, {row.back(), l.left}, -1, left_, left_strips_);
            pixels_.add_old(l.first, l.last);
            if (y == 0 || y + 1 == graph_.height())
                for (std::int32_t i = l.first; i <= l.last; ++i) row.push_back(i);
            pixels_.add_piece(l.right);
            for (std::int32_t k = 1; k <= l.right; ++k)
                row.push_back(pixels_.add_new(graph_.width() - 1 + k, y, l.last, shown_right_[k - 1]));
            if (l.right > 0) link_strip(l.last, {row.back() - l.right + 1, l.right}, 1, right_, right_strips_);
        }
    }

    /// Stores a border pixel's strip in `strips`, and links it to the border pixel, and to the strip of the border pixel above,
    /// as far as both strips reach.
    ///
    /// step    difference in index to the next pixel outward: -1 or 1
    /// from    the side of the border pixel
    /// strips  the strips of this side's border pixels
    void link_strip(std::int32_t border, strip s, std::int32_t step, const border_side& from, buffer<strip>& strips) {
        strips[from.find(border)] = s;
        pixels_.link(border, step < 0 ? side::left : side::right, s.nearest);
        const std::int32_t above = graph_.up()[border];
        if (above == no_pixel) return;
        const strip other = strips[from.find(above)];
        for (std::int32_t k = 0; k < (std::min)(s.count, other.count); ++k)
            pixels_.link(other.nearest + k * step, side::down, s.nearest + k * step);
    }

    /// Adds the rows of new pixels above the photo, or those below it.
    ///
    /// beside  for rows below: the pixel that each column continues; empty for rows above
    ///
    /// For rows above, returns each column's pixel next to the photo, or no_pixel for a column without new pixels.
    buffer<std::int32_t> add_outer_rows(const buffer<line>& lines, side outward, buffer<std::int32_t> beside) {
        const border_side& from = outward == side::up ? top_ : bottom_;
        const buffer<column> columns = columns_of(lines, from);
        // paths: the pixels that each column shows, outward from the photo. start: per column, the index of its first pixel in
        // `paths`
        buffer<std::int32_t> paths, start;
        std::int32_t longest = 0;
        for (const column& c : columns) {
            const std::int32_t begin = paths.count();
            start.push_back(begin + from.lines.add_path(c.source, c.reach, c.slope, paths));
            longest = (std::max)(longest, c.reach);
        }
        beside.resize(columns.size(), no_pixel);
        buffer<std::int32_t> row(columns.size(), unset);
        buffer<std::pair<std::int32_t, std::int32_t>> runs;
        for (std::int32_t n = 1; n <= longest; ++n) {
            const std::int32_t distance = outward == side::up ? longest + 1 - n : n;
            const std::int32_t y = outward == side::up ? -distance : graph_.height() - 1 + distance;
            std::fill(row.begin(), row.end(), no_pixel);
            find_runs(distance, columns, runs);
            for (const auto& [first, last] : runs) {
                pixels_.add_piece(last - first);
                for (std::int32_t c = first; c < last; ++c)
                    row[c] = pixels_.add_new(columns[c].x, y, columns[c].border, paths[start[c] + distance - 1]);
            }
            for (std::int32_t c = 0; c < columns.count(); ++c)
                if (beside[c] != no_pixel && row[c] != no_pixel) pixels_.link(beside[c], side::down, row[c]);
            std::swap(beside, row);
        }
        return beside;
    }

    /// Sets `runs` to the runs of columns that reach the given distance from the photo, in canonical order. Each pair contains
    /// the first column of a run and the column after its last one.
    void find_runs(std::int32_t distance, const buffer<column>& columns,
                   buffer<std::pair<std::int32_t, std::int32_t>>& runs) const {
        const auto is_there = [&](std::int32_t c) { return columns[c].reach >= distance; };
        runs.clear();
        for (std::int32_t c = 0; c < columns.count(); ++c) {
            if (!is_there(c)) continue;
            if (c > 0 && columns[c].follows && is_there(c - 1))
                ++runs.back().second;
            else
                runs.emplace_back(c, c + 1);
        }
        std::sort(runs.begin(), runs.end(), [&](const auto& a, const auto& b) {
            return is_before(columns[a.first].x, columns[a.first].border, columns[b.first].x, columns[b.first].border);
        });
    }

    /// Returns a column for each pixel of a row and of its continuation.
    buffer<column> columns_of(const buffer<line>& lines, const border_side& from) {
        buffer<column> columns;
        for (const line& l : lines) {
            const std::size_t first = columns.size();
            const auto add = [&](std::int32_t x, std::int32_t pixel, std::int32_t source) {
                const std::size_t i = from.find(pixel);
                columns.push_back({x, pixel, source, from.reach[i], from.slopes[i], columns.size() > first});
            };
            left_.find_shown(l.first, l.left, shown_left_), right_.find_shown(l.last, l.right, shown_right_);
            for (std::int32_t k = l.left; k > 0; --k) add(-k, l.first, shown_left_[k - 1]);
            for (std::int32_t i = l.first; i <= l.last; ++i) add(graph_.x()[i], i, i);
            for (std::int32_t k = 1; k <= l.right; ++k) add(graph_.width() - 1 + k, l.last, shown_right_[k - 1]);
        }
        return columns;
    }

    graph_view graph_;
    array_view<const float> disparity_;
    std::int32_t margin_ = 0;
    buffer<pixel_run> runs_;
    buffer<std::size_t> first_run_;  // index of each row's first run
    border_side left_, right_, top_, bottom_;
    buffer<strip> left_strips_, right_strips_;  // per border pixel; without new pixels, count is 0
    frame_pixels pixels_;
    buffer<repainted_pixel> repainted_;
    buffer<std::int32_t> shown_left_, shown_right_, path_;  // reused for every row
};

}}}  // namespace ldi::detail
