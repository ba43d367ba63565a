// Layered images of disparity alone.
#pragma once

#include <ldi/core/layered_image.hpp>

#include <span>

namespace ldi::testing {

using surfaces = layered_image<disparity_column>;

/// topology   any graph
/// disparity  one a pixel
inline surfaces surfaces_of(const graph& topology, std::span<const float> disparity, surface_rule rule = {}) {
    surfaces layers;
    layers.topology = topology;
    layers.surface = rule;
    layers.column<disparity_column>().assign(disparity.begin(), disparity.end());
    return layers;
}

}  // namespace ldi::testing
