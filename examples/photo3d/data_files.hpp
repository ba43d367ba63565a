// Where the program finds what comes with it: the weights of the networks, and the viewer.
#pragma once

#include <ldi/base/error.hpp>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace ldi::examples {

/// The folder of the program's data. It lies where the installation puts it, seen from the program, so both can be moved
/// together; in a build tree links in it lead to the sources.
///
/// program  the command that started it
inline std::filesystem::path data_folder(const char* program) {
    std::error_code unknown;
    std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", unknown);
    if (unknown) self = std::filesystem::absolute(program);  // not on Linux: right unless it was found in the PATH
    return (self.parent_path() / LDI_DATA_FROM_PROGRAM).lexically_normal();
}

/// Where weights that no option names are looked for.
class model_folders {
public:
    static constexpr const char* variable = "LDI_MODELS";

    /// Errors: file_access where LDI_MODELS names something else than a folder.
    explicit model_folders(const std::filesystem::path& data) : folders_{data / "models"} {
        const char* const named = std::getenv(variable);
        if (named == nullptr || *named == '\0') return;
        std::error_code ignored;
        if (!std::filesystem::is_directory(named, ignored))
            raise(error_code::file_access, variable, "the path of a folder with weights", named);
        folders_.insert(folders_.begin(), named);
    }

    std::optional<std::filesystem::path> find(const std::string& file) const {
        std::error_code ignored;
        for (const std::filesystem::path& folder : folders_)
            if (std::filesystem::exists(folder / file, ignored)) return folder / file;
        return std::nullopt;
    }

    /// For messages.
    std::string text() const {
        std::string text;
        for (const std::filesystem::path& folder : folders_) text += (text.empty() ? "" : " or ") + folder.string();
        return text;
    }

private:
    std::vector<std::filesystem::path> folders_;
};

}  // namespace ldi::examples
