// A depth discontinuity: the side between a far and a near pixel.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One side of a pixel with a discontinuity.
struct discontinuity {
    std::int32_t back;   ///< the pixel on the far side
    std::int32_t front;  ///< the pixel on the near side
    side towards_front;  ///< the side of `back` that `front` lies on
};

}}  // namespace ldi
