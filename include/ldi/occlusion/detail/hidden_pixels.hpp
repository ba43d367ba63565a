// Pixels added behind a single layer while it grows. They are kept apart from the layer until the end, so that a growing image
// costs nothing but its new pixels; then both are merged into canonical order in one pass.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION::detail {

// Indices below K are the base layer's, pixel (x, y) at y * width + x; hidden pixels follow in the order in which they were
// added.
class hidden_pixels {
public:
    hidden_pixels(graph& base, const buffer<float>& disparity)
        : base_(base), base_disparity_(disparity), base_count_(base.count()), newest_(base.size(), no_pixel) {
        LDI_ASSERT(base.size() == base.position_count());
        hidden_.width = base.width, hidden_.height = base.height;
    }

    bool inside(std::int32_t x, std::int32_t y) const { return x >= 0 && y >= 0 && x < base_.width && y < base_.height; }
    /// The index of the visible pixel at (x, y), with which a walk over all pixels there begins.
    std::int32_t position(std::int32_t x, std::int32_t y) const { return y * base_.width + x; }
    std::int32_t next_at_position(std::int32_t pixel) const {
        return is_base(pixel) ? newest_[pixel] : older_[hidden_index(pixel)];
    }

    std::int32_t x(std::int32_t pixel) const { return is_base(pixel) ? base_.x[pixel] : hidden_.x[hidden_index(pixel)]; }
    std::int32_t y(std::int32_t pixel) const { return is_base(pixel) ? base_.y[pixel] : hidden_.y[hidden_index(pixel)]; }
    float disparity(std::int32_t pixel) const {
        return is_base(pixel) ? base_disparity_[pixel] : hidden_disparity_[hidden_index(pixel)];
    }
    std::int32_t neighbor(std::int32_t pixel, side s) const {
        return is_base(pixel) ? base_.neighbors(s)[pixel] : hidden_.neighbors(s)[hidden_index(pixel)];
    }

    /// The visible pixel from which growth led to this one; of a visible pixel, itself.
    std::int32_t origin(std::int32_t pixel) const { return is_base(pixel) ? pixel : origin_[hidden_index(pixel)]; }

    /// origin  of the new pixel
    std::int32_t add(std::int32_t position, float disparity, std::int32_t origin) {
        const std::int32_t pixel = base_count_ + hidden_.add_pixel(base_.x[position], base_.y[position]);
        origin_.push_back(origin);
        hidden_disparity_.push_back(disparity);
        older_.push_back(std::exchange(newest_[position], pixel));
        return pixel;
    }

    void link(std::int32_t a, side s, std::int32_t b) {
        slot(a, s) = b;
        slot(b, opposite(s)) = a;
    }

    /// Calls see(graph, disparity, K) with everything so far, base pixels first.
    template <class See>
    void show(See&& see) const {
        graph all = base_;
        const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
        append(all.x, hidden_.x), append(all.y, hidden_.y);
        for (side s : all_sides) append(all.neighbors(s), hidden_.neighbors(s));
        buffer<float> disparity = base_disparity_;
        append(disparity, hidden_disparity_);
        see(std::as_const(all), std::span<const float>(disparity), base_.size());
    }

    /// base  the image whose graph this was made from
    ///
    /// The base layer's image with the hidden pixels among its own, in canonical order.
    template <class... Columns>
    layered_image<Columns...> merge_into(const layered_image<Columns...>& base) const {
        const buffer<piece> pieces = order();
        buffer<std::int32_t> new_index(base_.size() + hidden_.size());
        for (const piece& p : pieces)
            for (std::int32_t i = 0; i < p.count; ++i) new_index[p.old_first + i] = p.new_first + i;

        layered_image<Columns...> merged;
        merged.surface = base.surface, merged.camera = base.camera, merged.range = base.range;
        graph& g = merged.topology;
        g.width = base_.width, g.height = base_.height;
        g.resize(new_index.size());
        merged.resize_columns(new_index.size());
        for (const piece& p : pieces) {
            const std::int32_t to = p.new_first, count = p.count;
            const bool from_base = is_base(p.old_first);
            const graph& source = from_base ? base_ : hidden_;
            const std::int32_t from = from_base ? p.old_first : hidden_index(p.old_first);
            const auto moved = [&](std::int32_t pixel) { return pixel == no_pixel ? no_pixel : new_index[pixel]; };
            std::iota(g.x.data() + to, g.x.data() + to + count, source.x[from]);
            std::fill_n(g.y.data() + to, count, source.y[from]);
            std::iota(g.left.data() + to, g.left.data() + to + count, p.new_first - 1);
            std::iota(g.right.data() + to, g.right.data() + to + count, p.new_first + 1);
            g.left[to] = moved(source.left[from]);
            g.right[to + count - 1] = moved(source.right[from + count - 1]);
            for (side s : {side::up, side::down})
                std::transform(source.neighbors(s).data() + from, source.neighbors(s).data() + from + count,
                               g.neighbors(s).data() + to, moved);
            if (from_base)
                (std::copy(base.template at<Columns>(from).data(), end_of<Columns>(base, from + count - 1),
                           merged.template at<Columns>(to).data()),
                 ...);
            else
                (fill_hidden<Columns>(merged, to, base, from), ...);
        }
        return merged;
    }

private:
    // Pixels with successive indices that stay side by side: a part of a run.
    struct piece {
        std::int32_t old_first, new_first, count;
    };

