// Lists the photos of a batch (single names, folders, lists of JSON lines), and the names of their outputs.
#pragma once

#include "arguments.hpp"
#include "conversion.hpp"
#include "json_input.hpp"
#include "line_reader.hpp"
#include "messages.hpp"
#include "outputs.hpp"

#include <ldi/base/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Reads the names of a photo and its files from a line of a list: "me.jpg", or an object. Raises invalid_data.
inline photo_files read_list_line(const std::string& line, const std::string& where) {
    constexpr std::size_t shown = 200;  // bytes of rejected text in the message
    const nlohmann::json value = parse_json(line, where);
    photo_files names;
    const auto read = [&](std::filesystem::path& name, const nlohmann::json& text, const std::string& key) {
        const auto is_name = [](const std::string& given) {
            return !given.empty() && given != "-" &&
                   given.find('\0') == std::string::npos;  // the system would end the name there
        };
        if (!text.is_string() || !is_name(text.get_ref<const std::string&>()))
            raise(error_code::invalid_data, where, "the name of a file for \"" + key + "\"",
                  text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, shown));
        name = text.get_ref<const std::string&>();
    };
    const std::pair<const char*, std::filesystem::path*> known[] = {{"photo", &names.photo},
                                                                    {"depth", &names.depth},
                                                                    {"output", &names.glb},
                                                                    {"html", &names.html},
                                                                    {"report", &names.report}};
    if (!value.is_object()) {
        if (!value.is_string())
            raise(error_code::invalid_data, where, "a JSON object or string", "\"" + line.substr(0, shown) + "\"");
        read(names.photo, value, "photo");
        return names;
    }
    for (const auto& [key, text] : value.items()) {
        const auto* const found =
            std::find_if(std::begin(known), std::end(known), [&key = key](const auto& pair) { return key == pair.first; });
        if (found == std::end(known))
            raise(error_code::invalid_data, where, "a member named photo, depth, output, html or report",
                  "\"" + key.substr(0, shown) + "\"");
        read(*found->second, text, key);
    }
    if (names.photo.empty()) raise(error_code::invalid_data, where, "a member \"photo\"", "none");
    return names;
}

/// Derives missing names from the options and the photo's name. Raises invalid_option, file_access.
inline void complete_names(photo_files& names, const arguments& a) {
    const std::filesystem::path stem = names.photo.stem();
    const auto within = [&](const std::filesystem::path& folder, const char* extension) {
        return folder.empty() ? folder : folder / std::filesystem::path(stem).concat(extension);
    };
    if (names.depth.empty() && !a.depth.empty()) {
        std::error_code ignored;
        for (const char* extension : {".jpg", ".pfm", ".npy", ".png"})  // the last existing one wins
            if (std::filesystem::exists(within(a.depth, extension), ignored)) names.depth = within(a.depth, extension);
        if (names.depth.empty())
            raise(error_code::file_access, within(a.depth, ".png").string(), "a depth map, .png, .npy, .pfm or .jpg", "none");
    }
    if (names.glb.empty() && names.html.empty() && names.report.empty()) {
        names.glb = within(a.output, ".glb"), names.html = within(a.html, ".html"), names.report = within(a.report, ".json");
        if (names.glb.empty() && names.html.empty() && names.report.empty()) name_outputs(names, a.viewer);
    }
    // The extensions guarantee that no output replaces a photo of the list.
    const auto check = [](const std::filesystem::path& name, const char* extension) {
        if (!name.empty() && extension_of(name) != extension)
            raise(error_code::invalid_option, name.string(), std::string("a name that ends in ") + extension,
                  extension_of(name).empty() ? "no extension" : extension_of(name));
    };
    check(names.glb, ".glb"), check(names.html, ".html"), check(names.report, ".json");
}

/// Photos of a folder, and its other contents.
struct photo_folder {
    std::deque<std::filesystem::path> photos;
    std::vector<std::string> others;  ///< names of files and folders that are not photos

    /// Raises std::filesystem::filesystem_error.
    explicit photo_folder(const std::filesystem::path& folder) {
        std::set<std::filesystem::path> maps;  // depth maps beside the photos
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            const std::string name = entry.path().filename().string();
            if (name[0] == '.') continue;
            const std::string extension = extension_of(name);
            if (is_photo_extension(extension) && entry.is_regular_file())
                photos.push_back(entry.path());
            else if (extension != ".glb" && extension != ".html")  // skips outputs of an earlier run
                others.push_back(entry.is_directory() ? name + "/" : name);
        }
        std::sort(photos.begin(), photos.end()), std::sort(others.begin(), others.end());
        for (const std::filesystem::path& photo : photos) maps.insert(depth_map_beside(photo));
        const auto is_map = [&](const std::filesystem::path& name) { return maps.count(name) > 0; };
        photos.erase(std::remove_if(photos.begin(), photos.end(), is_map), photos.end());
        others.erase(std::remove_if(others.begin(), others.end(), [&](const std::string& name) { return is_map(folder / name); }),
                     others.end());
    }

private:
    static bool is_photo_extension(const std::string& extension) {
        static const std::set<std::string> known{".jpg",  ".jpeg", ".jpe", ".png",  ".heic", ".heif", ".hif",
                                                 ".avif", ".webp", ".tif", ".tiff", ".gif",  ".bmp"};
        return known.count(extension) > 0;
    }
};

