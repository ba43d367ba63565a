// Shared by the tests of io/: a temporary folder, files built byte by byte, and ways to damage them.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>

#include <zlib.h>
#include <tests/support/errors.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif
#ifndef LDI_SOURCE_DIR
#define LDI_SOURCE_DIR "."
#endif

namespace ldi::testing {

using byte_string = std::vector<std::byte>;

/// An empty folder that is removed with all its contents at the end of the scope.
class scratch_folder {
public:
    scratch_folder() {
        std::random_device random;
        path_ = std::filesystem::temp_directory_path() / ("ldi_test_" + std::to_string(random()) + std::to_string(random()));
        std::filesystem::create_directories(path_);
    }
    scratch_folder(const scratch_folder&) = delete;
    scratch_folder& operator=(const scratch_folder&) = delete;
    ~scratch_folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }

    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    std::size_t file_count() const {
        std::size_t count = 0;
        for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(path_)) ++count;
        return count;
    }

private:
    std::filesystem::path path_;
};

inline byte_string bytes_of(std::string_view text) {
    byte_string bytes;
    for (char c : text) bytes.push_back(static_cast<std::byte>(c));
    return bytes;
}

inline void append(byte_string& to, const byte_string& more) { to.insert(to.end(), more.begin(), more.end()); }

inline byte_string big_endian(std::uint32_t value, int size) {
    byte_string bytes;
    for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::byte>(value >> (8 * i) & 255));
    return bytes;
}

/// A smooth picture: values change by a few steps per pixel, so that JPEG preserves them.
inline image<std::uint8_t> smooth_picture(std::size_t height, std::size_t width, std::size_t channels) {
    image<std::uint8_t> picture(height, width, channels);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < channels; ++c)
                picture(y, x, c) = static_cast<std::uint8_t>(60 + (c == 0 ? 4 * x : c == 1 ? 4 * y : 2 * (x + y)) % 180);
    return picture;
}

inline int largest_difference(const image<std::uint8_t>& a, const image<std::uint8_t>& b) {
    if (!same_shape(a, b)) return 256;
    int largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(int{a.data()[i]} - int{b.data()[i]}));
    return largest;
}

// ----------------------------------------------------------------------------------------------------------------------------
// PNG

inline byte_string png_chunk(std::string_view type, const byte_string& body) {
    byte_string typed = bytes_of(type);
    append(typed, body);
    byte_string chunk = big_endian(static_cast<std::uint32_t>(body.size()), 4);
    append(chunk, typed);
    const unsigned long checksum =
        ::crc32(0, reinterpret_cast<const unsigned char*>(typed.data()), static_cast<unsigned>(typed.size()));
    append(chunk, big_endian(static_cast<std::uint32_t>(checksum), 4));
    return chunk;
}

/// A PNG file of rows as PNG stores them, without filter bytes.
///
/// color  PNG's color type: 0 gray, 2 RGB, 3 palette, 4 gray and alpha, 6 RGB and alpha
/// extra  whole chunks before the picture's data
inline byte_string png_file(std::uint32_t width, std::uint32_t height, int depth, int color, const byte_string& rows,
                            const byte_string& extra = {}) {
    byte_string file = bytes_of("\x89PNG\r\n\x1A\n");
    byte_string header = big_endian(width, 4);
    append(header, big_endian(height, 4));
    append(header, {static_cast<std::byte>(depth), static_cast<std::byte>(color), std::byte{0}, std::byte{0}, std::byte{0}});
    append(file, png_chunk("IHDR", header));
    append(file, extra);
    byte_string raw;
    const std::size_t stride = height == 0 ? 0 : rows.size() / height;
    for (std::size_t y = 0; y < height; ++y) {
        raw.push_back(std::byte{0});
        raw.insert(raw.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * stride),
                   rows.begin() + static_cast<std::ptrdiff_t>((y + 1) * stride));
    }
    uLongf size = compressBound(static_cast<uLong>(raw.size()));
    byte_string packed(size);
    compress(reinterpret_cast<unsigned char*>(packed.data()), &size, reinterpret_cast<const unsigned char*>(raw.data()),
             static_cast<uLong>(raw.size()));
    packed.resize(size);
    append(file, png_chunk("IDAT", packed));
    append(file, png_chunk("IEND", {}));
    return file;
}

