// Locates the program's data: the weights of the networks, and the viewer.
#pragma once

#include "system.hpp"

#include <ldi/base/error.hpp>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace ldi::examples {

/// Returns the folder of the program's data. In an unpacked archive, the weights are in the program's own folder or in share/ldi
/// below it; returns whichever of the two has them. In a build tree, share/ldi contains links to the sources. Otherwise returns a
/// folder at a fixed path relative to the program, so that an installed tree can be moved as a whole.
///
/// program  the command that started the program
inline std::filesystem::path data_folder(const char* program) {
    const std::filesystem::path beside = path_of_program(program).parent_path();
    std::error_code ignored;
    for (const std::filesystem::path& folder : {beside, beside / "share" / "ldi"})
        if (std::filesystem::is_directory(folder / "models", ignored)) return folder;
    return (beside / LDI_DATA_FROM_PROGRAM).lexically_normal();
}

/// Folders that are searched for weights that no option names.
class model_folders {
public:
    static constexpr const char* variable = "LDI_MODELS";

    /// Raises file_access if LDI_MODELS is not a folder.
    explicit model_folders(const std::filesystem::path& data) : folders_{data / "models"} {
        const char* const named = std::getenv(variable);
        if (named == nullptr || *named == '\0') return;
        std::error_code ignored;
        if (!std::filesystem::is_directory(named, ignored))
            raise(error_code::file_access, variable, "the path of a folder with weights", named);
        folders_.insert(folders_.begin(), named);
    }

    /// Returns the path of a file in the first folder that contains it; empty if none does.
    std::optional<std::filesystem::path> find(const std::string& file) const {
        std::error_code ignored;
        for (const std::filesystem::path& folder : folders_)
            if (std::filesystem::exists(folder / file, ignored)) return folder / file;
        return std::nullopt;
    }

    /// Lists the folders for messages.
    std::string text() const {
        std::string text;
        for (const std::filesystem::path& folder : folders_) text += (text.empty() ? "" : " or ") + folder.string();
        return text;
    }

private:
    std::vector<std::filesystem::path> folders_;
};

}  // namespace ldi::examples