/// All photos of a batch, in the order in which the command line and the lists name them.
class batch_list {
public:
    struct item {
        photo_files names;
        std::optional<failure> failed;  ///< for entries that are not valid names of a photo
    };

    explicit batch_list(const arguments& a) : sources_(a.photos.begin(), a.photos.end()), is_quiet_(a.quiet) {}

    /// Counts the photos. Empty if the number is unknown in advance: a list comes from a pipe, or a folder can't be read.
    static std::optional<std::size_t> count(const arguments& a) try {
        std::size_t count = 0;
        for (const std::filesystem::path& source : a.photos) {
            if (is_list(source)) {
                if (!std::filesystem::is_regular_file(source)) return std::nullopt;  // reading a pipe would empty it
                std::ifstream list(source);
                for (line_reader lines(list); lines.next();) count += lines.is_blank() ? 0U : 1U;
            } else {
                count += std::filesystem::is_directory(source) ? photo_folder(source).photos.size() : 1;
            }
        }
        return count;
    } catch (const std::filesystem::filesystem_error&) {
        return std::nullopt;
    }

    /// Returns the next photo; empty at the end.
    std::optional<item> next() {
        for (;;) {
            if (!photos_.empty()) {
                item found{{photos_.front(), {}, {}, {}, {}, false}, std::nullopt};
                photos_.pop_front();
                return found;
            }
            if (lines_) {
                if (std::optional<item> found = next_of_list()) return found;
                lines_.reset();
            }
            if (sources_.empty()) return std::nullopt;
            source_ = std::move(sources_.front());
            sources_.pop_front();
            if (std::optional<item> failed = open()) return failed;
        }
    }

    /// Number of files and folders, in the folders read so far, that are not photos.
    std::size_t left_out() const { return left_out_; }

private:
    static bool is_list(const std::filesystem::path& source) { return is_standard(source) || extension_of(source) == ".jsonl"; }

    item failed_item() const { return {{source_, {}, {}, {}, {}, false}, describe_failure()}; }

    void open_folder() {
        photo_folder folder(source_);
        photos_ = std::move(folder.photos);
        left_out_ += folder.others.size();
        if (is_quiet_ || folder.others.empty()) return;
        constexpr std::size_t max_named = 20;
        std::string names;
        for (std::size_t i = 0; i < std::min(folder.others.size(), max_named); ++i)
            names += (i == 0 ? "" : ", ") + folder.others[i];
        if (folder.others.size() > max_named) names += " and " + std::to_string(folder.others.size() - max_named) + " more";
        say(source_.string() + ": " + std::to_string(folder.others.size()) +
            " left out, because they are not files with a photo's extension: " + names);
    }

    /// Opens `source_`. Returns nothing, or an item with the error if the source can't be read.
    std::optional<item> open() try {
        std::error_code ignored;
        if (is_standard(source_)) {
            lines_.emplace(std::cin);
        } else if (std::filesystem::is_directory(source_, ignored)) {
            open_folder();
        } else if (is_list(source_)) {
            errno = 0;
            file_ = std::ifstream(source_);
            if (!file_) raise_system_error(last_error(), source_, "a readable list");
            lines_.emplace(file_);
        } else {
            photos_.push_back(source_);
        }
        return std::nullopt;
    } catch (...) {
        return failed_item();
    }

    std::optional<item> next_of_list() try {
        while (lines_->next()) {
            if (lines_->is_blank()) continue;
            const std::string where = name_of_input(source_) + ", line " + std::to_string(lines_->number());
            if (lines_->is_too_long())
                raise(error_code::too_large, where, "a line of at most " + std::to_string(line_reader::max_bytes) + " bytes",
                      "more");
            return item{read_list_line(lines_->text(), where), std::nullopt};
        }
        return std::nullopt;
    } catch (const std::system_error&) {
        lines_.reset();  // the source can't be read further
        return failed_item();
    } catch (...) {
        return failed_item();
    }

    std::deque<std::filesystem::path> sources_, photos_;
    std::filesystem::path source_;
    std::ifstream file_;
    std::optional<line_reader> lines_;
    std::size_t left_out_ = 0;
    bool is_quiet_;
};

/// Rejects options that apply only to single photos, and creates the folders that options name. Raises invalid_option,
/// file_access, unavailable.
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
    std::error_code failed, ignored;
    for (const std::filesystem::path& folder : {a.output, a.html, a.report}) {
        if (folder.empty()) continue;
        if (is_standard(folder))
            raise(error_code::invalid_option, "-", "the name of a folder, as --batch requires", "standard output");
        std::filesystem::create_directories(folder, failed);
        if (!std::filesystem::is_directory(folder, ignored)) {
            if (std::filesystem::exists(folder, ignored))
                raise(error_code::file_access, folder.string(), "a folder, as --batch requires", "a file");
            raise_system_error(failed.value(), folder, "a folder, as --batch requires");
        }
    }
    if (!a.depth.empty() && a.depth != "none" && !std::filesystem::is_directory(a.depth, ignored))
        raise(error_code::file_access, a.depth.string(), "a folder of depth maps, as --batch requires",
              std::filesystem::exists(a.depth, ignored) ? "a file" : "no such folder");
}

}  // namespace ldi::examples
