// Splits the outputs of a matrix product or a convolution into panels.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Splits outputs into panels of at most `max_vectors` vectors, as evenly as possible.
struct panel_cut {
    std::size_t panels, larger, vectors;  ///< the first `larger` panels have `vectors` vectors, all further panels have one less

    panel_cut(std::size_t outputs, std::size_t lanes, std::size_t most) {
        const std::size_t all = (outputs + lanes - 1) / lanes;
        panels = (all + most - 1) / most;
        vectors = (all + panels - 1) / panels;
        larger = panels - (vectors * panels - all);
    }
    std::size_t vectors_in(std::size_t panel) const { return panel < larger ? vectors : vectors - 1; }
};

}}}  // namespace ldi::detail
