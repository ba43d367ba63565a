// The one rule for which pixels belong to one surface: a threshold on disparity that every stage asks (the paper's tau_disp).
#pragma once

#include <ldi/base/config.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Given once, in photo3d_options or to lift(), and carried by the layered image from then on.
struct surface_rule {
    /// Neighbors that differ by more than this in disparity are on different surfaces (the paper's tau_disp).
    float largest_step = 0.05F;

    /// Whether two neighbors with these disparities are on one surface. False if one of them is not a number.
    bool same_surface(float a, float b) const {
        const float step = a - b;
        return (step < 0 ? -step : step) <= largest_step;
    }
};

}}  // namespace ldi
