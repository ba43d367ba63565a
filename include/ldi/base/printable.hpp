// Names that come out of files, numbers and sizes, in messages.
#pragma once

#include <ldi/base/config.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A name from a file, fit for a message: short, and in printable characters.
inline std::string printable(std::string_view name) {
    if (name.empty()) return "an empty name";
    constexpr std::size_t most = 80;
    std::string result(name.substr(0, most));
    for (char& c : result)
        if (c < ' ' || c > '~') c = '?';
    return result + (name.size() > most ? "..." : "");
}

/// A number with as many digits as matter: 0.05, 1e-45, inf, nan.
inline std::string to_text(double value) {
    if (std::isnan(value)) return "nan";
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.7g", value);
    return digits;
}

/// "480 x 640 x 3", of an image or view.
inline std::string shape_text(const auto& picture) {
    return std::to_string(picture.height()) + " x " + std::to_string(picture.width()) + " x " +
           std::to_string(picture.channels());
}

/// Something of a file, or of none, as messages name it.
inline std::string place_in(const std::string& file, const std::string& what) { return file.empty() ? what : file + ", " + what; }

}}}  // namespace ldi::detail
