// The error that a call raises.
#pragma once

#include <ldi/base/error.hpp>

#include <optional>
#include <string>

namespace ldi::testing {

/// Returns the error that a call raises; nothing if it returns.
template <class Call>
std::optional<error_code> raised(Call&& call) {
    try {
        call();
    } catch (const error& e) {
        return e.code();
    }
    return std::nullopt;
}

/// Returns the message of the error that a call raises.
template <class Call>
std::string message_of(Call&& call) {
    try {
        call();
    } catch (const error& e) {
        return e.what();
    }
    return "nothing raised";
}

}  // namespace ldi::testing
