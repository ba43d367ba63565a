// The rule for whether neighboring pixels belong to one surface: a threshold on disparity (the paper's tau_disp).
#pragma once

#include <ldi/base/config.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

// Both constants belong to expand(). They are in core because build_mesh() closes the gaps between surfaces that expand() could
// not link, and mesh/ and occlusion/ do not include each other.

/// Minimum difference in disparity between a pixel that expand() adds and the photo's pixel in front of it, as a multiple of
/// surface_rule::max_step, with a margin for rounding.
inline constexpr float min_hidden_step = 1.001F;
/// Maximum difference in disparity between a pixel that expand() adds and the neighbors that expand() links to it, as a multiple
/// of surface_rule::max_step.
inline constexpr float max_joined_step = 1.0F + min_hidden_step;

/// Decides whether neighboring pixels belong to one surface. Part of photo_facts: lift() and all later stages must use the same
/// rule.
struct surface_rule {
    /// Neighbors whose disparities differ by more than this are on different surfaces (the paper's tau_disp). 0 or more;
    /// make_photo3d() requires 0.001 to 1.
    float max_step = 0.05F;

    /// Whether two neighbors with these disparities are on one surface. False if either is NaN.
    bool same_surface(float a, float b) const {
        const float step = a - b;
        return (step < 0 ? -step : step) <= max_step;
    }
};

}}  // namespace ldi
