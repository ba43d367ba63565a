// The pixels at each lattice position. Hems, soft edges and vertices look up the surfaces around a corner of an outline.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/runs.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Finds the pixels at a lattice position. Each row is divided into blocks of positions, and each block lists the runs of pixels
/// that overlap it. An entry takes 8 bytes; runs of photographs are long, so that most blocks have one entry. A lookup visits all
/// runs of a block, at most `block_size` per surface.
class pixel_stacks {
public:
    /// disparity  K values, one per pixel of `g`
    pixel_stacks(const graph_view& g, array_view<const float> disparity)
        : width_(g.width()),
          height_(g.height()),
          blocks_per_row_((std::ptrdiff_t{g.width()} + block_size - 1) / block_size),
          disparity_(disparity),
          first_run_(static_cast<std::size_t>(blocks_per_row_ * g.height()) + 1) {
        const auto for_each_block = [&](auto&& see) {
            for_each_run(g, [&](pixel_run r) {
                const std::int32_t begin = g.x()[r.first], end = begin + r.size();
                const std::ptrdiff_t row = g.y()[r.first] * blocks_per_row_;
                for (std::ptrdiff_t b = row + begin / block_size; b <= row + (end - 1) / block_size; ++b)
                    see(b, placed_run{r.first, static_cast<lattice_coordinate>(begin), static_cast<lattice_coordinate>(end)});
            });
        };
        for_each_block([&](std::ptrdiff_t b, const placed_run&) { ++first_run_[b]; });
        std::int32_t count = 0;
        for (std::int32_t& first : first_run_) first = count += first;  // for now, the end of each block's runs
        runs_.resize(static_cast<std::size_t>(count), unset);
        for_each_block([&](std::ptrdiff_t b, const placed_run& run) { runs_[--first_run_[b]] = run; });
    }

    float disparity(std::int32_t pixel) const { return disparity_[pixel]; }

    /// Returns the nearest pixel at a position, which is the one that the photo's camera sees. Returns no_pixel if there is none,
    /// and outside the lattice.
    std::int32_t nearest(std::int32_t x, std::int32_t y) const {
        std::int32_t best = no_pixel;
        find(x, y, [&](std::int32_t pixel) {
            if (best == no_pixel || disparity_[pixel] > disparity_[best] ||
                (disparity_[pixel] == disparity_[best] && pixel < best))
                best = pixel;
        });
        return best;
    }

    /// Calls `visit(pixel)` for each pixel at a position, the nearest first, the others in no particular order. There are no
    /// pixels outside the lattice.
    template <class Visit>
    void for_each(std::int32_t x, std::int32_t y, Visit&& visit) const {
        const std::int32_t first = nearest(x, y);
        if (first == no_pixel) return;
        visit(first);
        find(x, y, [&](std::int32_t pixel) {
            if (pixel != first) visit(pixel);
        });
    }

private:
    static constexpr std::int32_t block_size = 8;
    struct placed_run {
        std::int32_t first;             // its first pixel
        lattice_coordinate begin, end;  // its columns
    };

    template <class Visit>
    void find(std::int32_t x, std::int32_t y, Visit&& visit) const {
        if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
        const std::ptrdiff_t block = y * blocks_per_row_ + x / block_size;
        for (std::int32_t i = first_run_[block]; i < first_run_[block + 1]; ++i)
            if (const placed_run& run = runs_[i]; x >= run.begin && x < run.end) visit(run.first + x - run.begin);
    }

    std::int32_t width_, height_;
    std::ptrdiff_t blocks_per_row_;
    array_view<const float> disparity_;
    buffer<std::int32_t> first_run_;  // per block, row by row: index of its first run in runs_; last: number of runs
    buffer<placed_run> runs_;
};

}}}  // namespace ldi::detail
