// Header data of a picture file, and functions that recognize formats and read numbers from bytes.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/formats/picture_formats.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Data from the header of a picture file.
struct picture_header {
    picture_format format = picture_format::jpeg;
    std::size_t width = 0, height = 0;              ///< stored size in pixels
    std::size_t bits = 8;                           ///< bits per sample, 8 or 16; PNG's 1, 2 and 4 are decoded to 8
    std::size_t memory_per_pixel = 0;               ///< upper bound on the decoder's memory in bytes per pixel
    double more_memory = 0;                         ///< additional memory of the decoder in bytes for the whole picture
    std::size_t max_growth = 0;                     ///< maximum size in bytes to which a buffer of the PNG decoder may grow
    std::size_t scanned_channels = 0;               ///< JPEG only: number of channels in each scan, summed over all scans
    std::span<const std::byte> exif;                ///< a TIFF structure; empty if absent
    std::span<const std::byte> profile_chunk;       ///< PNG's iCCP; empty if absent
    buffer<std::span<const std::byte>> extensions;  ///< JPEG's APP1 and APP2 segments, in order
    bool has_alpha = false;                         ///< whether the picture has alpha; WebP only
    std::size_t end = 0;  ///< JPEG only: offset of the first byte after the picture; phones append more pictures there
};

namespace detail {

inline unsigned byte_at(std::span<const std::byte> bytes, std::size_t i) { return std::to_integer<unsigned>(bytes[i]); }

inline std::uint32_t little_endian_16(std::span<const std::byte> bytes, std::size_t i) {
    return byte_at(bytes, i) | byte_at(bytes, i + 1) << 8;
}

inline std::uint32_t little_endian_32(std::span<const std::byte> bytes, std::size_t i) {
    return little_endian_16(bytes, i) | little_endian_16(bytes, i + 2) << 16;
}

inline std::uint32_t big_endian_16(std::span<const std::byte> bytes, std::size_t i) {
    return byte_at(bytes, i) << 8 | byte_at(bytes, i + 1);
}

inline std::uint32_t big_endian_32(std::span<const std::byte> bytes, std::size_t i) {
    return big_endian_16(bytes, i) << 16 | big_endian_16(bytes, i + 2);
}

/// Whether `text` occurs at offset i.
inline bool has_text(std::span<const std::byte> bytes, std::size_t i, std::string_view text) {
    return bytes.size() >= i + text.size() && std::memcmp(bytes.data() + i, text.data(), text.size()) == 0;
}

inline bool is_jpeg(std::span<const std::byte> bytes) { return has_text(bytes, 0, "\xFF\xD8\xFF"); }
inline bool is_gif(std::span<const std::byte> bytes) { return has_text(bytes, 0, "GIF87a") || has_text(bytes, 0, "GIF89a"); }
inline bool is_webp(std::span<const std::byte> bytes) { return has_text(bytes, 0, "RIFF") && has_text(bytes, 8, "WEBP"); }
inline bool is_png(std::span<const std::byte> bytes) { return has_text(bytes, 0, "\x89PNG\r\n\x1A\n"); }

/// Whether the file is a BMP. Many text files start with the letters BM, so this function also requires a DIB header of less than
/// 256 bytes.
inline bool is_bmp(std::span<const std::byte> bytes) {
    return has_text(bytes, 0, "BM") && bytes.size() >= 18 && byte_at(bytes, 15) == 0 && byte_at(bytes, 16) == 0 &&
           byte_at(bytes, 17) == 0;
}

inline bool is_tiff(std::span<const std::byte> bytes) {
    using namespace std::string_view_literals;
    return has_text(bytes, 0, "II*\0"sv) || has_text(bytes, 0, "MM\0*"sv) || has_text(bytes, 0, "II+\0"sv) ||
           has_text(bytes, 0, "MM\0+"sv);
}

/// Whether the file's brands declare it as HEIC or AVIF.
inline bool is_heif(std::span<const std::byte> bytes) {
    if (bytes.size() < 16 || !has_text(bytes, 4, "ftyp")) return false;
    const std::size_t end = (std::min)(std::size_t{big_endian_32(bytes, 0)}, (std::min)(bytes.size(), std::size_t{256}));
    for (std::size_t at = 8; at + 4 <= end; at += at == 8 ? 8 : 4)
        for (const char* brand : {"heic", "heix", "heim", "heis", "hevc", "mif1", "msf1", "avif", "avis"})
            if (has_text(bytes, at, brand)) return true;
    return false;
}

}  // namespace detail

/// Determines the format of a file from its first bytes and describes it for error messages, such as "a GIF file".
inline std::string describe_format(std::span<const std::byte> bytes) {
    struct recognized_format {
        bool (*is)(std::span<const std::byte>);
        std::string_view name;
    };
    struct signature {
        std::size_t offset;
        std::string_view text, name;
    };
    using namespace std::string_view_literals;
    // The functions that also select the decoder. A message can therefore never state the same format as expected and as found.
    static constexpr recognized_format recognized[] = {
        {detail::is_jpeg, "a JPEG file"sv},         {detail::is_png, "a PNG file"sv},
        {detail::is_gif, "a GIF file"sv},           {detail::is_webp, "a WebP file"sv},
        {detail::is_bmp, "a BMP file"sv},           {detail::is_tiff, "a TIFF or raw camera file"sv},
        {detail::is_heif, "a HEIC or AVIF file"sv},
    };
    static constexpr signature signatures[] = {
        {4, "ftypavi"sv, "a damaged AVIF file"},
        {4, "ftyphe"sv, "a damaged HEIC file"},
        {4, "ftypm"sv, "an MP4 or damaged HEIC file"},
        {4, "ftyp"sv, "a video file"},
        {4, "JXL "sv, "a JPEG XL file"},
        {0, "\xFF\x0A"sv, "a JPEG XL file"},
        {4, "jP  "sv, "a JPEG 2000 file"},
        {0, "\xFF\x4F\xFF\x51"sv, "a JPEG 2000 file"},
        {0, "8BPS"sv, "a Photoshop file"},
        {0, "\x76\x2F\x31\x01"sv, "an OpenEXR file"},
        {0, "#?RADIANCE"sv, "a Radiance HDR file"},
        {0, "PF"sv, "a color PFM file"},
        {0, "Pf"sv, "a PFM file"},
        {0, "\x93NUMPY"sv, "an NPY file"},
        {0, "%PDF"sv, "a PDF file"},
        {0, "PK\x03\x04"sv, "a ZIP archive"},
        {0, "glTF"sv, "a GLB file"},
    };
    if (bytes.empty()) return "an empty file";
    for (const recognized_format& f : recognized)
        if (f.is(bytes)) return std::string(f.name);
    for (const signature& s : signatures)
        if (detail::has_text(bytes, s.offset, s.text)) return std::string(s.name);
    return std::to_string(bytes.size()) + " bytes of an unknown format";
}

namespace detail {

/// Raises the error for a damaged file.
[[noreturn]] inline void damaged(picture_format format, const std::string& where, const std::string& found) {
    static constexpr std::array<const char*, picture_format_names.size()> names = {"JPEG", "PNG",  "GIF", "BMP", "HEIC or AVIF",
                                                                                   "WebP", "TIFF", "PFM", "NPY"};
    raise(error_code::invalid_data, where, std::string("an undamaged ") + names[static_cast<std::size_t>(format)] + " file",
          found);
}

}  // namespace detail

}}  // namespace ldi
