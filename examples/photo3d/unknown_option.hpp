// Message for an unknown option: its name, and the most similar option.
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Number of letters to insert, delete or replace to convert one text to the other (Levenshtein).
inline std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t corner = row[0]++;
        for (std::size_t k = 0; k < b.size(); ++k) {
            const std::size_t replaced = corner + (a[i] == b[k] ? 0U : 1U);
            corner = row[k + 1];
            row[k + 1] = std::min({replaced, row[k] + 1, corner + 1});
        }
    }
    return row.back();
}

/// The options of a program and of its subcommands that the command line names.
inline std::vector<const CLI::Option*> options_in_use(const CLI::App& app) {
    std::vector<const CLI::Option*> options = app.get_options();
    for (const CLI::App* const part : app.get_subcommands())
        for (const CLI::Option* const option : part->get_options()) options.push_back(option);
    return options;
}

/// Returns, for example, "unknown option --hlep; did you mean --help?"; empty if all options are known.
///
/// words  the command line without the program's name
inline std::string unknown_option(const CLI::App& app, const std::vector<std::string>& words) {
    constexpr std::size_t max_length = 40;
    const std::vector<const CLI::Option*> options = options_in_use(app);
    for (const std::string& given : words) {
        const std::string name = given.substr(0, std::min(given.find('='), max_length));
        if (given == "--") break;
        const bool is_short =
            name.size() > 1 && name[0] == '-' && name[1] != '-' && (name[1] < '0' || name[1] > '9') && name[1] != '.';
        if (!is_short && !name.starts_with("--")) continue;
        const std::string known_name = is_short ? name.substr(0, 2) : name;
        if (std::any_of(options.begin(), options.end(), [&](const auto* option) { return option->check_name(known_name); }))
            continue;
        std::string nearest;
        std::size_t min_distance = std::max<std::size_t>(name.size() / 3, 1) + 1;
        for (const CLI::Option* const option : options)
            for (const std::string& known : option->get_lnames())
                if (const std::size_t d = distance(name, "--" + known); d < min_distance)
                    min_distance = d, nearest = "--" + known;
        return "unknown option " + name + (nearest.empty() ? std::string() : "; did you mean " + nearest + "?");
    }
    return {};
}

}  // namespace ldi::examples
