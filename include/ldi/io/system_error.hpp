// Converts operating system errors (errno values) to ldi::error.
#pragma once

#include <ldi/base/error.hpp>

#include <cerrno>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Returns the operating system's message.
inline std::string system_reason(int error_number) {
    return error_number == 0 ? std::string("an input or output error") : std::generic_category().message(error_number);
}

/// Whether the same call may succeed later with the same arguments, for example once a full disk has space again.
inline bool may_succeed_later(int error_number) {
    switch (error_number) {
        case ENOSPC:
        case EIO:
        case ENOMEM:
        case EPIPE:
        case EMFILE:
        case ENFILE:
        case EAGAIN:
        case EBUSY:
#ifdef EDQUOT
        case EDQUOT:
#endif
            return true;
        default: return false;
    }
}

/// Raises unavailable if the call may succeed later, else file_access.
[[noreturn]] inline void raise_system_error(int error_number, const std::filesystem::path& where, std::string_view expected) {
    raise(may_succeed_later(error_number) ? error_code::unavailable : error_code::file_access, where.string(), expected,
          error_number == ENOENT ? "no such file" : "an error: " + system_reason(error_number));
}

/// Returns errno after a failure; EIO if the standard library did not set it.
inline int last_error() { return errno == 0 ? EIO : errno; }

}}  // namespace ldi