/// Corrects the checksums of a damaged PNG file, so that the damage reaches the decoder.
inline byte_string with_right_checksums(byte_string file) {
    const auto number = [&](std::size_t at) {
        std::size_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::size_t>(file[at + i]);
        return value;
    };
    for (std::size_t at = 8; at + 12 <= file.size();) {
        const std::size_t length = number(at);
        if (length > file.size() - at - 12) break;
        const unsigned long checksum =
            ::crc32(0, reinterpret_cast<const unsigned char*>(file.data() + at + 4), static_cast<unsigned>(length + 4));
        const byte_string right = big_endian(static_cast<std::uint32_t>(checksum), 4);
        std::copy(right.begin(), right.end(), file.begin() + static_cast<std::ptrdiff_t>(at + 8 + length));
        at += 12 + length;
    }
    return file;
}

// ---------------------------------------------------------------------------------------------------------------------------
// EXIF

/// EXIF data as a TIFF structure with an orientation and a focal length, in either byte order.
inline byte_string exif_bytes(unsigned orientation, unsigned focal_length_35mm, bool little_endian = false) {
    const auto number = [&](std::uint32_t value, int size) {
        byte_string bytes = big_endian(value, size);
        return little_endian ? byte_string(bytes.rbegin(), bytes.rend()) : bytes;
    };
    const auto entry = [&](std::uint32_t tag, std::uint32_t format, std::uint32_t value) {
        byte_string bytes = number(tag, 2);
        append(bytes, number(format, 2));
        append(bytes, number(1, 4));
        append(bytes, format == 3 ? number(value, 2) : number(value, 4));
        if (format == 3) append(bytes, number(0, 2));
        return bytes;
    };
    byte_string tiff = bytes_of(little_endian ? "II" : "MM");
    append(tiff, number(42, 2));
    append(tiff, number(8, 4));
    append(tiff, number(2, 2));                      // the main directory: 2 entries, at byte 8
    append(tiff, entry(0x0112, 3, orientation));     // Orientation
    append(tiff, entry(0x8769, 4, 8 + 2 + 24 + 4));  // offset of the EXIF directory
    append(tiff, number(0, 4));
    append(tiff, number(1, 2));
    append(tiff, entry(0xA405, 3, focal_length_35mm));  // FocalLengthIn35mmFilm
    append(tiff, number(0, 4));
    return tiff;
}

/// Inserts EXIF data after a JPEG file's first two bytes.
inline byte_string jpeg_with_exif(const byte_string& jpeg, const byte_string& tiff) {
    byte_string file(jpeg.begin(), jpeg.begin() + 2);
    append(file, bytes_of("\xFF\xE1"));
    append(file, big_endian(static_cast<std::uint32_t>(tiff.size() + 8), 2));
    append(file, bytes_of(std::string_view("Exif\0\0", 6)));
    append(file, tiff);
    file.insert(file.end(), jpeg.begin() + 2, jpeg.end());
    return file;
}

// -------------------------------------------------------------------------------------------------------------------------
// damage

/// Returns a copy with one to eight random faults: changed bytes, a piece lost or repeated, the end truncated.
inline byte_string damaged_copy(byte_string file, std::mt19937& random) {
    const auto below = [&](std::size_t limit) { return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random); };
    for (std::size_t faults = 1 + below(8); faults > 0 && !file.empty(); --faults) {
        const auto at = file.begin() + static_cast<std::ptrdiff_t>(below(file.size()));
        const std::ptrdiff_t length = std::min<std::ptrdiff_t>(file.end() - at, static_cast<std::ptrdiff_t>(1 + below(16)));
        switch (below(16)) {
            case 0: file.erase(at, at + length); break;
            case 1: {
                const byte_string piece(at, at + length);
                file.insert(at, piece.begin(), piece.end());
                break;
            }
            case 2: file.resize(static_cast<std::size_t>(at - file.begin())); break;
            case 3: *at = std::byte{0xFF}; break;
            case 4: *at = std::byte{0}; break;
            case 5: *at ^= static_cast<std::byte>(1U << below(8)); break;
            default: *at = static_cast<std::byte>(below(256));
        }
    }
    return file;
}

}  // namespace ldi::testing
