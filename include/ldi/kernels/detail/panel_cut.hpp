// Splits the outputs of a matrix product or a convolution into panels, and packs the weights panel by panel.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Splits outputs into panels of at most `max_vectors` vectors, as evenly as possible.
struct panel_cut {
    std::size_t panels, larger, vectors;  ///< the first `larger` panels have `vectors` vectors, the others one fewer

    panel_cut(std::size_t outputs, std::size_t lanes, std::size_t max_vectors) {
        const std::size_t all = (outputs + lanes - 1) / lanes;
        panels = (all + max_vectors - 1) / max_vectors;
        vectors = (all + panels - 1) / panels;
        larger = panels - (vectors * panels - all);
    }
    std::size_t vectors_in(std::size_t panel) const { return panel < larger ? vectors : vectors - 1; }
};

/// Returns the number of groups of size `group` for `count` inputs or outputs, rounded up.
constexpr std::size_t groups_of(std::size_t count, std::size_t group) { return (count + group - 1) / group; }

/// Order of a kernel's weights.
struct panel_layout {
    std::size_t group;        ///< inputs that one instruction multiplies per output
    std::size_t lanes;        ///< outputs per vector
    std::size_t max_vectors;  ///< maximum vectors per panel
};

/// Dimensions of a layer's weights, row-major: outputs x pieces x inputs. A pixel's window consists of `pieces` contiguous pieces
/// of memory.
struct weight_shape {
    std::size_t outputs, pieces, inputs;
};

/// Appends weights panel by panel, piece by piece, group by group. For each group of inputs, appends its weights for the panel's
/// outputs, one output after another. Pads the last group of each piece and the last panel with zeros.
///
/// weight_at  returns the weight at an index of the unpacked weights
template <class Stored, class WeightAt>
void append_panels(buffer<Stored>& packed, const weight_shape& shape, const panel_layout& layout, const WeightAt& weight_at) {
    const panel_cut cut(shape.outputs, layout.lanes, layout.max_vectors);
    packed.reserve(packed.size() + groups_of(shape.outputs, layout.lanes) * layout.lanes * shape.pieces *
                                       groups_of(shape.inputs, layout.group) * layout.group);
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t last = first + cut.vectors_in(panel) * layout.lanes;
        for (std::size_t piece = 0; piece < shape.pieces; ++piece)
            for (std::size_t from = 0; from < shape.inputs; from += layout.group)
                for (std::size_t o = first; o < last; ++o)
                    for (std::size_t i = from; i < from + layout.group; ++i)
                        packed.push_back(o < shape.outputs && i < shape.inputs
                                             ? static_cast<Stored>(weight_at((o * shape.pieces + piece) * shape.inputs + i))
                                             : Stored{});
        first = last;
    }
}

}}}  // namespace ldi::detail
