// Checks option values, with messages in the style of ldi.
#pragma once

#include <ldi/formats/picture_formats.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Lists words as in a sentence: "man, bash or zsh".
inline std::string listed(const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return text;
}

/// Formats a rejected value for a message.
inline std::string shown(const std::string& given) { return given.empty() ? "an empty text" : given; }

/// Accepts a number in a range. Unlike CLI::Range, has bounds of type double for options of any type, and rejects "nan".
inline CLI::Validator between(double minimum, double maximum) {
    char range[64];
    std::snprintf(range, sizeof range, "%g to %g", minimum, maximum);
    const std::string text = range;
    return {[=](const std::string& given) {
                char* end = nullptr;
                const double number = std::strtod(given.c_str(), &end);
                const bool is_inside = end != given.c_str() && *end == '\0' && number >= minimum && number <= maximum;
                return is_inside ? std::string() : "expected a number, " + text + ", found " + shown(given);
            },
            text, "between"};
}

/// Accepts a whole number in a range, in decimal digits.
inline CLI::Validator whole_between(std::size_t minimum, std::size_t maximum) {
    const CLI::Validator number = between(static_cast<double>(minimum), static_cast<double>(maximum));
    return {[=](std::string& given) {
                const bool is_whole = given.find_first_not_of("0123456789") == std::string::npos;
                return is_whole && number(given).empty()
                           ? std::string()
                           : "expected a whole number, " + number.get_description() + ", found " + shown(given);
            },
            number.get_description(), "whole_between"};
}

/// Accepts a positive number that a float can hold.
inline CLI::Validator positive() {
    return {[](const std::string& given) {
                char* end = nullptr;
                const float number = std::strtof(given.c_str(), &end);
                const bool is_positive = *end == '\0' && number > 0 && std::isfinite(number);
                return is_positive ? std::string() : "expected a positive number, found " + shown(given);
            },
            "", "positive"};
}

/// Converts a size such as 500MB or 1.5GiB to bytes. A unit without i is a power of 1000.
inline CLI::Validator memory_size() {
    return {[](std::string& given) {
                const std::string refused = "expected a size above 0 such as 500MB or 2GB, found " + shown(given);
                const std::size_t end = std::min(given.find_first_not_of("0123456789."), given.size());
                const std::string number = given.substr(0, end);
                char* end_of_number = nullptr;
                double bytes = std::strtod(number.c_str(), &end_of_number);
                std::string unit = given.substr(std::min(given.find_first_not_of(' ', end), given.size()));
                for (char& c : unit)
                    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
                if (end == 0 || *end_of_number != '\0') return refused;
                if (unit.ends_with('b')) unit.pop_back();
                const double step = unit.ends_with('i') ? 1024 : 1000;
                if (unit.ends_with('i')) unit.pop_back();
                const std::size_t power = std::string_view(" kmgtpe").find(unit.empty() ? ' ' : unit[0]);
                if (unit.size() > 1 || power == std::string_view::npos || (unit.empty() && step == 1024)) return refused;
                bytes *= std::pow(step, static_cast<double>(power));
                if (!(bytes >= 1 && bytes < 0x1p63)) return refused;
                given = std::to_string(static_cast<std::uint64_t>(bytes));
                return std::string();
            },
            "", "memory_size"};
}

/// Number that replaces the word "full". No photo has a longer side.
inline constexpr const char* full_size = "4294967295";

/// Accepts a whole number in a range, or the word "full".
inline CLI::Validator full_or_between(std::size_t minimum, std::size_t maximum) {
    const CLI::Validator number = whole_between(minimum, maximum);
    return {[=](std::string& given) {
                if (given == "full") given = full_size;
                const std::string failure = given == full_size ? std::string() : number(given);
                return failure.empty() ? failure : "expected full or " + failure.substr(std::string("expected ").size());
            },
            "full or " + number.get_description(), "full_or_between"};
}

/// Accepts one of several words.
inline CLI::Validator one_of(const std::vector<std::string>& words) {
    std::string separated;
    for (const std::string& word : words) separated += (separated.empty() ? "" : ",") + word;
    return {[=](const std::string& given) {
                const bool is_known = std::find(words.begin(), words.end(), given) != words.end();
                return is_known ? std::string() : "expected " + listed(words) + ", found " + shown(given);
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

/// Accepts a comma-separated list of picture formats.
inline CLI::Validator formats_named() {
    return {[](const std::string& given) {
                return picture_formats::parse(given) ? std::string()
                                                     : "expected a comma-separated list of formats from " +
                                                           picture_formats().text() + ", found " + shown(given);
            },
            "", "formats"};
}

}  // namespace ldi::examples
