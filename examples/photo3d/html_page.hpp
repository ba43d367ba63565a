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
            raise(error_code::file_access, file.string(), "the viewer", "no such file (examples/viewer/build.sh builds it)");
        const std::vector<std::byte> bytes = read_file(file);
        text_.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        title_ = find(file, title_marker);
        photo_ = find(file, photo_marker);
    }

    /// Returns the page with a photo in it.
    ///
    /// title     plain text
    /// photo     H x W x 3
    /// glb       the GLB file
    /// is_whole  whether surfaces continue past the photo's border, so that the page can show the whole photo
    /// snippet   HTML that shows the photo in other pages; the page offers it for copying. Empty: none
    std::string with_photo(std::string_view title, const image<std::uint8_t>& photo, std::span<const std::byte> glb,
                           bool is_whole, std::string_view snippet = {}) const;

private:
    static constexpr std::string_view title_marker = "<title>3D photo</title>", photo_marker = "<!-- the photo goes here -->";

    std::size_t find(const std::filesystem::path& file, std::string_view marker) const {
        const std::size_t position = text_.find(marker);
        if (position == std::string::npos)
            raise(error_code::invalid_data, file.string(), "the viewer",
                  "a file without " + std::string(marker) + " (examples/viewer/build.sh builds the viewer)");
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
        } else if (c == '"') {
            escaped += "&quot;";
        } else {
            escaped += c;
        }
    }
    return escaped;
}

/// Escapes the name of a file for a relative URL.
inline std::string in_url(std::string_view name) {
    static constexpr char digits[] = "0123456789ABCDEF";
    static constexpr std::string_view plain = "-._~/0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
    std::string url;
    for (const char c : name) {
        const auto code = static_cast<unsigned char>(c);
        if (plain.find(c) != std::string_view::npos) {
            url += c;
        } else {
            url += {'%', digits[code >> 4], digits[code & 15]};
        }
    }
    return url;
}

/// Encodes the photo as a JPEG of at most 512 pixels per side, which has a few tens of kilobytes.
inline std::vector<std::byte> encode_poster(const image<std::uint8_t>& photo) {
    constexpr std::size_t long_side = 512;
    constexpr int quality = 70;
    const std::size_t longer = (std::max)(photo.height(), photo.width()), shown = (std::min)(longer, long_side);
    const auto scaled = [&](std::size_t length) { return (std::max)(length * shown / longer, std::size_t{1}); };
    const serial_executor threads;
    return encode_jpeg(area_resize(photo, scaled(photo.height()), scaled(photo.width()), threads), quality);
}

/// Returns the attributes of <photo-3d> that reserve its place in a page before the photo has arrived.
inline std::string element_size(const image<std::uint8_t>& photo, bool is_whole) {
    return " width=\"" + std::to_string(photo.width()) + "\" height=\"" + std::to_string(photo.height()) + "\"" +
           (is_whole ? "" : " frame=\"crop\"");
}

/// Returns the lines of HTML that show a 3D photo in a page that lies beside the photo's files.
///
/// glb, poster  names of the files, relative to the page
inline std::string embedding_snippet(std::string_view title, const std::string& glb, const std::string& poster,
                                     const image<std::uint8_t>& photo, bool is_whole) {
    return "<script type=\"module\" src=\"photo-3d.js\"></script>\n<photo-3d src=\"" + escape_html(in_url(glb)) + "\" poster=\"" +
           escape_html(in_url(poster)) + "\"" + element_size(photo, is_whole) + " alt=\"3D photo " + escape_html(title) +
           "\"\n  style=\"display: block; aspect-ratio: " + std::to_string(photo.width()) + " / " +
           std::to_string(photo.height()) + "\"></photo-3d>\n";
}

inline std::string viewer_page::with_photo(std::string_view title, const image<std::uint8_t>& photo,
                                           std::span<const std::byte> glb, bool is_whole, std::string_view snippet) const {
    const std::size_t after_title = title_ + title_marker.size(), after_photo = photo_ + photo_marker.size();
    std::string page;
    page.reserve(text_.size() + (glb.size() + 2) / 3 * 4 + 200'000);  // otherwise, appending needs up to three times the memory
    const std::string shown = escape_html(title);
    page += text_.substr(0, title_) + "<title>" + shown + "</title>" + text_.substr(after_title, photo_ - after_title) +
            "<photo-3d standalone caption=\"" + shown + "\" alt=\"3D photo " + shown + "\"" + element_size(photo, is_whole) +
            ">\n<img slot=\"poster\" alt=\"\" src=\"data:image/jpeg;base64,";
    append_base64(page, encode_poster(photo));
    page += "\">\n</photo-3d>\n<script id=\"photo\" type=\"model/gltf-binary;base64\">";
    append_base64(page, glb);
    page += "</script>";
    if (!snippet.empty()) page += "\n<template id=\"snippet\">" + escape_html(snippet) + "</template>";
    return page += text_.substr(after_photo);
}

}  // namespace ldi::examples
