// Inpainting without a network: colours diffuse isotropically over the links of the layered image, from what is known into what
// is not. Smooth, fast, and blind to texture.
#pragma once

#include <ldi/core/diffusion.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ldi {

/// A colour_inpainter (photo3d.hpp).
struct diffusion_inpainter {
    /// Gauss-Seidel rounds on each level of the multigrid.
    int rounds = 6;

    /// layers  in canonical order; the colour of every pixel whose known_column is 0 is set. A surface without any known pixel
    ///         gets the mean of the known colours next to unknown ones elsewhere.
    template <executor Executor>
    void inpaint(photo_layers& layers, Executor&, const observer& watcher = {}) const {
        const graph& g = layers.topology;
        const std::vector<std::uint8_t>& known = layers.column<known_column>();
        diffusion solver;
        solver.start();
        std::vector<std::int32_t> cell_of(g.size(), 0);
        for (std::size_t i = 0; i < g.size(); ++i) {
            if (known[i] != 0) continue;
            const std::int32_t cell = cell_of[i] = solver.add_cell(g.x[i], g.y[i]);
            for (side s : all_sides) {
                const std::int32_t neighbour = g.neighbours(s)[i];
                if (neighbour == no_pixel) continue;
                if (known[static_cast<std::size_t>(neighbour)] != 0)
                    solver.add_known_neighbour(cell, layers.at<colour_column>(neighbour).data());
                else if (s == side::left)
                    solver.link_left(cell, cell_of[static_cast<std::size_t>(neighbour)]);
                else if (s == side::up)
                    solver.link_up(cell, cell_of[static_cast<std::size_t>(neighbour)]);
            }
        }
        watcher.report("colour inpainting", 0.3F);
        solver.solve(rounds);
        for (std::size_t i = 0; i < g.size(); ++i) {
            if (known[i] != 0) continue;
            const diffusion::colour_type& colour = solver.colour(cell_of[i]);
            for (std::size_t c = 0; c < 3; ++c)
                layers.at<colour_column>(static_cast<std::int32_t>(i))[c] =
                    static_cast<std::uint8_t>(std::lround(std::clamp(colour[c], 0.0F, 255.0F)));
        }
    }
};

}  // namespace ldi
