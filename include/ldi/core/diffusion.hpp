// Isotropic diffusion of colors or other values into unknown cells. It fills the padding around charts (paper, section "Texture
// Atlas Generation"), and inpaints without a network. Each unknown cell becomes the mean of its neighbors, which is the smoothest
// interpolation of the known cells. Cells are texels of an atlas or pixels of a layered image; only their adjacency matters.
//
// The wider a gap is, the more rounds plain relaxation needs. This code therefore joins the linked cells of 2 x 2 blocks into
// coarser cells, level by level, until every cell borders on a known cell. It solves the coarsest level first. Each finer level
// starts from the values of the coarser level, so that a few rounds per level suffice (a cascadic multigrid). All steps are
// weighted means, so results stay in the range of the known values.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Collects unknown cells, computes their values, and reuses its memory for the next problem. Each thread needs its own object.
///
///     diffusion<3> d;
///     const std::int32_t cell = d.add_cell(3, 7);
///     d.add_known_neighbor(cell, red_green_blue);
///     d.solve(4);
///     d.value(cell)[0];
template <std::size_t Channels>
class diffusion {
public:
    /// The channels, and one internal value. With three channels, the four floats fill a vector register.
    using value_type = std::array<float, Channels + 1>;

    diffusion() { start(); }
    /// Removes all cells.
    void start() {
        if (levels_.empty()) levels_.resize(1);
        levels_[0].clear();
    }

    /// Allocates memory for `cells` cells. Optional; call it after start().
    void reserve(std::size_t cells) { levels_[0].reserve(cells + 1); }

    /// Adds an unknown cell at (x, y), both 0 or more, and returns its number, starting at 1. Add cells in scanline order.
    /// Several cells may share a position.
    std::int32_t add_cell(std::int32_t x, std::int32_t y) { return levels_[0].add(x, y); }

    /// Adds a neighbor with known values to a cell, one value per channel.
    template <class Scalar>
    void add_known_neighbor(std::int32_t cell, const Scalar* values) {
        level& here = levels_[0];
        value_type& sum = here.known[cell];
        if (here.known_count[cell] == 0.0F) sum = {};
        for (std::size_t c = 0; c < Channels; ++c) sum[c] += static_cast<float>(values[c]);
        here.known_count[cell] += 1.0F;
    }

    /// Links a cell to the unknown cell on its left.
    void link_left(std::int32_t cell, std::int32_t left) { levels_[0].link(left, cell, to_right, to_left); }
    /// Links a cell to the unknown cell above it.
    void link_up(std::int32_t cell, std::int32_t above) { levels_[0].link(above, cell, downwards, upwards); }

    /// Number of cells.
    std::size_t size() const { return levels_.empty() ? 0 : levels_[0].size(); }

    /// Computes all values with `rounds` Gauss-Seidel rounds per level. A cell that no link connects to a known value gets the
    /// mean of all known values. Every call starts anew; cells, neighbors and links may be added between calls.
    void solve(int rounds) {
        if (size() == 0) return;
        std::size_t depth = 1;
        while (!levels_[depth - 1].all_border_on_known()) {
            if (levels_.size() == depth) levels_.emplace_back();
            coarsen(levels_[depth - 1], levels_[depth]);
            if (levels_[depth].size() == levels_[depth - 1].size()) break;  // no cells left to join
            ++depth;
        }
        for (std::size_t l = depth; l-- > 0;) {
            level& here = levels_[l];
            if (l + 1 == depth) {
                here.start_from_known();
            } else {
                for (std::size_t i = 1; i < here.value.size(); ++i) here.value[i] = levels_[l + 1].value[here.parent[i]];
            }
            here.prepare();
            for (int round = 0; round < rounds; ++round) here.relax(round % 2 == 1);
        }
    }

    /// Returns the values of a cell after solve(), one per channel. The last entry is internal.
    const value_type& value(std::int32_t cell) const { return levels_[0].value[cell]; }

private:
    static constexpr std::size_t upwards = 0, downwards = 1, to_left = 2, to_right = 3;

    /// One level of the multigrid. Cell 0 has value 0 and stands in for every missing neighbor.
    struct level {
        buffer<value_type> value;
        /// Per cell: sum over its known neighbors, undefined if there are none. prepare() sets the last entry to 1 / (number of
        /// all neighbors), so that relax() reads it along with the sum.
        buffer<value_type> known;
        buffer<float> known_count;  ///< per cell: number of its known neighbors
        buffer<std::array<std::int32_t, 4>> links;
        buffer<std::array<std::int32_t, 2>> position;
        buffer<std::int32_t> parent;

        std::size_t size() const { return value.empty() ? 0 : value.size() - 1; }

        void reserve(std::size_t cells) {
            value.reserve(cells), known.reserve(cells), known_count.reserve(cells), links.reserve(cells), position.reserve(cells);
        }

