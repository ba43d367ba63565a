// Generates the manual page and the completions for shells from the program's description of its options.
#pragma once

#include "help_text.hpp"
#include "messages.hpp"

#include <CLI/CLI.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Lists all options; those of groups come last.
inline std::vector<const CLI::Option*> all_options(const CLI::App& app) {
    std::vector<const CLI::Option*> options = app.get_options();
    for (const CLI::App* group : app.get_subcommands([](const CLI::App*) { return true; }))
        for (const CLI::Option* option : group->get_options()) options.push_back(option);
    std::erase_if(options, [](const CLI::Option* o) { return o->get_group().empty(); });  // hidden
    return options;
}

/// Lists all options, those of a group together; groups are in the order of their first options.
inline std::vector<const CLI::Option*> options_by_group(const CLI::App& app) {
    std::vector<const CLI::Option*> options;
    for (const std::string& group : app.get_groups())
        for (const CLI::Option* option : all_options(app))
            if (option->get_group() == group) options.push_back(option);
    return options;
}

/// Escapes text for troff.
inline std::string roff(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (result.empty() || result.back() == '\n')
            if (c == '.' || c == '\'') result += "\\&";
        result += c == '\\' ? std::string("\\e") : c == '-' ? std::string("\\-") : std::string(1, c);
    }
    return result;
}

inline std::string manual(const CLI::App& app, const std::string& version) {
    std::string page =
        ".TH PHOTO3D 1 \"\" \"" + roff(version) + "\" \"User Commands\"\n.SH NAME\nphoto3d \\- " +
        "makes a 3D photo from a photo\n.SH SYNOPSIS\n.B photo3d\n.RI [ OPTION ...]\n.IR PHOTO ...\n.SH DESCRIPTION\n" +
        roff(app.get_description()) + "\n.SH OPTIONS\n";
    std::string group;
    for (const CLI::Option* option : options_by_group(app)) {
        if (option->get_group() != group) page += ".SS " + roff(group = option->get_group()) + "\n";
        page += ".TP\n";
        if (option->get_positional() && names_of(*option).empty()) {
            page += ".I " + roff(option->get_name(true)) + "\n";
        } else {
            page += ".B " + roff(joined(names_of(*option), ", "));
            if (accepts_value(*option)) page += " \\fI" + roff(value_of(*option)) + "\\fR";
            page += "\n";
        }
        page += roff(full_description(*option)) + "\n";
    }
    return page + ".SH FILES\n" + roff(app.get_footer()) + "\n.SH EXIT STATUS\n" + roff(exit_code_text) + "\n";
}

inline std::string bash_completion(const CLI::App& app) {
    std::string names, values;
    for (const CLI::Option* option : all_options(app)) {
        const std::vector<std::string> own = names_of(*option), words = words_of(*option);
        for (const std::string& name : own) names += name + " ";
        if (!words.empty())
            values += "        " + joined(own, "|") + ") mapfile -t COMPREPLY < <(compgen -W '" + joined(words, " ") +
                      "' -- \"$current\"); return ;;\n";
    }
    return "# bash completion for photo3d\n_photo3d() {\n    local current=${COMP_WORDS[COMP_CWORD]}\n"
           "    case ${COMP_WORDS[COMP_CWORD - 1]} in\n" +
           values + "    esac\n    if [[ $current == -* ]]; then\n        mapfile -t COMPREPLY < <(compgen -W '" + names +
           "' -- \"$current\")\n    fi\n}\ncomplete -o default -F _photo3d photo3d\n";
}

/// Quotes text for a shell. Also escapes the characters in `also`, which have a special meaning in the shell's completions.
inline std::string quoted(std::string_view text, std::string_view also) {
    std::string result = "'";
    for (const char c : text) {
        if (c == '\'') {
            result += "'\\''";
        } else if (also.find(c) != std::string_view::npos) {
            result += std::string("\\") + c;
        } else {
            result += c;
        }
    }
    return result + "'";
}

inline std::string zsh_completion(const CLI::App& app) {
    std::string text = "#compdef photo3d\n_arguments \\\n";
    for (const CLI::Option* option : all_options(app))
        for (const std::string& name : names_of(*option)) {
            const std::vector<std::string> words = words_of(*option);
            std::string line = name + "[";
            std::string value = !accepts_value(*option) ? ""
                                : words.empty()         ? ":value:_files"
                                                        : ":value:(" + joined(words, " ") + ")";
            std::string description = quoted(option->get_description(), "[]:\\");
            text += "    '" + line + description.substr(1, description.size() - 2) + "]" + value + "' \\\n";
        }
    return text + "    '*:photo:_files'\n";
}

inline std::string fish_completion(const CLI::App& app) {
    std::string text;
    for (const CLI::Option* option : all_options(app)) {
        if (names_of(*option).empty()) continue;
        const std::vector<std::string> words = words_of(*option);
        text += "complete -c photo3d";
        for (const std::string& name : option->get_snames()) text += " -s " + name;
        for (const std::string& name : option->get_lnames()) text += " -l " + name;
        if (accepts_value(*option)) text += words.empty() ? " -r" : " -x -a " + quoted(joined(words, " "), "\\");
        std::string description;
        for (const char c : option->get_description()) description += c == '\'' ? std::string("\\'") : std::string(1, c);
        text += " -d '" + description + "'\n";
    }
    return text;
}

/// Generates a document.
///
/// kind  man, bash, zsh or fish
inline std::string document(const CLI::App& app, const std::string& version, std::string_view kind) {
    return kind == "man"    ? manual(app, version)
           : kind == "bash" ? bash_completion(app)
           : kind == "zsh"  ? zsh_completion(app)
                            : fish_completion(app);
}

}  // namespace ldi::examples
