// Text of --help: options in groups, with readable names of values, wrapped at 100 columns.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

namespace ldi::examples {

inline constexpr const char* usage_text = "photo3d [OPTION...] PHOTO...";

inline std::string joined(const std::vector<std::string>& words, const char* between_them) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : between_them) + word;
    return text;
}

inline bool accepts_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

/// Lists the accepted words of an option, from the description of one_of(): {a,b}. Empty if other values are accepted.
inline std::vector<std::string> words_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const std::size_t first = type.find('{'), last = type.find('}');
    if (first == std::string::npos || last == std::string::npos) return {};
    return CLI::detail::split(type.substr(first + 1, last - first - 1), ',');
}

/// Describes an option's value: "FILE", "NUMBER", "disparity|meters".
inline std::string value_of(const CLI::Option& option) {
    const std::vector<std::string> words = words_of(option);
    if (!words.empty()) return joined(words, "|");
    const std::string type = option.get_type_name();
    return type.substr(0, type.find(':'));
}

/// Lists every name of an option, with its dashes.
inline std::vector<std::string> names_of(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return names;
}

/// Returns an option's description, with its range, its default and the options that it requires or excludes, such as
/// "length of the video (0.1 to 600; default: 6; requires --video)".
inline std::string full_description(const CLI::Option& option) {
    std::vector<std::string> facts;
    const std::string type = option.get_type_name();
    if (const std::size_t colon = type.find(':'); colon != std::string::npos && words_of(option).empty())
        facts.push_back(type.substr(colon + 1));
    if (!option.get_default_str().empty()) facts.push_back("default: " + option.get_default_str());
    for (const CLI::Option* other : option.get_needs()) facts.push_back("requires " + names_of(*other).back());
    for (const CLI::Option* other : option.get_excludes()) facts.push_back("not with " + names_of(*other).back());
    return option.get_description() + (facts.empty() ? "" : " (" + joined(facts, "; ") + ")");
}

/// Breaks a text into lines between words.
///
/// indent  number of spaces in front of every line but the first
/// column  column at which the text starts
inline std::string wrapped(const std::string& text, std::size_t indent, std::size_t column) {
    constexpr std::size_t max_columns = 100;
    std::istringstream words(text);
    std::string result, word;
    for (bool is_first = true; words >> word; is_first = false) {
        if (!is_first && column + 1 + word.size() > max_columns) {
            result += "\n" + std::string(indent, ' ');
            column = indent;
        } else if (!is_first) {
            result += ' ';
            ++column;
        }
        result += word;
        column += word.size();
    }
    return result;
}

class help_formatter : public CLI::Formatter {
public:
    std::string make_usage(const CLI::App*, std::string) const override {
        return std::string("\nUsage: ") + usage_text +
               "\n\nExamples:\n"
               "  photo3d photo.jpg                               write photo.glb and photo.html beside the photo\n"
               "  photo3d photo.jpg --depth map.png -o out.glb    use a depth map, and write only out.glb\n"
               "  photo3d --batch photos/ -o out/                 convert all photos of a folder\n\n";
    }

    std::string make_group(std::string group, bool is_positional, std::vector<const CLI::Option*> options) const override {
        std::string text = group + ":\n";
        for (const CLI::Option* option : options) text += make_option(option, is_positional);
        return text + (is_positional ? "\n" : "");
    }

    std::string make_option(const CLI::Option* option, bool is_positional) const override {
        constexpr std::size_t indent = 26;
        std::string head = "  " + (is_positional ? option->get_name(true) : joined(names_of(*option), ", "));
        if (!is_positional && accepts_value(*option)) head += " " + value_of(*option);
        if (head.size() + 2 > indent)
            head += "\n" + std::string(indent, ' ');
        else
            head.resize(indent, ' ');
        return head + wrapped(full_description(*option), indent, indent) + "\n";
    }

    std::string make_footer(const CLI::App* app) const override {
        std::istringstream paragraphs(app->get_footer());
        std::string text;
        for (std::string paragraph; std::getline(paragraphs, paragraph);) text += wrapped(paragraph, 0, 0) + "\n";
        return text;
    }
};

}  // namespace ldi::examples
