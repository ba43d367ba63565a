// Pixels added behind a single layer while it grows. They are kept apart from the layer until the end, so that a growing image
// costs nothing but its new pixels; then both are merged into canonical order in one pass.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi::detail {

// Indices below K are the base layer's, pixel (x, y) at y * width + x; hidden pixels follow in the order in which they were
// added.
class hidden_pixels {
public:
    hidden_pixels(graph& base, std::span<const float> disparity)
        : base_(base),
          base_disparity_(disparity),
          base_count_(static_cast<std::int32_t>(base.size())),
          newest_(base.size(), no_pixel) {
        LDI_ASSERT(base.size() == static_cast<std::size_t>(base.width) * static_cast<std::size_t>(base.height));
        hidden_.width = base.width, hidden_.height = base.height;
    }

    bool inside(std::int32_t x, std::int32_t y) const { return x >= 0 && y >= 0 && x < base_.width && y < base_.height; }
    /// The index of the visible pixel at (x, y), with which a walk over all pixels there begins.
    std::int32_t position(std::int32_t x, std::int32_t y) const { return y * base_.width + x; }
    std::int32_t next_at_position(std::int32_t pixel) const {
        return is_base(pixel) ? newest_[index(pixel)] : older_[hidden_index(pixel)];
    }

    std::int32_t x(std::int32_t pixel) const { return is_base(pixel) ? base_.x[index(pixel)] : hidden_.x[hidden_index(pixel)]; }
    std::int32_t y(std::int32_t pixel) const { return is_base(pixel) ? base_.y[index(pixel)] : hidden_.y[hidden_index(pixel)]; }
    float disparity(std::int32_t pixel) const {
        return is_base(pixel) ? base_disparity_[index(pixel)] : hidden_disparity_[hidden_index(pixel)];
    }
    std::int32_t neighbor(std::int32_t pixel, side s) const {
        return is_base(pixel) ? base_.neighbors(s)[index(pixel)] : hidden_.neighbors(s)[hidden_index(pixel)];
    }

    /// source  the pixel that the new one grew from
    std::int32_t add(std::int32_t position, float disparity, std::int32_t source) {
        const std::int32_t pixel = base_count_ + hidden_.add_pixel(base_.x[position], base_.y[position]);
        origin_.push_back(is_base(source) ? source : origin_[hidden_index(source)]);
        hidden_disparity_.push_back(disparity);
        older_.push_back(std::exchange(newest_[index(position)], pixel));
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
        buffer<float> disparity(base_disparity_.begin(), base_disparity_.end());
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
            for (std::int32_t i = 0; i < p.count; ++i) new_index[index(p.old_first + i)] = p.new_first + i;

        layered_image<Columns...> merged;
        merged.surface = base.surface, merged.camera = base.camera, merged.range = base.range;
        graph& g = merged.topology;
        g.width = base_.width, g.height = base_.height;
        g.resize(new_index.size());
        merged.resize_columns(new_index.size());
        for (const piece& p : pieces) {
            const std::size_t to = index(p.new_first), count = index(p.count);
            const bool from_base = is_base(p.old_first);
            const graph& source = from_base ? base_ : hidden_;
            const std::size_t from = from_base ? index(p.old_first) : hidden_index(p.old_first);
            const auto moved = [&](std::int32_t pixel) { return pixel == no_pixel ? no_pixel : new_index[index(pixel)]; };
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
                (std::copy_n(base.template column<Columns>().begin() + static_cast<std::ptrdiff_t>(from * Columns::channels),
                             count * Columns::channels,
                             merged.template column<Columns>().begin() + static_cast<std::ptrdiff_t>(to * Columns::channels)),
                 ...);
            else
                (fill_hidden<Columns>(merged.template column<Columns>(), to, base.template column<Columns>(), from), ...);
        }
        return merged;
    }

private:
    // Pixels with successive indices that stay side by side: a part of a run.
    struct piece {
        std::int32_t old_first, new_first, count;
    };

