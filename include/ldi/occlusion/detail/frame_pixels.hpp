// The pixels of a layered image that continues past the photo's border, appended in canonical order (occlusion/past_frame.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/occlusion/detail/merged_pixels.hpp>

#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Pixel indices are those before the continuation, up to the number of old pixels K; K + i is the new pixel i.
class frame_pixels {
public:
    frame_pixels() = default;
    /// old     graph of the layered image before its continuation
    /// margin  width of the new lattice's margin on each side
    frame_pixels(const graph_view& old, std::int32_t margin)
        : old_count_(old.count()), margin_(margin), added_(old.width() + 2 * margin, old.height() + 2 * margin) {}

    /// Starts a contiguous range of `count` new pixels, each the right neighbor of the pixel before it.
    void add_piece(std::int32_t count) {
        if (count > 0) pieces_.push_back({added_.count(), count, true});
    }
    /// Adds a new pixel at (x, y), relative to the photo's top left pixel, and returns its index.
    ///
    /// border  border pixel whose surface the new pixel continues
    /// source  old pixel from which the new pixel takes its color
    std::int32_t add_new(std::int32_t x, std::int32_t y, std::int32_t border, std::int32_t source) {
        origins_.push_back(source), borders_.push_back(border);
        return old_count_ + added_.add_pixel(x + margin_, y + margin_);
    }
    /// Adds the old pixels from `first` to `last`, which are one run.
    void add_old(std::int32_t first, std::int32_t last) { pieces_.push_back({first, last - first + 1, false}); }

    /// Links two pixels of different pieces.
    ///
    /// b  one step from `a` toward `s`
    void link(std::int32_t a, side s, std::int32_t b) { set_neighbor(a, s, b), set_neighbor(b, opposite(s), a); }

    /// Merges all pixels. Call it after all pixels have been added.
    ///
    /// old  the layered image's graph
    template <executor Executor>
    grown_pixels finish(graph_builder old, Executor& threads) {
        for (const end& e : ends_) old.set_neighbor(e.pixel, e.toward, e.neighbor);
        new_index_ = merged_indices(pieces_, old_count_, added_.count(), threads);
        return {merged_graph(std::move(old), added_, pieces_, new_index_, margin_, threads), std::move(pieces_), origins_};
    }

    /// Returns the index of each pixel in the result.
    const buffer<std::int32_t>& new_index() const { return new_index_; }
    /// For each new pixel: origins() contains the old pixel from which it takes its color, borders() the border pixel whose
    /// surface it continues.
    const buffer<std::int32_t>& origins() const { return origins_; }
    const buffer<std::int32_t>& borders() const { return borders_; }

private:
    /// A link from an old pixel. The old graph gets these links last, because paths into the photo must not leave it.
    struct end {
        std::int32_t pixel, neighbor;
        side toward;
    };
    void set_neighbor(std::int32_t pixel, side s, std::int32_t neighbor) {
        if (pixel < old_count_)
            ends_.push_back({pixel, neighbor, s});
        else
            added_.set_neighbor(pixel - old_count_, s, neighbor);
    }

    std::int32_t old_count_ = 0, margin_ = 0;
    graph_builder added_{0, 0};
    buffer<end> ends_;
    buffer<std::int32_t> new_index_;
    buffer<grown_piece> pieces_;
    buffer<std::int32_t> origins_, borders_;  // one per new pixel
};

}}}  // namespace ldi::detail
