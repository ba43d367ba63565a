// Names of a batch's output files. Prevents two photos from having the same output file, even under different names.
#pragma once

#include "file_set.hpp"
#include "file_system.hpp"
#include "outputs.hpp"
#include "staging_folder.hpp"

#include <ldi/base/error.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <unordered_set>

namespace ldi::examples {

class output_names {
public:
    /// Claims an output. Raises invalid_option if the file is already claimed: by the same path, through links to it or to its
    /// folder, as a hard link, or with other capitalization in a case-insensitive folder. Also raises it for a link to a file of
    /// another type, which may be a photo of the batch.
    void claim(const std::filesystem::path& output) {
        const std::filesystem::path place = follow_links(std::filesystem::absolute(output).lexically_normal());
        std::error_code unknown;
        if (std::filesystem::is_regular_file(place, unknown) && extension_of(place) != extension_of(output))
            raise(error_code::invalid_option, output.string(), "a " + extension_of(output) + " file",
                  "a link to " + place.string());
        const bool may_be_new_in_small_letters = add(in_small_letters(place) + "/");
        bool is_new = add(place.string()) && (may_be_new_in_small_letters || !ignores_case(place.parent_path()));
        if (is_new && std::filesystem::hard_link_count(place, unknown) > 1 && !unknown) is_new = add(file_identity(place));
        if (!is_new)
            raise(error_code::invalid_option, output.string(), "a file that no other photo of the batch writes",
                  "another photo's output");
    }

private:
    bool add(const std::string& name) { return taken_.insert(std::hash<std::string>()(name)).second; }

    static std::string in_small_letters(const std::filesystem::path& place) {
        std::string name = place.filename().string();
        for (char& c : name)
            if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
        return (place.parent_path() / name).string();
    }

    /// Tests with a new temporary folder whether a folder ignores case in names.
    static bool ignores_case(const std::filesystem::path& folder) {
        const std::string name = temporary_name();
        std::error_code failed;
        if (!std::filesystem::create_directory(folder / (name + "-case.tmp"), failed)) return false;
        const bool result = std::filesystem::exists(folder / (name + "-CASE.tmp"), failed);
        std::filesystem::remove(folder / (name + "-case.tmp"), failed);
        return result;
    }

    std::unordered_set<std::size_t> taken_;  // hashes of paths
};

}  // namespace ldi::examples