    static std::size_t index(std::int32_t pixel) { return static_cast<std::size_t>(pixel); }
    bool is_base(std::int32_t pixel) const { return pixel < base_count_; }
    std::size_t hidden_index(std::int32_t pixel) const { return static_cast<std::size_t>(pixel - base_count_); }
    std::int32_t& slot(std::int32_t pixel, side s) {
        return is_base(pixel) ? base_.neighbors(s)[index(pixel)] : hidden_.neighbors(s)[hidden_index(pixel)];
    }

    // Pixel `to` of a new column, which is hidden pixel `from`.
    template <class Column>
    void fill_hidden(buffer<typename Column::scalar>& column, std::size_t to, const buffer<typename Column::scalar>& of_base,
                     std::size_t from) const {
        if constexpr (std::is_same_v<Column, disparity_column>)
            column[to] = hidden_disparity_[from];
        else if constexpr (at_new_pixels<Column>() == new_pixels::copy)
            for (std::size_t c = 0; c < Column::channels; ++c)
                column[to * Column::channels + c] = of_base[index(origin_[from]) * Column::channels + c];
    }

    // All pixels in canonical order (core/canonical_order.hpp), in pieces.
    buffer<piece> order() const {
        const std::size_t rows = static_cast<std::size_t>(base_.height);
        buffer<std::size_t> hidden_start(rows + 1, 0);  // hidden pixels that start a run, filed by row
        for (std::size_t i = 0; i < hidden_.size(); ++i)
            if (hidden_.left[i] == no_pixel) ++hidden_start[index(hidden_.y[i]) + 1];
        for (std::size_t y = 0; y < rows; ++y) hidden_start[y + 1] += hidden_start[y];
        buffer<std::int32_t> hidden_starts(hidden_start[rows]);
        buffer<std::size_t> next(hidden_start.begin(), hidden_start.end() - 1);
        for (std::size_t i = 0; i < hidden_.size(); ++i)
            if (hidden_.left[i] == no_pixel)
                hidden_starts[next[index(hidden_.y[i])]++] = base_count_ + static_cast<std::int32_t>(i);

        const auto before = [this](std::int32_t a, std::int32_t b) {
            if (x(a) != x(b)) return x(a) < x(b);
            if (disparity(a) != disparity(b)) return disparity(a) > disparity(b);
            return a < b;
        };
        buffer<piece> pieces;
        buffer<std::int32_t> starts;
        std::int32_t placed = 0;
        for (std::size_t row = 0; row < rows; ++row) {
            starts.clear();
            const std::int32_t first = static_cast<std::int32_t>(row) * base_.width;
            for (std::int32_t i = first; i < first + base_.width; ++i)
                if (base_.left[index(i)] == no_pixel) starts.push_back(i);
            const bool mixed = hidden_start[row] != hidden_start[row + 1];
            starts.insert(starts.end(), hidden_starts.begin() + static_cast<std::ptrdiff_t>(hidden_start[row]),
                          hidden_starts.begin() + static_cast<std::ptrdiff_t>(hidden_start[row + 1]));
            if (mixed) std::sort(starts.begin(), starts.end(), before);
            for (std::int32_t start : starts)
                for (std::int32_t i = start; i != no_pixel;) {
                    std::int32_t last = i;
                    while (is_base(i) && base_.right[index(last)] == last + 1 && last + 1 < base_count_) ++last;
                    pieces.push_back({i, placed, last - i + 1});
                    placed += last - i + 1;
                    i = neighbor(last, side::right);
                }
        }
        return pieces;
    }

    graph& base_;
    std::span<const float> base_disparity_;
    std::int32_t base_count_;
    buffer<std::int32_t> newest_;  // the last hidden pixel added at each position, or no_pixel
    buffer<std::int32_t> older_;   // the one added there before
    graph hidden_;
    buffer<float> hidden_disparity_;
    buffer<std::int32_t> origin_;  // the pixel of the photo whose surface each hidden pixel continues
};

}  // namespace ldi::detail
