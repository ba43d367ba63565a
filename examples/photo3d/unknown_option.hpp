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

/// Returns, for example, "unknown option --hlep; did you mean --help?"; empty if all options are known.
inline std::string unknown_option(const CLI::App& app, int count, char** values) {
    constexpr std::size_t max_length = 40;
    for (int i = 1; i < count; ++i) {
        const std::string given(values[i]), name = given.substr(0, std::min(given.find('='), max_length));
        if (given == "--") break;
        const bool is_short =
            name.size() > 1 && name[0] == '-' && name[1] != '-' && (name[1] < '0' || name[1] > '9') && name[1] != '.';
        if (!is_short && !name.starts_with("--")) continue;
        if (app.get_option_no_throw(is_short ? name.substr(0, 2) : name) != nullptr) continue;
        std::string nearest;
        std::size_t min_distance = std::max<std::size_t>(name.size() / 3, 1) + 1;
        for (const CLI::Option* const option : app.get_options())
            for (const std::string& known : option->get_lnames())
                if (const std::size_t d = distance(name, "--" + known); d < min_distance)
                    min_distance = d, nearest = "--" + known;
        return "unknown option " + name + (nearest.empty() ? std::string() : "; did you mean " + nearest + "?");
    }
    return {};
}

}  // namespace ldi::examples
