// Text for error messages: formats numbers and image sizes, and sanitizes names read from files.
#pragma once

#include <ldi/base/config.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Shortens a name that was read from a file, and replaces unprintable characters.
inline std::string printable(std::string_view name) {
    if (name.empty()) return "an empty name";
    constexpr std::size_t max_length = 80;
    std::string result(name.substr(0, max_length));
    for (char& c : result)
        if (c < ' ' || c > '~') c = '?';
    return result + (name.size() > max_length ? "..." : "");
}

/// Formats a number with seven significant digits: 0.05, 1e-45, inf, nan.
inline std::string to_text(double value) {
    if (std::isnan(value)) return "nan";
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.7g", value);
    return digits;
}

/// Formats the size of an image or view: "480 x 640 x 3".
inline std::string shape_text(const auto& picture) {
    return std::to_string(picture.height()) + " x " + std::to_string(picture.width()) + " x " +
           std::to_string(picture.channels());
}

/// Returns the place of an error in a file: the file's name and the part, or only the part if the file has no name.
inline std::string place_in(const std::string& file, const std::string& what) { return file.empty() ? what : file + ", " + what; }

}}}  // namespace ldi::detail
