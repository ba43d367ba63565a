// The pixels at each lattice position. Hems, soft edges and vertices look up the surfaces around a corner of an outline.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Lists the pixels at each lattice position. Most positions have one pixel; only the others need a list.
class pixel_stacks {
public:
    /// disparity  K values, one per pixel of `g`
    pixel_stacks(const graph_view& g, array_view<const float> disparity)
        : width_(g.width()), height_(g.height()), disparity_(disparity), slots_(g.position_count(), no_pixel) {
        if (g.size() > g.position_count())
            entries_.reserve(2 * (g.size() - g.position_count()));  // enough unless positions are empty
        for (std::int32_t i = 0; i < g.count(); ++i) add(i, slots_[g.position_of(i)]);
    }

    float disparity(std::int32_t pixel) const { return disparity_[pixel]; }

    /// Returns the nearest pixel at a position, which is the one that the photo's camera sees. Returns no_pixel if there is none,
    /// and outside the lattice.
    std::int32_t nearest(std::int32_t x, std::int32_t y) const {
        const std::int32_t slot = slot_at(x, y);
        return is_list(slot) ? entries_[first_entry(slot)].pixel : slot;
    }

    /// Calls `visit(pixel)` for each pixel at a position, the nearest first, the others in no particular order. There are no
    /// pixels outside the lattice.
    template <class Visit>
    void for_each(std::int32_t x, std::int32_t y, Visit&& visit) const {
        const std::int32_t slot = slot_at(x, y);
        if (!is_list(slot)) {
            if (slot != no_pixel) visit(slot);
            return;
        }
        for (std::int32_t e = first_entry(slot); e != no_entry; e = entries_[e].next) visit(entries_[e].pixel);
    }

private:
    struct entry {
        std::int32_t pixel, next;  // index of the next entry of the same position, or no_entry
    };
    static constexpr std::int32_t no_entry = -1;

    // The slot of a position is its only pixel, or no_pixel, or less than no_pixel if it has several pixels.
    static bool is_list(std::int32_t slot) { return slot < no_pixel; }
    static std::int32_t first_entry(std::int32_t slot) { return no_pixel - 1 - slot; }
    static std::int32_t list_from(std::int32_t entry) { return no_pixel - 1 - entry; }

    std::int32_t slot_at(std::int32_t x, std::int32_t y) const {
        const bool is_inside = x >= 0 && y >= 0 && x < width_ && y < height_;
        return is_inside ? slots_[std::ptrdiff_t{y} * width_ + x] : no_pixel;
    }

    void add(std::int32_t pixel, std::int32_t& slot) {
        if (slot == no_pixel) {
            slot = pixel;
            return;
        }
        if (!is_list(slot)) {
            entries_.push_back({slot, no_entry});
            slot = list_from(entries_.count() - 1);
        }
        const std::int32_t first = first_entry(slot);
        if (disparity_[pixel] > disparity_[entries_[first].pixel]) std::swap(pixel, entries_[first].pixel);
        const std::int32_t next = entries_[first].next;
        entries_.push_back({pixel, next});
        entries_[first].next = entries_.count() - 1;
    }

    std::int32_t width_, height_;
    array_view<const float> disparity_;
    buffer<std::int32_t> slots_;
    buffer<entry> entries_;
};

}}}  // namespace ldi::detail
