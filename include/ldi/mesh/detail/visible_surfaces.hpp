// Disparity and matte of the surfaces that the photo's camera sees. Hems and soft edges depend on them.
#pragma once

#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Disparity and matte of the pixels visible from the photo's camera, one value per lattice position.
struct visible_surfaces {
    static constexpr float nothing = -std::numeric_limits<float>::infinity();
    image<float> disparity;     ///< H x W x 1; `nothing` at positions without a surface
    image<std::uint8_t> matte;  ///< H x W x 1
};

/// Collects the disparity of the nearest surface at each position, and its matte if there is a matte column.
template <has_columns<disparity_column> Layers>
visible_surfaces find_visible(const Layers& layers) {
    constexpr bool has_matte = has_column<Layers, matte_column>;
    const auto& g = layers.topology();
    const std::size_t rows = static_cast<std::size_t>(g.height()), columns = static_cast<std::size_t>(g.width());
    visible_surfaces seen{image<float>(rows, columns, 1),
                          has_matte ? image<std::uint8_t>(rows, columns, 1) : image<std::uint8_t>()};
    std::fill_n(seen.disparity.data(), seen.disparity.size(), visible_surfaces::nothing);
    const auto disparity = layers.template column<disparity_column>();
    for (std::int32_t i = 0; i < g.count(); ++i) {
        const std::size_t position = g.position_of(i);
        if (disparity[i] <= seen.disparity.data()[position]) continue;
        seen.disparity.data()[position] = disparity[i];
        if constexpr (has_matte) seen.matte.data()[position] = layers.template column<matte_column>()[i];
    }
    return seen;
}

}}}  // namespace ldi::detail
