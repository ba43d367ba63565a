// Checks option values, with messages in the style of ldi.
#pragma once

#include <ldi/formats/picture_formats.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace ldi::examples {

/// Accepts a number in a range. Unlike CLI::Range, it takes both bounds as double for options of any type, and rejects "nan".
inline CLI::Validator between(double minimum, double maximum) {
    char range[64];
    std::snprintf(range, sizeof range, "%g to %g", minimum, maximum);
    const std::string text = range;
    return {[=](const std::string& given) {
                char* end = nullptr;
                const double number = std::strtod(given.c_str(), &end);
                const bool is_inside = end != given.c_str() && *end == '\0' && number >= minimum && number <= maximum;
                return is_inside ? std::string() : "expected a number, " + text + ", found " + given;
            },
            text, "between"};
}

/// Value of "full": no photo has a longer side.
inline constexpr const char* full_size = "4294967295";

/// Accepts a number in a range, or the word "full".
inline CLI::Validator full_or_between(double minimum, double maximum) {
    const CLI::Validator number = between(minimum, maximum);
    return {[=](std::string& given) {
                if (given == "full") given = full_size;
                const std::string failure = given == full_size ? std::string() : number(given);
                return failure.empty() ? failure : "expected full or " + failure.substr(std::string("expected ").size());
            },
            "full or " + number.get_description(), "full_or_between"};
}

/// Accepts one of several words.
inline CLI::Validator one_of(const std::vector<std::string>& words) {
    std::string listed, separated;
    for (std::size_t i = 0; i < words.size(); ++i) {
        listed += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
        separated += (i == 0 ? "" : ",") + words[i];
    }
    return {[=](const std::string& given) {
                const bool is_known = std::find(words.begin(), words.end(), given) != words.end();
                return is_known ? std::string() : "expected " + listed + ", found " + (given.empty() ? "an empty text" : given);
            },
            "{" + separated + "}", "one_of"};
}

/// Accepts any name except the empty text, which scripts produce from unset variables.
inline CLI::Validator named() {
    return {[](const std::string& given) {
                return given.empty() ? std::string("expected a name, found an empty one") : std::string();
            },
            "", "named"};
}

/// Accepts formats of pictures, separated by commas.
inline CLI::Validator formats_named() {
    return {[](const std::string& given) {
                return picture_formats::parse(given)
                           ? std::string()
                           : "expected some of " + picture_formats().text() + " with commas between them, found " + given;
            },
            "", "formats"};
}

}  // namespace ldi::examples
