// A depth discontinuity: the side that a far and a near pixel share.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A side of a pixel where depth is discontinuous.
struct discontinuity {
    std::int32_t back;   ///< pixel on the far side
    std::int32_t front;  ///< pixel on the near side
    side toward_front;   ///< direction from `back` to `front`
};

}}  // namespace ldi
