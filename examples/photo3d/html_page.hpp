// Writes a 3D photo as one HTML file: the viewer (examples/viewer) with the GLB inside, and a small picture to show during
// loading.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/kernels/area_resize.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// The viewer as a page without a photo, built by examples/viewer/build.sh.
///
/// Errors: file_access; invalid_data if the file is another page.
class viewer_page {
public:
    explicit viewer_page(const std::filesystem::path& file) {
        std::error_code ignored;
        if (!std::filesystem::exists(file, ignored))
            raise(error_code::file_access, file.string(), "the viewer, which examples/viewer/build.sh builds", "no such file");
        const std::vector<std::byte> bytes = read_file(file);
        text_.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        title_ = find(file, title_marker);
        photo_ = find(file, photo_marker);
    }

    /// Returns the page with a photo in it.
    ///
    /// title     plain text
    /// photo     H x W x 3
    /// is_whole  surfaces go on past the photo's border: the page hides none of it
    std::string with_photo(std::string_view title, const image<std::uint8_t>& photo, std::span<const std::byte> glb,
                           bool is_whole) const;

private:
    static constexpr std::string_view title_marker = "<title>3D photo</title>", photo_marker = "<!-- the photo goes here -->";

    std::size_t find(const std::filesystem::path& file, std::string_view marker) const {
        const std::size_t position = text_.find(marker);
        if (position == std::string::npos)
            raise(error_code::invalid_data, file.string(), "the viewer, which examples/viewer/build.sh builds",
                  "a file without " + std::string(marker));
        return position;
    }

    std::string text_;
    std::size_t title_ = 0, photo_ = 0;  // positions of the markers; the title comes first
};

inline void append_base64(std::string& text, std::span<const std::byte> bytes) {
    static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = (std::min)(bytes.size() - i, std::size_t{3});
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = (group << 8) | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[(group >> (18 - 6 * k)) & 63] : '=';
    }
}

inline std::string escape_html(std::string_view text) {
    std::string escaped;
    for (const char c : text) {
        if (c == '&') {
            escaped += "&amp;";
        } else if (c == '<') {
            escaped += "&lt;";
        } else {
            escaped += c;
        }
    }
    return escaped;
}

/// Encodes the photo as a JPEG of some ten kilobytes.
inline std::vector<std::byte> encode_poster(const image<std::uint8_t>& photo) {
    constexpr std::size_t long_side = 512;
    constexpr int quality = 70;
    const std::size_t longer = (std::max)(photo.height(), photo.width()), shown = (std::min)(longer, long_side);
    const auto scaled = [&](std::size_t length) { return (std::max)(length * shown / longer, std::size_t{1}); };
    const serial_executor threads;
    return encode_jpeg(area_resize(photo, scaled(photo.height()), scaled(photo.width()), threads), quality);
}

inline std::string viewer_page::with_photo(std::string_view title, const image<std::uint8_t>& photo,
                                           std::span<const std::byte> glb, bool is_whole) const {
    const std::size_t after_title = title_ + title_marker.size(), after_photo = photo_ + photo_marker.size();
    std::string page;
    page.reserve(text_.size() + (glb.size() + 2) / 3 * 4 + 200'000);  // growing, it would need three times its memory
    page +=
        text_.substr(0, title_) + "<title>" + escape_html(title) + "</title>" + text_.substr(after_title, photo_ - after_title);
    page += "<style>:root { --photo-width: " + std::to_string(photo.width()) +
            "; --photo-height: " + std::to_string(photo.height()) + (is_whole ? "; --hidden-border: 0" : "") +
            " }</style>\n<img id=\"poster\" alt=\"\" src=\"data:image/jpeg;base64,";
    append_base64(page, encode_poster(photo));
    page += "\">\n<script id=\"photo\" type=\"model/gltf-binary;base64\">";
    append_base64(page, glb);
    page += "</script>";
    return page += text_.substr(after_photo);
}

}  // namespace ldi::examples
