// Inpainting without a network: colors diffuse isotropically over the links of the layered image, from known to unknown pixels.
// This is fast, but the result is smooth and has no texture.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/inpaint/detail/diffuse_unknown.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A color_inpainter (photo3d/suppliers.hpp).
struct diffusion_inpainter {
    /// Gauss-Seidel rounds on each level of the multigrid, 1 to 64.
    int rounds = 6;

    /// Inpaints every pixel whose known_column is 0. If no link path connects a surface to a known pixel, it gets the mean of
    /// the known colors that border unknown pixels of other surfaces. Raises invalid_option for rounds outside [1, 64]. Linear
    /// time. Memory: 4 bytes per pixel, and up to 200 more per unknown pixel.
    ///
    /// layers    in canonical order
    /// progress  receives the stage "color inpainting"
    template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
    void inpaint(Layers& layers, const progress_listener& progress = {}, Executor&& = {}) const {
        if (rounds < 1 || rounds > 64)
            raise(error_code::invalid_option, "diffusion_inpainter, rounds", "1 to 64", std::to_string(rounds));
        detail::diffuse_unknown<3>(
            layers.topology(), layers.template column<known_column>(), rounds,
            [&](std::int32_t pixel, side) { return layers.template at<color_column>(pixel).data(); },
            [&] { progress.report("color inpainting", 0.3F); },
            [&](std::int32_t pixel, const diffusion<3>::value_type& color) {
                for (std::size_t c = 0; c < 3; ++c)
                    layers.template at<color_column>(pixel)[c] = detail::rounded_to_byte(color[c]);
            });
    }
};

}}  // namespace ldi