    bool is_base(std::int32_t pixel) const { return pixel < base_count_; }
    std::int32_t hidden_index(std::int32_t pixel) const { return pixel - base_count_; }
    std::int32_t& slot(std::int32_t pixel, side s) {
        return is_base(pixel) ? base_.neighbors(s)[pixel] : hidden_.neighbors(s)[hidden_index(pixel)];
    }

    template <class Column, class Layers>
    static const typename Column::scalar* end_of(const Layers& layers, std::int32_t pixel) {
        return layers.template at<Column>(pixel).data() + Column::channels;
    }

    // Sets a column at pixel `to` of the new image, which is hidden pixel `from`.
    template <class Column, class Layers>
    void fill_hidden(Layers& merged, std::int32_t to, const Layers& base, std::int32_t from) const {
        if constexpr (std::is_same_v<Column, disparity_column>) {
            merged.template column<Column>()[to] = hidden_disparity_[from];
        } else if constexpr (at_new_pixels<Column>() == new_pixels::copy) {
            const auto source = base.template at<Column>(origin_[from]);
            std::copy(source.begin(), source.end(), merged.template at<Column>(to).begin());
        }
    }

    // All pixels in canonical order (core/canonical_order.hpp), in pieces.
    buffer<piece> order() const {
        buffer<std::size_t> hidden_start(static_cast<std::size_t>(base_.height) + 1,
                                         0);  // hidden pixels that start a run, filed by row
        for (std::int32_t i = 0; i < hidden_.count(); ++i)
            if (hidden_.left[i] == no_pixel) ++hidden_start[hidden_.y[i] + 1];
        for (std::int32_t y = 0; y < base_.height; ++y) hidden_start[y + 1] += hidden_start[y];
        buffer<std::int32_t> hidden_starts(hidden_start.back());
        buffer<std::size_t> next(hidden_start.begin(), hidden_start.end() - 1);
        for (std::int32_t i = 0; i < hidden_.count(); ++i)
            if (hidden_.left[i] == no_pixel) hidden_starts[next[hidden_.y[i]]++] = base_count_ + i;

        const auto before = [this](std::int32_t a, std::int32_t b) {
            if (x(a) != x(b)) return x(a) < x(b);
            if (disparity(a) != disparity(b)) return disparity(a) > disparity(b);
            return a < b;
        };
        buffer<piece> pieces;
        buffer<std::int32_t> starts;
        std::int32_t placed = 0;
        for (std::int32_t row = 0; row < base_.height; ++row) {
            starts.clear();
            const std::int32_t first = row * base_.width;
            for (std::int32_t i = first; i < first + base_.width; ++i)
                if (base_.left[i] == no_pixel) starts.push_back(i);
            const bool mixed = hidden_start[row] != hidden_start[row + 1];
            starts.insert(starts.end(), hidden_starts.begin() + hidden_start[row], hidden_starts.begin() + hidden_start[row + 1]);
            if (mixed) std::sort(starts.begin(), starts.end(), before);
            for (std::int32_t start : starts)
                for (std::int32_t i = start; i != no_pixel;) {
                    std::int32_t last = i;
                    while (is_base(i) && base_.right[last] == last + 1 && last + 1 < base_count_) ++last;
                    pieces.push_back({i, placed, last - i + 1});
                    placed += last - i + 1;
                    i = neighbor(last, side::right);
                }
        }
        return pieces;
    }

    graph& base_;
    const buffer<float>& base_disparity_;
    std::int32_t base_count_;
    buffer<std::int32_t> newest_;  // the last hidden pixel added at each position, or no_pixel
    buffer<std::int32_t> older_;   // the one added there before
    graph hidden_;
    buffer<float> hidden_disparity_;
    buffer<std::int32_t> origin_;  // the pixel of the photo whose surface each hidden pixel continues
};

}  // namespace ldi::detail