        void clear() {
            value.clear(), known.clear(), known_count.clear(), links.clear(), position.clear();
            add(0, -1);
        }

        std::int32_t add(std::int32_t x, std::int32_t y) {
            value.push_back({});
            known.push_back({});
            known_count.push_back(0.0F);
            links.push_back({});
            position.push_back({x, y});
            return value.count() - 1;
        }

        void link(std::int32_t a, std::int32_t b, std::size_t from_a, std::size_t from_b) {
            links[a][from_a] = b;
            links[b][from_b] = a;
        }

        /// Links two cells unless either already has a neighbor on that side. Where surfaces branch, a joined cell may border on
        /// two cells on one side; the first of them is linked.
        void link_if_free(std::int32_t a, std::int32_t b, std::size_t from_a, std::size_t from_b) {
            if (links[a][from_a] == 0 && links[b][from_b] == 0) link(a, b, from_a, from_b);
        }

        bool all_border_on_known() const {
            for (std::size_t i = 1; i < known_count.size(); ++i)
                if (known_count[i] == 0.0F) return false;
            return true;
        }

        void start_from_known() {
            value_type all{};
            float all_count = 0.0F;
            for (std::size_t i = 1; i < value.size(); ++i) {
                if (known_count[i] == 0.0F) continue;
                for (std::size_t c = 0; c < Channels; ++c) all[c] += known[i][c];
                all_count += known_count[i];
            }
            for (std::size_t i = 1; i < value.size(); ++i) {
                const bool borders = known_count[i] > 0.0F;
                const value_type& from = borders ? known[i] : all;
                const float count = borders ? known_count[i] : all_count;
                for (std::size_t c = 0; c < Channels; ++c) value[i][c] = count > 0.0F ? from[c] / count : 0.0F;
            }
        }

        void prepare() {
            for (std::size_t i = 1; i < value.size(); ++i) {
                float neighbors = known_count[i];
                for (std::int32_t other : links[i]) neighbors += other != 0 ? 1.0F : 0.0F;
                if (known_count[i] == 0.0F) known[i] = neighbors == 0.0F ? value[i] : value_type{};
                if (neighbors == 0.0F) neighbors = 1.0F;  // a cell without neighbors keeps its value
                known[i][Channels] = 1.0F / neighbors;
            }
        }

        void relax(bool backwards) {
            const std::size_t count = value.size();
            for (std::size_t step = 1; step < count; ++step) {
                const std::size_t i = backwards ? count - step : step;
                const value_type& up = value[links[i][upwards]];
                const value_type& down = value[links[i][downwards]];
                const value_type& left = value[links[i][to_left]];
                const value_type& right = value[links[i][to_right]];
                const value_type& k = known[i];
                value_type mean;
                for (std::size_t c = 0; c < Channels + 1; ++c)
                    mean[c] = (k[c] + ((up[c] + down[c]) + (left[c] + right[c]))) * k[Channels];
                value[i] = mean;
            }
        }
    };

    /// Joins the linked cells of each 2 x 2 block of positions.
    static void coarsen(level& fine, level& coarse) {
        coarse.clear();
        fine.parent.assign(fine.value.size(), 0);
        for (std::size_t i = 1; i < fine.value.size(); ++i) {
            const std::int32_t x = fine.position[i][0], y = fine.position[i][1];
            std::int32_t parent = x % 2 == 1 ? fine.parent[fine.links[i][to_left]] : 0;
            if (parent == 0 && y % 2 == 1) parent = fine.parent[fine.links[i][upwards]];
            if (parent == 0) parent = coarse.add(x / 2, y / 2);
            fine.parent[i] = parent;
            if (fine.known_count[i] == 0.0F) continue;
            for (std::size_t c = 0; c < Channels; ++c) coarse.known[parent][c] += known_weight * fine.known[i][c];
            coarse.known_count[parent] += known_weight * fine.known_count[i];
        }
        for (std::size_t i = 1; i < fine.value.size(); ++i) {
            const std::int32_t here = fine.parent[i];
            const std::int32_t left = fine.parent[fine.links[i][to_left]];
            const std::int32_t up = fine.parent[fine.links[i][upwards]];
            if (left != 0 && left != here) coarse.link_if_free(left, here, to_right, to_left);
            if (up != 0 && up != here) coarse.link_if_free(up, here, downwards, upwards);
        }
    }

    /// Weight of a known neighbor on the next coarser level. Weights are inversely proportional to distance, and a neighboring
    /// joined cell has weight 1. A joined cell is two cells wide, so it borders on two known cells per side. The centers of
    /// these known cells are 1.5 cells away from its center; the center of a neighboring joined cell is 2 cells away. The two
    /// known cells together therefore have weight 2 / 1.5, and each has weight 2 / 3.
    static constexpr float known_weight = 2.0F / 3.0F;

    buffer<level> levels_;
};

}}  // namespace ldi
