// Pixels added behind a single layer while it grows. Storage is separate from the layer, so that the cost of growth depends
// only on the number of new pixels. At the end, one pass merges both into canonical order.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/occlusion/detail/merged_pixels.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

// Pixels of a base layer, and hidden pixels behind them. Indices below K are pixels of the base: pixel (x, y) has index y * width
// + x. Hidden pixels follow in the order in which they were added.
class hidden_pixels {
public:
    /// base       one layer in the order of the photo; growth adds links to its pixels
    /// disparity  disparities of the base; must outlive all calls except write_disparity()
    hidden_pixels(graph_builder base, array_view<const float> disparity)
        : base_(std::move(base)),
          base_disparity_(disparity),
          base_count_(base_.count()),
          newest_(base_.size(), no_pixel),
          hidden_(base_.width(), base_.height()) {
        LDI_ASSERT(base_.size() == base_.position_count());
    }

    std::int32_t width() const { return base_.width(); }
    std::int32_t height() const { return base_.height(); }
    std::int32_t hidden_count() const { return hidden_.count(); }
    bool inside(std::int32_t x, std::int32_t y) const { return x >= 0 && y >= 0 && x < base_.width() && y < base_.height(); }
    /// Index of the visible pixel at (x, y). From this pixel, repeated calls of next_at_position() visit the hidden pixels at
    /// the position, the newest first.
    std::int32_t position(std::int32_t x, std::int32_t y) const { return y * base_.width() + x; }
    std::int32_t next_at_position(std::int32_t pixel) const {
        return is_base(pixel) ? newest_[pixel] : older_[hidden_index(pixel)];
    }

    std::int32_t x(std::int32_t pixel) const { return is_base(pixel) ? base_.x()[pixel] : hidden_.x()[hidden_index(pixel)]; }
    std::int32_t y(std::int32_t pixel) const { return is_base(pixel) ? base_.y()[pixel] : hidden_.y()[hidden_index(pixel)]; }
    float disparity(std::int32_t pixel) const {
        return is_base(pixel) ? base_disparity_[pixel] : hidden_disparity_[hidden_index(pixel)];
    }
    std::int32_t neighbor(std::int32_t pixel, side s) const {
        return is_base(pixel) ? base_.neighbors(s)[pixel] : hidden_.neighbors(s)[hidden_index(pixel)];
    }

    /// Returns the visible pixel from which this pixel grew; for a visible pixel, the pixel itself.
    std::int32_t origin(std::int32_t pixel) const { return is_base(pixel) ? pixel : origin_[hidden_index(pixel)]; }

    /// Adds a hidden pixel.
    ///
    /// origin  the visible pixel whose surface the new pixel continues
    std::int32_t add(std::int32_t position, float disparity, std::int32_t origin) {
        const std::int32_t pixel = base_count_ + hidden_.add_pixel(base_.x()[position], base_.y()[position]);
        origin_.push_back(origin);
        hidden_disparity_.push_back(disparity);
        older_.push_back(std::exchange(newest_[position], pixel));
        return pixel;
    }

    void set_origin(std::int32_t pixel, std::int32_t origin) { origin_[hidden_index(pixel)] = origin; }

    void link(std::int32_t a, side s, std::int32_t b) {
        set_neighbor(a, s, b);
        set_neighbor(b, opposite(s), a);
    }

    /// Calls see(graph, disparity, K) with all pixels so far, base pixels first.
    template <class See>
    void show(See&& see) const {
        graph_builder all(base_.width(), base_.height(), base_.size() + hidden_.size(), unset);
        for (std::int32_t i = 0; i < all.count(); ++i) {
            all.set_position(i, x(i), y(i));
            for (const side s : all_sides) all.set_neighbor(i, s, neighbor(i, s));
        }
        buffer<float> disparity(base_disparity_.begin(), base_disparity_.end());
        disparity.append(hidden_disparity_.begin(), hidden_disparity_.end());
        const graph topology = std::move(all).build(unchecked);
        see(graph_view(topology), std::span<const float>(disparity), base_.size());
    }

