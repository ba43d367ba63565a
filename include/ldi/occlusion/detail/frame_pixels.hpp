// The pixels of a layered image that continues past the photo's border, appended in canonical order (occlusion/past_frame.hpp).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class frame_pixels {
public:
    frame_pixels() = default;
    /// old     graph of the layered image before its continuation
    /// margin  width of the new lattice's margin on each side
    /// count   number of old and new pixels
    frame_pixels(const graph_view& old, std::int32_t margin, std::size_t count)
        : old_(old),
          margin_(margin),
          new_index_(old.size(), unset),
          result_(old.width() + 2 * margin, old.height() + 2 * margin, count, unset) {}

    /// New index of the next pixel.
    std::int32_t next() const { return next_; }

    /// Starts a contiguous range of `count` new pixels.
    void add_piece(std::int32_t count) {
        if (count > 0) pieces_.push_back({origins_.count(), count, true});
    }
    /// Adds a new pixel at (x, y), relative to the photo's top left pixel.
    ///
    /// border  border pixel whose surface the new pixel continues
    /// source  old pixel from which the new pixel takes its color
    void add_new(std::int32_t x, std::int32_t y, std::int32_t border, std::int32_t source) {
        origins_.push_back(source), borders_.push_back(border);
        place(x, y);
    }
    /// Adds the old pixels from `first` to `last`, which are one run of row `y`.
    void add_old(std::int32_t first, std::int32_t last, std::int32_t y) {
        pieces_.push_back({first, last - first + 1, false});
        for (std::int32_t i = first; i <= last; ++i) {
            new_index_[i] = next_;
            place(old_.x()[i], y);
        }
    }
    /// Links all pixels from `begin` on as one run.
    void link_row(std::int32_t begin) {
        for (std::int32_t i = begin; i < next_; ++i)
            result_.set_neighbor(i, side::left, i - 1), result_.set_neighbor(i, side::right, i + 1);
        result_.set_neighbor(begin, side::left, no_pixel), result_.set_neighbor(next_ - 1, side::right, no_pixel);
    }
    void link_down(std::int32_t upper, std::int32_t lower) {
        result_.set_neighbor(upper, side::down, lower), result_.set_neighbor(lower, side::up, upper);
    }

    /// Restores the vertical links between old pixels and returns the result. Call it after all pixels have been added.
    grown_pixels finish() {
        LDI_ASSERT(next_ == result_.count());
        for (const side s : {side::up, side::down}) {
            const array_view<const std::int32_t> from = old_.neighbors(s);
            for (std::int32_t i = 0; i < old_.count(); ++i)
                if (from[i] != no_pixel) result_.set_neighbor(new_index_[i], s, new_index_[from[i]]);
        }
        return {std::move(result_).build(unchecked), std::move(pieces_), origins_};
    }

    /// Returns the new index of each old pixel.
    const buffer<std::int32_t>& new_index() const { return new_index_; }
    /// For each new pixel: origins() contains the old pixel from which it takes its color, borders() the border pixel whose
    /// surface it continues.
    const buffer<std::int32_t>& origins() const { return origins_; }
    const buffer<std::int32_t>& borders() const { return borders_; }

private:
    void place(std::int32_t x, std::int32_t y) {
        result_.set_position(next_, x + margin_, y + margin_);
        result_.set_neighbor(next_, side::up, no_pixel), result_.set_neighbor(next_, side::down, no_pixel);
        ++next_;
    }

    graph_view old_;
    std::int32_t margin_ = 0, next_ = 0;
    buffer<std::int32_t> new_index_;
    graph_builder result_{0, 0};
    buffer<grown_piece> pieces_;
    buffer<std::int32_t> origins_, borders_;  // one per new pixel
};

}}}  // namespace ldi::detail
