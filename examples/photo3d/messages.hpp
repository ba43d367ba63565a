// Messages to users and scripts: file names in messages cannot control a terminal, and exit codes distinguish temporary failures
// from permanent ones.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/utf8.hpp>
#include <ldi/io/system_error.hpp>

#include <cstddef>
#include <cstdio>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace ldi::examples {

/// Exit codes of the program. If a signal ends it, the shell sees 128 + the signal's number.
enum exit_code : int {
    exit_done = 0,
    exit_never = 1,       ///< unusable photo, map, weight file or output: the same call never succeeds
    exit_usage = 2,       ///< invalid options or combinations: the same call never succeeds
    exit_defect = 70,     ///< a defect of the program (EX_SOFTWARE)
    exit_try_again = 75,  ///< no memory, disk full, failing device: the same call may succeed later (EX_TEMPFAIL)
};

/// Description for --help and the manual.
constexpr const char* exit_code_text =
    "0: done. 1: an input or an output location can't be used; the same call never succeeds. 2: wrong options. 75: no memory, no "
    "disk space, or a failing device; the same call may succeed later. 70: a defect of the program. Without --batch, any "
    "code but 0 means that no file was written, except to devices and standard output.";

/// Escapes every control character, and every byte that is not UTF-8, as \xNN.
inline std::string escaped(std::string_view text) {
    std::string result;
    while (!text.empty()) {
        const std::size_t length = utf8_length(text);
        const unsigned char first = static_cast<unsigned char>(text[0]);
        const bool is_control = length == 1   ? first < 0x20 || first == 0x7F
                                : length == 2 ? first == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0
                                              : false;
        if (length > 0 && !is_control) {
            result += text.substr(0, length);
            text.remove_prefix(length);
            continue;
        }
        for (std::size_t i = 0; i < (length == 0 ? 1 : length); ++i) {
            char code[8];
            std::snprintf(code, sizeof code, "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(text[i])));
            result += code;
        }
        text.remove_prefix(length == 0 ? 1 : length);
    }
    return result;
}

/// Name with which messages begin.
inline const char* program_name = "photo3d";

/// Prints one line to standard error.
inline void say(const std::string& text) { std::fprintf(stderr, "%s: %s\n", program_name, escaped(text).c_str()); }

/// An error for the user.
struct failure {
    exit_code code;
    std::string kind;  ///< "invalid data", "file access", "out of memory", ..., as for error_code
    std::string text;
};

/// Describes the current exception. Call it in a handler.
inline failure describe_failure() {
    const std::string out_of_memory(to_string(error_code::out_of_memory));
    try {
        throw;
    } catch (const error& e) {
        const std::string kind(to_string(e.code()));
        switch (e.code()) {
            case error_code::invalid_option: return {exit_usage, kind, e.what()};
            case error_code::unavailable:
            case error_code::out_of_memory:
            case error_code::canceled: return {exit_try_again, kind, e.what()};
            default: return {exit_never, kind, e.what()};
        }
    } catch (const std::bad_alloc&) {
        return {exit_try_again, out_of_memory, "not enough memory"};
    } catch (const std::length_error&) {
        return {exit_try_again, out_of_memory, "not enough memory"};
    } catch (const std::system_error& e) {  // threads that can't be started, folders that can't be read
        const bool may_pass = may_succeed_later(e.code().value());
        return {may_pass ? exit_try_again : exit_never,
                std::string(to_string(may_pass ? error_code::unavailable : error_code::file_access)), e.what()};
    } catch (const std::exception& e) {
        return {exit_defect, "defect", std::string("a defect of the program: ") + e.what()};
    }
}

/// Calls `function` and describes the exception that it throws.
template <class Function>
failure failure_of(Function&& function) {
    try {
        function();
    } catch (...) {
        return describe_failure();
    }
    LDI_ASSERT(false);
    return {};
}

/// Prints the current exception. Call it in a handler.
inline exit_code say_failure() {
    const failure what = describe_failure();
    say(what.text);
    return what.code;
}

}  // namespace ldi::examples
