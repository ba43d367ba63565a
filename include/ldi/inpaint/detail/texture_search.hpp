// Finds the known pixel from which each unknown pixel copies its texture. Uses the randomized search of PatchMatch (Barnes,
// Shechtman, Finkelstein and Goldman, "PatchMatch: A Randomized Correspondence Algorithm for Structural Image Editing", 2009).
// The search follows the links of a layered image, so it never reaches another surface. As in "Shift-Map Image Editing"
// (Pritch, Kav-Venaki and Peleg, 2009), the cost increases if neighbors copy from sources that are not neighbors, so that
// copied texture is coherent.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/inpaint/detail/hash.hpp>
#include <ldi/inpaint/detail/texture_cells.hpp>
#include <ldi/inpaint/detail/texture_looks.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class texture_search {
public:
    /// reach  maximum distance of random samples, in steps along x and along y
    texture_search(const graph_view& g, const texture_cells& cells, const buffer<texture_surroundings>& looks, int reach)
        : graph_(g), cells_(cells), looks_(looks), reach_(reach) {}

    /// Returns the source of each cell's texture; no_pixel for a known cell, and for a cell without any source.
    template <executor Executor = const serial_executor>
    buffer<std::int32_t> run(int rounds, Executor&& threads = {}) {
        source_ = buffer<std::int32_t>(cells_.pixel.size(), no_pixel);
        find_nearest_known();
        const buffer<buffer<std::int32_t>> parts = cells_.independent_parts(threads.concurrency());
        parallel_for(threads, parts.size(), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t p = first; p < last; ++p)
                for (int round = 0; round < rounds; ++round) improve_all(parts[p], round);
        });
        return std::move(source_);
    }

private:
    // Cost of two neighboring cells whose sources are not neighbors; tuned by experiment.
    static constexpr int incoherence = 100;
    // One in `search_interval` cells also samples random sources. Good sources then propagate to its neighbors.
    static constexpr std::uint32_t search_interval = 32;

    /// Finds the known cell nearest to each unknown cell along links, or no_pixel. Random candidates are sampled around this
    /// cell.
    void find_nearest_known() {
        nearest_known_ = buffer<std::int32_t>(cells_.pixel.size(), no_pixel);
        buffer<std::int32_t> wave, further;
        for (std::int32_t cell = 0; cell < cells_.count(); ++cell) {
            if (!cells_.is_unknown(cell)) continue;
            for (side s : all_sides)
                if (const std::int32_t n = cells_.neighbor(cell, s); n != no_pixel && !cells_.is_unknown(n))
                    nearest_known_[cell] = n;
            if (nearest_known_[cell] != no_pixel) wave.push_back(cell);
        }
        while (!wave.empty()) {
            further.clear();
            for (std::int32_t cell : wave)
                for (side s : all_sides) {
                    const std::int32_t n = cells_.neighbor(cell, s);
                    if (n == no_pixel || !cells_.is_unknown(n) || nearest_known_[n] != no_pixel) continue;
                    nearest_known_[n] = nearest_known_[cell];
                    further.push_back(n);
                }
            wave.swap(further);
        }
    }

    /// Returns the cost of `from` as the source of `cell`. Once the sum reaches `limit`, returns it without the remaining terms.
    int cost(std::int32_t cell, std::int32_t from, int limit) const {
        int sum = difference_of(looks_[cell], looks_[from]);
        for (side s : all_sides) {
            if (sum >= limit) return sum;
            const std::int32_t n = cells_.neighbor(cell, s);
            if (n == no_pixel || !cells_.is_unknown(n)) continue;
            if (source_[n] == no_pixel || cells_.neighbor(from, s) != source_[n]) sum += incoherence;
        }
        return sum;
    }

    /// Improves the sources of cells, in ascending order in even rounds, in descending order in odd rounds.
    void improve_all(const buffer<std::int32_t>& part, int round) {
        const bool forward = round % 2 == 0;
        for (std::int32_t k = 0; k < part.count(); ++k) {
            const std::int32_t cell = part[forward ? k : part.count() - 1 - k];
            if (nearest_known_[cell] != no_pixel) improve(cell, round, forward);
        }
    }

    void improve(std::int32_t cell, int round, bool forward) {
        std::int32_t& best = source_[cell];
        int min_cost = -1;  // computed on the first comparison, because most calls have no candidate
        const auto consider = [&](std::int32_t from) {
            if (from == no_pixel || from == best || !cells_.is_source(from)) return;
            if (best == no_pixel) {
                best = from;
                return;
            }
            if (min_cost < 0) min_cost = cost(cell, best, (std::numeric_limits<int>::max)());
            if (const int c = cost(cell, from, min_cost); c < min_cost) min_cost = c, best = from;
        };
        for (side s : {forward ? side::left : side::right, forward ? side::up : side::down}) {
            const std::int32_t n = cells_.neighbor(cell, s);
            if (n != no_pixel && source_[n] != no_pixel) consider(cells_.neighbor(source_[n], opposite(s)));
        }
        const std::int32_t pixel = cells_.pixel[cell];
        const std::uint32_t random = hash(static_cast<std::uint32_t>(graph_.x()[pixel]),
                                          64 * static_cast<std::uint32_t>(graph_.y()[pixel]) + static_cast<std::uint32_t>(round));
        if (best != no_pixel && random % search_interval != 0) return;
        for (std::uint32_t n = 0; n < 4; ++n) consider(wander(nearest_known_[cell], hash(random, n), reach_));
        for (int radius = reach_ / 2; radius > 0 && best != no_pixel; radius /= 2)
            consider(wander(best, hash(random, 100 + static_cast<std::uint32_t>(radius)), radius));
    }

    /// Returns a random cell at most `radius` steps away along x, then along y. A walk stops where its links end.
    std::int32_t wander(std::int32_t cell, std::uint32_t random, int radius) const {
        const auto within = [radius](std::uint32_t bits) {  // -radius ... radius
            return static_cast<int>(bits * static_cast<std::uint32_t>(2 * radius + 1) >> 16) - radius;
        };
        const int dx = within(random & 0xFFFF), dy = within(random >> 16);
        const std::int32_t across = cells_.walk(cell, dx < 0 ? side::left : side::right, std::abs(dx));
        return cells_.walk(across, dy < 0 ? side::up : side::down, std::abs(dy));
    }

    graph_view graph_;
    const texture_cells& cells_;
    const buffer<texture_surroundings>& looks_;
    int reach_;
    buffer<std::int32_t> source_, nearest_known_;
};

}}}  // namespace ldi::detail
