// Charts: flat pieces of a layered image that can lie in one texture (paper, section "Texture Atlas Generation", Chart
// generation). Seed and grow: pixels are visited in order, each one without a chart seeds a new one, which grows breadth-first
// along links under the paper's three constraints:
//   1. no fold: a chart has at most one pixel at a lattice position;
//   2. the bounding box is capped, so that charts pack well;
//   3. where a surface ends, a range of lattice positions across the edge is unusable for the chart, so that texture filtering
//      never mixes two surfaces. Pixels there come to lie in another chart.
#pragma once

#include <ldi/core/error.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ldi {

/// One chart: at most one pixel at each lattice position of its bounding box, connected by links.
struct chart {
    std::int32_t x = 0, y = 0;           ///< top left lattice position of the bounding box
    std::int32_t width = 0, height = 0;  ///< of the bounding box, in pixels
    std::vector<std::int32_t> pixels;    ///< its pixels' indices in the layered image, ascending
};

/// A partition of all pixels into charts.
struct chart_set {
    std::vector<std::int32_t> chart_of;  ///< K: the chart that a pixel belongs to
    std::vector<chart> charts;
};

/// Where a chart lies in the atlas: the texel of the top left lattice position of its bounding box. Pixel i of chart c has the
/// texel (g.x[i] - chart.x + placement.x, g.y[i] - chart.y + placement.y).
struct chart_placement {
    std::int32_t x = 0, y = 0;
};

struct chart_options {
    /// No bounding box is wider or higher than this, in pixels; at least 16. Narrower photos are cut evenly: 1152 pixels at a cap of
    /// 1000 make two charts of 576, not one of 1000 and a rest.
    std::int32_t max_side = 512;
    /// How many lattice positions beyond the end of a surface must not hold another surface of the same chart: the reach of a
    /// texture filter. 1 to 15.
    std::int32_t filter_range = 4;
};

namespace detail {

/// For each pixel and side, how far straight ahead its surface ends, if that is within reach of a texture filter.
class surface_ends {
public:
    surface_ends(const graph& g, std::int32_t range) : distances_(g.size(), 0) {
        for (side s : all_sides) {
            const std::vector<std::int32_t>& ahead = g.neighbours(s);
            const std::vector<std::int32_t>& back = g.neighbours(opposite(s));
            for (std::size_t i = 0; i < ahead.size(); ++i) {
                if (ahead[i] != no_pixel) continue;
                std::int32_t pixel = static_cast<std::int32_t>(i);
                for (std::int32_t distance = 1; distance <= range && pixel != no_pixel; ++distance) {
                    const std::size_t p = static_cast<std::size_t>(pixel);
                    distances_[p] = static_cast<std::uint16_t>(distances_[p] | (distance << shift(s)));
                    pixel = back[p];
                }
            }
        }
    }

    bool any(std::size_t pixel) const { return distances_[pixel] != 0; }
    /// The number of steps to the first position beyond the surface; 0 if it goes on for the whole range.
    std::int32_t distance(std::size_t pixel, side s) const { return (distances_[pixel] >> shift(s)) & 15; }

private:
    static int shift(side s) { return 4 * static_cast<int>(s); }

    std::vector<std::uint16_t> distances_;  // 4 bits a side
};

/// Grows one chart after the other. Lattice positions carry the stamp of the chart that last used or barred them, so that
/// nothing is cleared in between.
class chart_grower {
public:
    chart_grower(const graph& g, const chart_options& options)
        : graph_(g),
          range_(options.filter_range),
          ends_(g, options.filter_range),
          stamps_(static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height), -1),
          chart_of_(g.size(), -1),
          cap_x_(even_share(g.width, options.max_side)),
          cap_y_(even_share(g.height, options.max_side)) {
        result_.charts.reserve(256);
    }

    chart_set grow_all() {
        const std::int32_t count = static_cast<std::int32_t>(graph_.size());
        for (std::int32_t seed = 0; seed < count; ++seed)
            if (chart_of_[static_cast<std::size_t>(seed)] < 0) grow(seed);
        for (std::size_t c = 0; c < sizes_.size(); ++c) result_.charts[c].pixels.reserve(sizes_[c]);
        for (std::int32_t i = 0; i < count; ++i)
            result_.charts[static_cast<std::size_t>(chart_of_[static_cast<std::size_t>(i)])].pixels.push_back(i);
        result_.chart_of = std::move(chart_of_);
        return std::move(result_);
    }

private:
    struct position {
        std::int32_t pixel, x, y;
    };

