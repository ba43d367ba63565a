// The photos of a batch: named one by one, all of a folder, or in lists of JSON lines, and the names of what each becomes.
#pragma once

#include "arguments.hpp"
#include "conversion.hpp"
#include "json_input.hpp"
#include "messages.hpp"
#include "outputs.hpp"

#include <ldi/base/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <istream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace ldi::examples {

/// The photo and its files as a line of a list names them: "me.jpg", or an object. Raises invalid_data.
inline photo_files read_list_line(const std::string& line, const std::string& where) {
    const nlohmann::json value = parse_json(line, where);
    photo_files names;
    const auto read = [&](std::filesystem::path& name, const nlohmann::json& text, const std::string& key) {
        if (!text.is_string() || text.get_ref<const std::string&>().empty() || text == "-")
            raise(error_code::invalid_data, where, "the name of a file for \"" + key + "\"",
                  text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, 200));
        name = text.get_ref<const std::string&>();
    };
    const std::pair<const char*, std::filesystem::path*> known[] = {{"photo", &names.photo},
                                                                    {"depth", &names.depth},
                                                                    {"output", &names.glb},
                                                                    {"html", &names.html},
                                                                    {"report", &names.report}};
    if (!value.is_object()) {
        if (!value.is_string())
            raise(error_code::invalid_data, where, "an object or a text in JSON", "\"" + line.substr(0, 200) + "\"");
        read(names.photo, value, "photo");
        return names;
    }
    for (const auto& [key, text] : value.items()) {
        const auto* const found =
            std::find_if(std::begin(known), std::end(known), [&key = key](const auto& pair) { return key == pair.first; });
        if (found == std::end(known))
            raise(error_code::invalid_data, where, "photo, depth, output, html or report", "\"" + key + "\"");
        read(*found->second, text, key);
    }
    if (names.photo.empty()) raise(error_code::invalid_data, where, "a \"photo\"", "none");
    return names;
}

/// Names what options and the photo's name leave to be named. Raises invalid_option, file_access.
inline void complete_names(photo_files& names, const arguments& a) {
    const std::filesystem::path stem = names.photo.stem();
    const auto within = [&](const std::filesystem::path& folder, const char* extension) {
        return folder.empty() ? folder : folder / std::filesystem::path(stem).concat(extension);
    };
    if (names.depth.empty() && !a.depth.empty()) {
        std::error_code ignored;
        for (const char* extension : {".jpg", ".pfm", ".npy", ".png"})  // the last wins
            if (std::filesystem::exists(within(a.depth, extension), ignored)) names.depth = within(a.depth, extension);
        if (names.depth.empty())
            raise(error_code::file_access, within(a.depth, ".png").string(), "a depth map, .png, .npy, .pfm or .jpg", "none");
    }
    if (names.glb.empty() && names.html.empty() && names.report.empty()) {
        names.glb = within(a.output, ".glb"), names.html = within(a.html, ".html"), names.report = within(a.report, ".json");
        if (names.glb.empty() && names.html.empty() && names.report.empty()) name_outputs(names, a.viewer);
    }
    // No photo of the list is taken for an output, whatever is in the list.
    const auto check = [](const std::filesystem::path& name, const char* extension) {
        if (!name.empty() && extension_of(name) != extension)
            raise(error_code::invalid_option, name.string(), std::string("a name that ends in ") + extension, "another");
    };
    check(names.glb, ".glb"), check(names.html, ".html"), check(names.report, ".json");
}

/// All photos in the order in which they are named.
class batch_list {
public:
    struct item {
        photo_files names;
        std::optional<failure> failed;  ///< for what can't be read as a photo's names
    };

    explicit batch_list(const arguments& a) : sources_(a.photos.begin(), a.photos.end()) {}

    /// Their number, where it is known before the last is read.
    static std::optional<std::size_t> count(const arguments& a) try {
        std::size_t count = 0;
        for (const std::filesystem::path& source : a.photos) {
            if (is_list(source)) {
                if (!std::filesystem::is_regular_file(source)) return std::nullopt;  // reading a pipe empties it
                std::ifstream list(source);
                for (std::string line; std::getline(list, line);) count += is_blank(line) ? 0U : 1U;
            } else {
                count += std::filesystem::is_directory(source) ? photos_in(source).size() : 1;
            }
        }
        return count;
    } catch (const std::filesystem::filesystem_error&) {
        return std::nullopt;
    }

