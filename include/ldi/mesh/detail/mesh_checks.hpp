// Input checks that several public mesh functions share.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/camera.hpp>

#include <cmath>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

inline bool is_positive(float value) { return value > 0 && std::isfinite(value); }

inline void check_range(const depth_range& range, const char* where) {
    if (!is_positive(range.z_near) || !is_positive(range.z_far) || range.z_near > range.z_far)
        raise(error_code::invalid_option, where, "finite distances with 0 < z_near <= z_far",
              to_text(range.z_near) + " and " + to_text(range.z_far));
}

}}}  // namespace ldi::detail
