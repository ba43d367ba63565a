// Names that come out of files, in messages.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace ldi::inline LDI_CONFIGURATION::detail {

/// A name from a file, fit for a message: short, and in printable characters.
inline std::string printable(std::string_view name) {
    if (name.empty()) return "an empty name";
    constexpr std::size_t most = 80;
    std::string result(name.substr(0, most));
    for (char& c : result)
        if (c < ' ' || c > '~') c = '?';
    return result + (name.size() > most ? "..." : "");
}

/// Something of a file, or of none, as messages name it.
inline std::string place_in(const std::string& file, const std::string& what) { return file.empty() ? what : file + ", " + what; }

}  // namespace ldi::detail