    /// The next one; none at the end.
    std::optional<item> next() {
        for (;;) {
            if (!photos_.empty()) {
                item found{{photos_.front(), {}, {}, {}, {}, false}, std::nullopt};
                photos_.pop_front();
                return found;
            }
            if (list_ != nullptr) {
                if (std::optional<item> found = next_of_list()) return found;
                list_ = nullptr;
            }
            if (sources_.empty()) return std::nullopt;
            source_ = std::move(sources_.front());
            sources_.pop_front();
            if (std::optional<item> failed = open()) return failed;
        }
    }

private:
    static bool is_list(const std::filesystem::path& source) { return is_standard(source) || extension_of(source) == ".jsonl"; }
    static bool is_blank(const std::string& line) { return line.find_first_not_of(" \t\r") == std::string::npos; }

    static std::deque<std::filesystem::path> photos_in(const std::filesystem::path& folder) {
        std::deque<std::filesystem::path> photos;
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            const std::string extension = extension_of(entry.path());
            const bool is_photo = extension == ".jpg" || extension == ".jpeg" || extension == ".png";
            if (is_photo && entry.path().filename().native()[0] != '.' && entry.is_regular_file()) photos.push_back(entry.path());
        }
        std::sort(photos.begin(), photos.end());
        std::set<std::filesystem::path> maps;  // of photos beside them
        for (const std::filesystem::path& photo : photos) maps.insert(depth_map_beside(photo));
        photos.erase(std::remove_if(photos.begin(), photos.end(), [&](const auto& photo) { return maps.count(photo) > 0; }),
                     photos.end());
        return photos;
    }

    item failed_item() const { return {{source_, {}, {}, {}, {}, false}, describe_failure()}; }

    /// Returns an item only where the source can't be read.
    std::optional<item> open() try {
        line_ = 0;
        std::error_code ignored;
        if (is_standard(source_)) {
            list_ = &std::cin;
        } else if (std::filesystem::is_directory(source_, ignored)) {
            photos_ = photos_in(source_);
        } else if (is_list(source_)) {
            file_ = std::ifstream(source_);
            if (!file_) detail::raise_system_error(detail::last_error(), source_, "a readable list");
            list_ = &file_;
        } else {
            photos_.push_back(source_);
        }
        return std::nullopt;
    } catch (...) {
        return failed_item();
    }

    std::optional<item> next_of_list() try {
        for (std::string line; std::getline(*list_, line);) {
            ++line_;
            if (is_blank(line)) continue;
            return item{read_list_line(line, name_of_input(source_) + ", line " + std::to_string(line_)), std::nullopt};
        }
        return std::nullopt;
    } catch (...) {
        return failed_item();
    }

    std::deque<std::filesystem::path> sources_, photos_;
    std::filesystem::path source_;
    std::ifstream file_;
    std::istream* list_ = nullptr;
    std::size_t line_ = 0;
};

/// Refuses options that are for one photo, and makes the folders that are named.
inline void check_batch_options(const arguments& a) {
    const auto refuse = [](const std::string& option) {
        raise(error_code::invalid_option, option, "one photo, without --batch", "a batch");
    };
    if (!a.stages.empty()) refuse("--stages");
    if (!a.video.output.empty()) refuse("--video");
    if (!a.video.depth_map.empty()) refuse("--depth-map");
    if (!a.stereo_image.empty()) refuse("--stereo-image");
    if (!a.usdz.empty()) refuse("--usdz");
    check_compression(a.compression);
    std::error_code failed;
    for (const std::filesystem::path& folder : {a.output, a.html, a.report}) {
        if (folder.empty()) continue;
        if (is_standard(folder)) raise(error_code::invalid_option, "-", "the name of a folder, with --batch", "standard output");
        std::filesystem::create_directories(folder, failed);
        if (!std::filesystem::is_directory(folder)) {
            if (failed) detail::raise_system_error(failed.value(), folder, "a folder, with --batch");
            raise(error_code::file_access, folder.string(), "a folder, with --batch", "a file");
        }
    }
    if (!a.depth.empty() && a.depth != "none" && !std::filesystem::is_directory(a.depth, failed))
        raise(error_code::file_access, a.depth.string(), "a folder of depth maps, with --batch", "none");
}

}  // namespace ldi::examples
