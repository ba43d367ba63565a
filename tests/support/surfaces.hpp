// Layered images with disparity only.
#pragma once

#include <ldi/core/layered_image.hpp>

#include <span>

namespace ldi::testing {

using surfaces = layered_image<disparity_column>;

/// topology   any graph
/// disparity  one per pixel
inline surfaces surfaces_of(const graph_view& topology, std::span<const float> disparity) {
    return surfaces(graph_builder(topology).build(), buffer<float>(disparity.begin(), disparity.end()));
}

}  // namespace ldi::testing