    static std::int32_t even_share(std::int32_t length, std::int32_t cap) {
        const std::int32_t pieces = std::max((length + cap - 1) / cap, 1);
        return (length + pieces - 1) / pieces;
    }

    void grow(std::int32_t seed) {
        current_ = static_cast<std::int32_t>(result_.charts.size());
        const std::size_t s = static_cast<std::size_t>(seed);
        left_ = right_ = graph_.x[s], top_ = bottom_ = graph_.y[s];
        queue_.clear();
        accept({seed, graph_.x[s], graph_.y[s]});
        for (std::size_t next = 0; next < queue_.size(); ++next) {
            const position p = queue_[next];
            const std::size_t i = static_cast<std::size_t>(p.pixel);
            offer({graph_.up[i], p.x, p.y - 1});
            offer({graph_.down[i], p.x, p.y + 1});
            offer({graph_.left[i], p.x - 1, p.y});
            offer({graph_.right[i], p.x + 1, p.y});
        }
        chart result;
        result.x = left_, result.y = top_, result.width = right_ - left_ + 1, result.height = bottom_ - top_ + 1;
        result_.charts.push_back(std::move(result));
        sizes_.push_back(queue_.size());
    }

    void offer(position p) {
        if (p.pixel == no_pixel || chart_of_[static_cast<std::size_t>(p.pixel)] >= 0) return;
        if (right_ - p.x >= cap_x_ || p.x - left_ >= cap_x_ || bottom_ - p.y >= cap_y_ || p.y - top_ >= cap_y_) return;
        if ((stamps_[at(p.x, p.y)] >> 1) == current_) return;
        if (ends_.any(static_cast<std::size_t>(p.pixel)) && !is_clear_beyond_ends(p)) return;
        accept(p);
    }

    void accept(position p) {
        const std::size_t i = static_cast<std::size_t>(p.pixel);
        chart_of_[i] = current_;
        stamps_[at(p.x, p.y)] = 2 * current_;
        left_ = std::min(left_, p.x), right_ = std::max(right_, p.x);
        top_ = std::min(top_, p.y), bottom_ = std::max(bottom_, p.y);
        if (ends_.any(i))
            for_each_position_beyond_ends(p, [&](std::int32_t& stamp) {
                stamp = 2 * current_ + 1;
                return true;
            });
        queue_.push_back(p);
    }

    bool is_clear_beyond_ends(position p) {
        return for_each_position_beyond_ends(p, [&](const std::int32_t& stamp) { return stamp != 2 * current_; });
    }

    /// Visits the stamps of all positions that are beyond the end of p's surface and within the filter range of p, until `visit`
    /// says false; whether it never did.
    template <class Visit>
    bool for_each_position_beyond_ends(position p, Visit visit) {
        for (side s : all_sides) {
            const std::int32_t first = ends_.distance(static_cast<std::size_t>(p.pixel), s);
            if (first == 0) continue;
            for (std::int32_t distance = first; distance <= range_; ++distance) {
                const std::int32_t x = p.x + distance * step_x(s), y = p.y + distance * step_y(s);
                if (x < 0 || y < 0 || x >= graph_.width || y >= graph_.height) break;
                if (!visit(stamps_[at(x, y)])) return false;
            }
        }
        return true;
    }

    std::size_t at(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(graph_.width) + static_cast<std::size_t>(x);
    }

    const graph& graph_;
    std::int32_t range_;
    surface_ends ends_;
    std::vector<std::int32_t> stamps_;  // 2 c: chart c has a pixel here; 2 c + 1: chart c must not have one
    std::vector<std::int32_t> chart_of_;
    std::int32_t cap_x_, cap_y_;
    std::int32_t current_ = 0, left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
    std::vector<position> queue_;
    std::vector<std::size_t> sizes_;
    chart_set result_;
};

}  // namespace detail

/// Partitions all pixels of a layered image into charts. Raises error_code::invalid_option if an option is outside its range.
inline chart_set make_charts(const graph& g, const chart_options& options = {}) {
    if (options.max_side < 16) raise(error_code::invalid_option, "max_side", "at least 16", std::to_string(options.max_side));
    if (options.filter_range < 1 || options.filter_range > 15)
        raise(error_code::invalid_option, "filter_range", "1 to 15", std::to_string(options.filter_range));
    return detail::chart_grower(g, options).grow_all();
}

}  // namespace ldi
