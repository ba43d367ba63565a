// Writes the page of a batch: all its 3D photos as elements (examples/viewer), and its failures.
#pragma once

#include "conversion.hpp"
#include "html_page.hpp"
#include "outputs.hpp"

#include <ldi/base/error.hpp>
#include <ldi/io/file.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace ldi::examples {

/// The gallery page of a batch. Its links are relative, so the page and its files can be moved together.
class gallery {
public:
    /// page    the file to write; the constructor makes a folder beside it for small pictures of the photos
    /// viewer  the viewer's page; gallery.html, the gallery's page without photos, must lie beside it
    ///
    /// Errors: invalid_option, file_access; invalid_data if the viewer is of another version.
    gallery(const std::filesystem::path& page, const std::filesystem::path& viewer)
        : page_(page), posters_(page.parent_path() / std::filesystem::path(page.stem()).concat("_posters")) {
        check_page_name(page);
        files_.claim(page);
        const std::filesystem::path file = viewer.parent_path() / "gallery.html";
        const std::vector<std::byte> bytes = read_file(file);
        text_.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        position_ = text_.find(marker);
        if (position_ == std::string::npos)
            raise(error_code::invalid_data, file.string(), "the gallery's page",
                  "a file without " + std::string(marker) + " (examples/viewer/build.sh builds the page)");
        std::error_code failure;
        std::filesystem::create_directories(posters_, failure);
        if (failure) raise_system_error(failure.value(), posters_, "a folder that can be created");
    }

    /// Sets the name of the small picture that the page shows, and the name of the GLB file if it has none. Raises
    /// invalid_option.
    void complete_names(photo_files& names) const {
        if (names.glb.empty()) names.glb = std::filesystem::path(names.html).replace_extension(".glb");
        if (!names.glb.has_filename())
            raise(error_code::invalid_option, "--gallery", "a name for the GLB file of each photo", "none (use -o or --html)");
        std::string name;  // differs for every GLB file
        for (const char c : seen(std::filesystem::path(names.glb).replace_extension()))
            name += c == '/' ? "_-" : c == '_' ? "__" : std::string(1, c);
        names.poster = posters_ / (name + ".jpg");
    }

    /// Adds a photo, from any thread.
    ///
    /// index  place in the batch
    /// error  message if the conversion failed; otherwise empty
    void add(std::size_t index, const photo_files& names, const std::string& error) {
        nlohmann::ordered_json entry{{"title", names.photo.filename().string()}};
        if (!error.empty()) {
            entry["error"] = error;
        } else {
            entry["src"] = in_url(seen(names.glb));
            entry["poster"] = in_url(seen(names.poster));
            if (!names.html.empty()) entry["page"] = in_url(seen(names.html));
        }
        const std::lock_guard lock(mutex_);
        entries_[index] = std::move(entry);
    }

    /// Writes the page. Raises file_access, unavailable.
    void write() {
        nlohmann::ordered_json list = nlohmann::ordered_json::array();
        for (const auto& [index, entry] : entries_) list.push_back(entry);
        std::string json;
        for (const char c : list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
            json += c == '<' ? "\\u003c" : std::string(1, c);  // so that no text can end the script element
        std::string page = text_;
        page.replace(position_, marker.size(), "<script id=\"photos\" type=\"application/json\">" + json + "</script>");
        files_.write(page_, page);
        files_.commit();
    }

private:
    static constexpr std::string_view marker = "<!-- the photos go here -->";

    /// Returns the name of a file relative to the page.
    std::string seen(const std::filesystem::path& file) const {
        const auto whole = [](const std::filesystem::path& name) { return std::filesystem::absolute(name).lexically_normal(); };
        return whole(file).lexically_proximate(whole(page_).parent_path()).generic_string();
    }

    std::filesystem::path page_, posters_;
    output_files files_;
    std::string text_;
    std::size_t position_ = 0;
    std::mutex mutex_;
    std::map<std::size_t, nlohmann::ordered_json> entries_;
};

}  // namespace ldi::examples