    /// Merges all pixels into canonical order. Releases memory as early as possible, because the memory of make_photo3d() peaks
    /// here. Only write_disparity() may follow.
    template <executor Executor>
    grown_pixels merge(Executor& threads) {
        newest_ = {}, older_ = {};
        grown_pixels result;
        result.pieces = order();
        const buffer<std::int32_t> index = merged_indices(result.pieces, base_count_, hidden_.count(), threads);
        result.topology = merged_graph(std::move(base_), hidden_, result.pieces, index, 0, threads);
        result.origins = std::move(origin_);
        base_ = graph_builder(0, 0), hidden_ = graph_builder(0, 0);
        return result;
    }

    /// Sets the disparities of the hidden pixels, in the canonical order of merge().
    void write_disparity(array_view<float> disparity, std::span<const grown_piece> pieces) const {
        std::int32_t to = 0;
        for (const grown_piece& p : pieces) {
            if (p.is_new) std::copy_n(hidden_disparity_.begin() + p.first, p.count, disparity.begin() + to);
            to += p.count;
        }
    }

private:
    bool is_base(std::int32_t pixel) const { return pixel < base_count_; }
    std::int32_t hidden_index(std::int32_t pixel) const { return pixel - base_count_; }
    void set_neighbor(std::int32_t pixel, side s, std::int32_t neighbor) {
        is_base(pixel) ? base_.set_neighbor(pixel, s, neighbor) : hidden_.set_neighbor(hidden_index(pixel), s, neighbor);
    }

    // Returns all pixels in canonical order (core/canonical_order.hpp), as a list of pieces.
    buffer<grown_piece> order() const {
        buffer<std::size_t> hidden_start(static_cast<std::size_t>(base_.height()) + 1,
                                         0);  // per row: number of hidden pixels that start a run, then index in hidden_starts
        for (std::int32_t i = 0; i < hidden_.count(); ++i)
            if (hidden_.left()[i] == no_pixel) ++hidden_start[hidden_.y()[i] + 1];
        for (std::int32_t y = 0; y < base_.height(); ++y) hidden_start[y + 1] += hidden_start[y];
        buffer<std::int32_t> hidden_starts(hidden_start.back());
        buffer<std::size_t> next(hidden_start.begin(), hidden_start.end() - 1);
        for (std::int32_t i = 0; i < hidden_.count(); ++i)
            if (hidden_.left()[i] == no_pixel) hidden_starts[next[hidden_.y()[i]]++] = base_count_ + i;

        const auto before = [this](std::int32_t a, std::int32_t b) {
            return run_precedes(x(a), a, x(b), b, [this](std::int32_t pixel) { return disparity(pixel); });
        };
        buffer<grown_piece> pieces;
        buffer<std::int32_t> starts;
        buffer<std::int32_t> last_in_row(static_cast<std::size_t>(base_.width()));  // set for the first of adjacent base pixels
        for (std::int32_t row = 0; row < base_.height(); ++row) {
            starts.clear();
            const std::int32_t first = row * base_.width();
            for (std::int32_t i = first, last; i < first + base_.width(); i = last + 1) {
                last = last_in_row[i - first] = last_of_run(base_.right().data(), i, first + base_.width() - 1);
                if (base_.left()[i] == no_pixel) starts.push_back(i);
            }
            const bool mixed = hidden_start[row] != hidden_start[row + 1];
            starts.insert(starts.end(), hidden_starts.begin() + hidden_start[row], hidden_starts.begin() + hidden_start[row + 1]);
            if (mixed) std::sort(starts.begin(), starts.end(), before);
            for (std::int32_t start : starts)
                for (std::int32_t i = start; i != no_pixel;) {
                    const std::int32_t last = is_base(i) ? last_in_row[i - first] : i;
                    pieces.push_back({is_base(i) ? i : hidden_index(i), last - i + 1, !is_base(i)});
                    i = neighbor(last, side::right);
                }
        }
        return pieces;
    }

    graph_builder base_;
    array_view<const float> base_disparity_;
    std::int32_t base_count_;
    buffer<std::int32_t> newest_;  // last hidden pixel added at each position, or no_pixel
    buffer<std::int32_t> older_;   // per hidden pixel: the hidden pixel added before it at its position
    graph_builder hidden_;         // links lead to base and hidden pixels; build() is not called
    buffer<float> hidden_disparity_;
    buffer<std::int32_t> origin_;  // per hidden pixel: the pixel of the photo whose surface it continues
};

}}}  // namespace ldi::detail
