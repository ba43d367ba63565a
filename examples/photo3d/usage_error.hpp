// Messages for errors of the command line, in the style of ldi: the option, what it expects, and what was found.
#pragma once

#include "help_text.hpp"
#include "messages.hpp"
#include "option_checks.hpp"
#include "unknown_option.hpp"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace ldi::examples {

/// Describes the value that an option expects: "a value (NUMBER, 5 to 150)", or the words that it accepts.
inline std::string expected_value(const CLI::Option& option) {
    const std::vector<std::string> words = words_of(option);
    if (!words.empty()) return listed(words);
    std::string type = option.get_type_name();
    if (const std::size_t colon = type.find(':'); colon != std::string::npos) type.replace(colon, 1, ", ");
    return "a value (" + type + ")";
}

/// Returns the message for a flag with a value that is not true or false; empty if there is none.
inline std::string invalid_flag(const CLI::Option& option) {
    if (accepts_value(option)) return {};
    for (const std::string& given : option.results()) {
        bool value = false;
        if (!CLI::detail::lexical_cast(given, value))
            return names_of(option).back() + ": expected no value, true or false, found " + given;
    }
    return {};
}

/// Describes what a command line lacks: a subcommand, an option, or the photo.
inline std::string missing_word(const CLI::App& app) {
    if (app.get_require_subcommand_min() > 0 && app.get_subcommands().empty()) {
        std::vector<std::string> names;
        for (const CLI::App* const part : app.get_subcommands([](const CLI::App*) { return true; }))
            names.push_back(part->get_name());
        return "command line: expected " + listed(names) + ", found neither";
    }
    for (const CLI::Option* const option : options_in_use(app))
        if (option->get_required() && option->count() == 0 && !option->get_positional())
            return option->get_name() + ": expected " + expected_value(*option) + ", found none";
    return std::string("PHOTO: expected at least one, found none; usage: ") + usage_text;
}

/// Describes an error of the parser, for example "--fov: expected a value (NUMBER, 5 to 150), found none".
///
/// words  the command line without the program's name
inline std::string usage_error(const CLI::App& app, const CLI::ParseError& e, const std::vector<std::string>& words) {
    if (const std::string text = unknown_option(app, words); !text.empty()) return text;
    const std::string kind = e.get_name(), said = e.what();
    if (kind == "RequiredError") return missing_word(app);
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError))  // the error may name the subcommand
        return "command line: expected no further word, found " + said.substr(said.find(": ") + 2);
    for (const CLI::Option* const option : options_in_use(app)) {
        const std::string name = option->get_name();
        if (kind != "ArgumentMismatch" || said.substr(0, said.find(':')) != name) continue;
        if (option->count() > 1) return name + ": expected one value, found " + std::to_string(option->count());
        return name + ": expected " + expected_value(*option) + ", found none";
    }
    for (const CLI::Option* const option : options_in_use(app)) {
        if (option->count() == 0) continue;
        const auto name = [&] { return option->get_name(); };
        if (kind == "RequiresError")
            for (const CLI::Option* const other : option->get_needs())
                if (other->count() == 0) return name() + ": expected " + other->get_name() + " beside it, found none";
        if (kind == "ExcludesError")
            for (const CLI::Option* const other : option->get_excludes())
                if (other->count() > 0) return name() + ": expected no " + other->get_name() + " beside it, found both";
        if (kind == "ConversionError")
            if (const std::string text = invalid_flag(*option); !text.empty()) return text;
    }
    return said;
}

/// Prints an error of the parser. Returns the exit code.
///
/// program  name of the program, whose --help lists the options
inline exit_code say_usage_error(const CLI::App& app, const CLI::ParseError& e, const std::vector<std::string>& words,
                                 const std::string& program) {
    say(usage_error(app, e, words) + " (" + program + " --help lists all options)");
    return exit_usage;
}

}  // namespace ldi::examples
