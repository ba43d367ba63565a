// Errors. Bad input (files, weights, options) raises ldi::error with a code, the place, what was expected and what was found.
// Without exceptions, the same four values go to a handler that the user installs. Misuse of the API is not an error, but fails
// an LDI_ASSERT.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Kinds of errors.
enum class error_code {
    invalid_option,  ///< an option is outside its documented range
    invalid_data,    ///< a file or buffer violates its format
    unsupported,     ///< a well-formed file or tensor of a kind that ldi does not read
    mismatch,        ///< inputs do not fit together (sizes, shapes, names)
    too_large,       ///< beyond a documented limit; checked before anything is allocated
    file_access,     ///< the operating system refused to open, read, write or rename a file
    canceled,        ///< the caller's progress_listener asked to stop
    /// memory is exhausted while io/ decodes or encodes a file. Elsewhere, ldi throws std::bad_alloc instead, and raises this
    /// code only if exceptions are off
    out_of_memory,
    /// a temporary failure of the operating system (a full disk, too many open files): the same call may succeed later
    unavailable,
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

/// Details of an error, for messages and for the caller's error handling.
struct error_details {
    error_code code;
    std::string where;     ///< the file, tensor, option or stage
    std::string expected;  ///< the valid input
    std::string found;     ///< the actual input
};

/// Formats an error as a message: "photo.jpg: expected a JPEG or PNG file, found 0 bytes (invalid data)".
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

/// The only exception type that ldi throws on bad input. It stores its strings as std::runtime_error objects, whose copies share
/// one text, so that copying an error allocates no memory.
class error : public std::runtime_error {
public:
    explicit error(const error_details& details)
        : std::runtime_error(to_string(details)),
          code_(details.code),
          where_(details.where),
          expected_(details.expected),
          found_(details.found) {}

    error_code code() const { return code_; }
    error_details details() const { return {code_, where_.what(), expected_.what(), found_.what()}; }

private:
    error_code code_;
    std::runtime_error where_, expected_, found_;
};

/// Handler of every error in builds without exceptions. It must not return: it ends the thread or the process, or leaves by
/// longjmp(), which skips destructors. If it returns, or no handler is installed, the program prints the message and terminates.
using error_handler = void (*)(const error_details&);

namespace detail {
inline error_handler& installed_error_handler() {
    static error_handler handler = nullptr;
    return handler;
}
}  // namespace detail

/// Installs the handler for builds without exceptions and returns the previous one. Not thread-safe: call it at start-up.
inline error_handler set_error_handler(error_handler handler) {
    return std::exchange(detail::installed_error_handler(), handler);
}

/// Reports bad input: throws ldi::error, or calls the installed handler if exceptions are off. Never returns. The parameters are
/// string views, because constructing a std::string at each of the many call sites would dominate compile time.
[[noreturn]] inline void raise(error_code code, std::string_view where, std::string_view expected, std::string_view found) {
    error_details details{code, std::string(where), std::string(expected), std::string(found)};
#if LDI_HAS_EXCEPTIONS
    throw error(details);
#else
    if (detail::installed_error_handler() != nullptr) detail::installed_error_handler()(details);
    std::fprintf(stderr, "ldi: %s\n", to_string(details).c_str());
    std::abort();
#endif
}

}}  // namespace ldi
