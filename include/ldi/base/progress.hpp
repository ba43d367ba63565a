// Progress reports and cancellation of long work.
#pragma once

#include <ldi/base/error.hpp>

#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The caller's callbacks for progress and cancellation. Each callback may be null. ldi calls both on the thread that called
/// the stage.
struct progress_listener {
    void* user = nullptr;
    void (*on_progress)(void* user, std::string_view stage, float fraction) = nullptr;  ///< fraction of the stage, 0 to 1
    /// Returns true to cancel the work.
    bool (*is_canceled)(void* user) = nullptr;

    /// Reports progress. Raises canceled if is_canceled() returns true.
    void report(std::string_view stage, float fraction) const {
        if (on_progress != nullptr) on_progress(user, stage, fraction);
        if (is_canceled != nullptr && is_canceled(user)) raise(error_code::canceled, stage, "completion", "a request to stop");
    }
};

}}  // namespace ldi
