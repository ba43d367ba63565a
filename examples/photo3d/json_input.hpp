// Reads untrusted JSON with limited nesting. nlohmann's library recurses once per level to copy, print or free a value, so deep
// nesting could overflow the stack.
#pragma once

#include <ldi/base/error.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace ldi::examples {

/// Maximum nesting of arrays and objects, which is more than any valid input of this program needs.
inline constexpr std::size_t max_json_depth = 16;

/// Whether arrays and objects are nested deeper than max_json_depth.
inline bool is_nested_too_deep(std::string_view text) {
    std::size_t depth = 0;
    bool is_in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"') is_in_string = !is_in_string;
        if (is_in_string) {
            i += c == '\\' ? 1U : 0U;
        } else if (c == '[' || c == '{') {
            if (++depth > max_json_depth) return true;
        } else if ((c == ']' || c == '}') && depth > 0) {
            --depth;
        }
    }
    return false;
}

/// Parses JSON. Returns a discarded value for invalid text. Raises invalid_data for excessive nesting.
///
/// where  source of the text, for messages
template <class Json = nlohmann::json>
Json parse_json(const std::string& text, const std::string& where) {
    if (is_nested_too_deep(text))
        raise(error_code::invalid_data, where, "JSON nested at most " + std::to_string(max_json_depth) + " deep",
              "deeper nesting");
    return Json::parse(text, nullptr, false);
}

}  // namespace ldi::examples
