// Errors. Bad input (files, weights, options) raises ldi::error with a code, where it happened, what was expected and what was
// found. Without exceptions the same four go to a handler that the user installs. Misuse of the API is LDI_ASSERT, not an error.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The kinds of errors.
enum class error_code {
    invalid_option,  ///< an option is outside its documented range
    invalid_data,    ///< a file or buffer breaks its format
    unsupported,     ///< well formed, but of a kind that ldi does not read
    mismatch,        ///< two inputs do not fit together (sizes, shapes, names)
    too_large,       ///< beyond a documented limit; checked before anything is allocated
    file_access,     ///< the operating system refused to open, read, write or rename
    canceled,        ///< the caller's progress_listener asked to stop
    out_of_memory,   ///< the caller's memory had no more; only without exceptions, else std::bad_alloc says so
    unavailable,     ///< the operating system could not now (a full disk, too many open files): the same may succeed later
};

/// Name of a code in messages, such as "invalid data".
constexpr std::string_view to_string(error_code code) {
    switch (code) {
        case error_code::invalid_option: return "invalid option";
        case error_code::invalid_data: return "invalid data";
        case error_code::unsupported: return "unsupported";
        case error_code::mismatch: return "mismatch";
        case error_code::too_large: return "too large";
        case error_code::file_access: return "file access";
        case error_code::canceled: return "canceled";
        case error_code::out_of_memory: return "out of memory";
        case error_code::unavailable: return "unavailable for now";
    }
    return "unknown error";
}

/// The facts about an error: enough to show a person, or to decide what to do.
struct error_details {
    error_code code;
    std::string where;     ///< the file, tensor, option or stage
    std::string expected;  ///< what would have been right
    std::string found;     ///< what was there instead
};

/// "photo.jpg: expected a JPEG or PNG file, found 0 bytes (invalid data)"
inline std::string to_string(const error_details& details) {
    std::string text = details.where;
    text += ": expected ";
    text += details.expected;
    text += ", found ";
    text += details.found;
    text += " (";
    text += to_string(details.code);
    text += ")";
    return text;
}

/// The one exception type that ldi throws on bad input.
class error : public std::runtime_error {
public:
    explicit error(error_details details) : std::runtime_error(to_string(details)), details_(std::move(details)) {}

    error_code code() const { return details_.code; }
    const error_details& details() const { return details_; }

private:
    error_details details_;
};

/// Called for every error in builds without exceptions. It must not return: it ends the thread or the process, or jumps out,
/// which skips the destructors of what it jumps over. If it returns, or none is installed, the message is printed and the
/// program ends.
using error_handler = void (*)(const error_details&);

namespace detail {
inline error_handler& installed_error_handler() {
    static error_handler handler = nullptr;
    return handler;
}
}  // namespace detail

/// Installs the handler for builds without exceptions and returns the one before. Not thread-safe: call it at start-up.
inline error_handler set_error_handler(error_handler handler) {
    return std::exchange(detail::installed_error_handler(), handler);
}

/// Reports bad input: throws ldi::error, or calls the installed handler where exceptions are off. Never returns. Its parameters
/// are views, so that none of its many callers makes strings of literals, which takes longest to compile of all they do.
[[noreturn]] inline void raise(error_code code, std::string_view where, std::string_view expected, std::string_view found) {
    error_details details{code, std::string(where), std::string(expected), std::string(found)};
#if LDI_HAS_EXCEPTIONS
    throw error(std::move(details));
#else
    if (detail::installed_error_handler() != nullptr) detail::installed_error_handler()(details);
    std::fprintf(stderr, "ldi: %s\n", to_string(details).c_str());
    std::abort();
#endif
}

}}  // namespace ldi
