// Facts about a picture file, read from its own bytes before anything is decoded or allocated: format, size, bit depth, the place
// of its EXIF data, and whether it is complete. The decoder behind it (stb_image) checks neither checksums nor, in a JPEG, that
// all of the picture is there; these functions do.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/formats/detail/checksums.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace ldi::inline LDI_CONFIGURATION::detail {

enum class picture_format { jpeg, png };

/// The facts of a complete JPEG or PNG file.
struct picture_header {
    picture_format format = picture_format::jpeg;
    std::size_t width = 0, height = 0;              ///< as stored, in pixels
    std::size_t bits = 8;                           ///< of a sample: 8 or 16; PNG's 1, 2 and 4 are decoded to 8
    std::size_t memory_per_pixel = 0;               ///< bytes that decoding takes, at most
    std::size_t scanned_channels = 0;               ///< how often decoding passes through the picture, counted for each channel
    std::span<const std::byte> exif;                ///< a TIFF structure; empty if there is none
    std::span<const std::byte> profile_chunk;       ///< PNG's iCCP; empty if there is none
    buffer<std::span<const std::byte>> extensions;  ///< JPEG's APP1 and APP2 segments, in their order
    std::size_t end = 0;                            ///< behind the picture: phones append others to a JPEG file
};

inline unsigned byte_at(std::span<const std::byte> bytes, std::size_t i) { return std::to_integer<unsigned>(bytes[i]); }

inline std::uint32_t big_endian_16(std::span<const std::byte> bytes, std::size_t i) {
    return byte_at(bytes, i) << 8 | byte_at(bytes, i + 1);
}

inline std::uint32_t big_endian_32(std::span<const std::byte> bytes, std::size_t i) {
    return big_endian_16(bytes, i) << 16 | big_endian_16(bytes, i + 2);
}

/// Whether `text` stands at offset i.
inline bool has_text(std::span<const std::byte> bytes, std::size_t i, std::string_view text) {
    return bytes.size() >= i + text.size() && std::memcmp(bytes.data() + i, text.data(), text.size()) == 0;
}

inline bool is_jpeg(std::span<const std::byte> bytes) { return has_text(bytes, 0, "\xFF\xD8\xFF"); }
inline bool is_webp(std::span<const std::byte> bytes) { return has_text(bytes, 0, "RIFF") && has_text(bytes, 8, "WEBP"); }
inline bool is_png(std::span<const std::byte> bytes) { return has_text(bytes, 0, "\x89PNG\r\n\x1A\n"); }

inline bool is_tiff(std::span<const std::byte> bytes) {
    using namespace std::string_view_literals;
    return has_text(bytes, 0, "II*\0"sv) || has_text(bytes, 0, "MM\0*"sv) || has_text(bytes, 0, "II+\0"sv) ||
           has_text(bytes, 0, "MM\0+"sv);
}

/// Whether it is HEIC or AVIF, by the brands that a file says it follows.
inline bool is_heif(std::span<const std::byte> bytes) {
    if (bytes.size() < 16 || !has_text(bytes, 4, "ftyp")) return false;
    const std::size_t end = (std::min)(std::size_t{big_endian_32(bytes, 0)}, (std::min)(bytes.size(), std::size_t{256}));
    for (std::size_t at = 8; at + 4 <= end; at += at == 8 ? 8 : 4)
        for (const char* brand : {"heic", "heix", "heim", "heis", "hevc", "mif1", "msf1", "avif", "avis"})
            if (has_text(bytes, at, brand)) return true;
    return false;
}

/// A name for what the first bytes say, as error messages need it: "a GIF file".
inline std::string describe_format(std::span<const std::byte> bytes) {
    struct signature {
        std::size_t offset;
        std::string_view text, name;
    };
    using namespace std::string_view_literals;
    static constexpr signature signatures[] = {
        {0, "\xFF\xD8\xFF"sv, "a JPEG file"},
        {0, "\x89PNG\r\n\x1A\n"sv, "a PNG file"},
        {0, "GIF8"sv, "a GIF file"},
        {8, "WEBP"sv, "a WebP file"},
        {4, "ftypavif"sv, "an AVIF file"},
        {4, "ftypavis"sv, "an AVIF file"},
        {4, "ftyphe"sv, "a HEIC file"},
        {4, "ftypm"sv, "a HEIC or MP4 file"},
        {4, "ftyp"sv, "a video file"},
        {4, "JXL "sv, "a JPEG XL file"},
        {0, "\xFF\x0A"sv, "a JPEG XL file"},
        {4, "jP  "sv, "a JPEG 2000 file"},
        {0, "\xFF\x4F\xFF\x51"sv, "a JPEG 2000 file"},
        {0, "II*\0"sv, "a TIFF or raw camera file"},
        {0, "MM\0*"sv, "a TIFF or raw camera file"},
        {0, "8BPS"sv, "a Photoshop file"},
        {0, "BM"sv, "a BMP file"},
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
    for (const signature& s : signatures)
        if (has_text(bytes, s.offset, s.text)) return std::string(s.name);
    return std::to_string(bytes.size()) + " bytes of an unknown format";
}

/// Raises the error for a damaged file.
[[noreturn]] inline void damaged(picture_format format, const std::string& where, const std::string& found) {
    raise(error_code::invalid_data, where, format == picture_format::jpeg ? "an undamaged JPEG file" : "an undamaged PNG file",
          found);
}

/// Whether the Huffman tables of a segment have no more codes than there are bytes. stb_image 2.27 writes beyond its tables if
/// not.
inline bool are_huffman_tables(std::span<const std::byte> body) {
    while (!body.empty()) {
        if (body.size() < 17) return false;
        std::size_t codes = 0;
        for (std::size_t i = 1; i <= 16; ++i) codes += byte_at(body, i);
        if (codes > 256 || body.size() < 17 + codes) return false;
        body = body.subspan(17 + codes);
    }
    return true;
}

/// Walks the segments of a JPEG file up to the end of its first picture.
class jpeg_header_reader {
public:
    jpeg_header_reader(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {
        header_.format = picture_format::jpeg;
    }

    picture_header read() {
        for (std::size_t at = 2;;) {
            at = find_marker(at);
            if (at + 1 >= bytes_.size()) broken("a file that is cut off after " + std::to_string(bytes_.size()) + " bytes");
            const unsigned marker = byte_at(bytes_, at + 1);
            at += 2;
            header_.end = at;
            if (marker == 0xD9) break;
            if (at + 2 > bytes_.size()) broken("a segment that is cut off");
            const std::size_t length = big_endian_16(bytes_, at);
            if (length < 2 || at + length > bytes_.size()) broken("a segment that is cut off");
            read_segment(marker, bytes_.subspan(at + 2, length - 2));
            at += length;
        }
        if (components_ == 0 || !unscanned_.empty()) broken("a file without a picture, or with only some of its channels");
        // Without Adobe's marker nothing says whether 0 or 255 is full ink, nor whether it is ink at all.
        if (components_ == 4 && !adobe_) unsupported("four channels that no Adobe marker explains");
        // A block of at most 256 pixels of one channel takes at least a bit.
        if (header_.width * header_.height / 2048 > bytes_.size())
            broken(std::to_string(header_.width) + " x " + std::to_string(header_.height) + " pixels in " +
                   std::to_string(bytes_.size()) + " bytes");
        return header_;
    }

private:
    [[noreturn]] void broken(const std::string& found) const { damaged(picture_format::jpeg, where_, found); }
    [[noreturn]] void unsupported(const std::string& found) const {
        raise(error_code::unsupported, where_, "a JPEG file with 8-bit gray, YCbCr, RGB or Adobe CMYK colors", found);
    }

    /// The first marker at `at` or after it, or the end of the file. Cameras leave stray bytes between segments; inside a scan,
    /// FF 00 is data and FF D0 to FF D7 are restarts.
    std::size_t find_marker(std::size_t at) const {
        while (at + 1 < bytes_.size()) {
            const void* const next = std::memchr(bytes_.data() + at, 0xFF, bytes_.size() - 1 - at);
            if (next == nullptr) break;
            at = static_cast<std::size_t>(static_cast<const std::byte*>(next) - bytes_.data());
            const unsigned follower = byte_at(bytes_, at + 1);
            if (follower != 0xFF && follower != 0 && follower != 1 && (follower < 0xD0 || follower > 0xD8)) return at;
            at += follower == 0xFF ? 1 : 2;
        }
        return bytes_.size();
    }

    void read_segment(unsigned marker, std::span<const std::byte> body) {
        if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
            read_frame(marker, body);
        } else if (marker == 0xDA) {
            if (components_ == 0) broken("a scan before the frame header");
            const std::size_t count = body.empty() ? 0 : byte_at(body, 0);
            header_.scanned_channels += count;
            if (body.size() != 4 + 2 * count) broken("a scan header of the wrong length");
            for (std::size_t c = 0; c < count; ++c)
                unscanned_.erase(std::remove(unscanned_.begin(), unscanned_.end(), byte_at(body, 1 + 2 * c)), unscanned_.end());
        } else if (marker == 0xC4) {
            if (!are_huffman_tables(body)) broken("a bad Huffman table");
        } else if (marker == 0xE1 && header_.exif.empty() && has_text(body, 0, std::string_view("Exif\0\0", 6))) {
            header_.exif = body.subspan(6);
        } else if (marker == 0xE1 || marker == 0xE2) {
            header_.extensions.push_back(body);
        } else if (marker == 0xEE && has_text(body, 0, "Adobe") && body.size() >= 12) {
            adobe_ = true;
        }
    }

    void read_frame(unsigned marker, std::span<const std::byte> body) {
        if (marker > 0xC2) unsupported(marker == 0xC3 ? "a lossless JPEG" : "an arithmetic-coded or hierarchical JPEG");
        if (components_ != 0) broken("two pictures in one");
        if (body.size() < 6) broken("a short frame header");
        if (byte_at(body, 0) != 8) unsupported(std::to_string(byte_at(body, 0)) + "-bit samples");
        header_.height = big_endian_16(body, 1), header_.width = big_endian_16(body, 3);
        components_ = byte_at(body, 5);
        // Channels as decoded, 2 bytes of coefficients in a progressive file, and the picture made of them.
        header_.memory_per_pixel = components_ * (marker == 0xC2 ? 3 : 1) + 3;
        if (header_.height == 0) unsupported("a JPEG that states its height at the end");
        if (header_.width == 0) broken("a width of 0");
        if (components_ != 1 && components_ != 3 && components_ != 4) unsupported(std::to_string(components_) + " channels");
        if (body.size() != 6 + 3 * components_) broken("a frame header of the wrong length");
        for (std::size_t c = 0; c < components_; ++c) unscanned_.push_back(byte_at(body, 6 + 3 * c));
    }

    std::span<const std::byte> bytes_;
    const std::string& where_;
    picture_header header_;
    buffer<unsigned> unscanned_;  ///< identifiers of components that no scan has filled yet
    std::size_t components_ = 0;
    bool adobe_ = false;
};

/// Raises invalid_data, unsupported.
inline picture_header read_jpeg_header(std::span<const std::byte> bytes, const std::string& where) {
    return jpeg_header_reader(bytes, where).read();
}

/// Walks all chunks of a PNG file and checks the critical ones' checksums. Raises invalid_data, unsupported.
inline picture_header read_png_header(std::span<const std::byte> bytes, const std::string& where) {
    const auto broken = [&](const std::string& found) { damaged(picture_format::png, where, found); };
    picture_header header;
    header.format = picture_format::png;
    std::size_t compressed = 0, bits_per_pixel = 0;
    bool begun = false, ended = false;
    for (std::size_t at = 8; !ended;) {
        if (bytes.size() - at < 12) broken("a file that is cut off after " + std::to_string(bytes.size()) + " bytes");
        const std::size_t length = big_endian_32(bytes, at);
        if (length > bytes.size() - at - 12) broken("a chunk that is cut off");
        const std::span<const std::byte> type = bytes.subspan(at + 4, 4), body = bytes.subspan(at + 8, length);
        const bool critical = (byte_at(type, 0) & 0x20) == 0;
        if (has_text(type, 0, "CgBI"))
            raise(error_code::unsupported, where, "a PNG file as the standard has it", "Apple's CgBI variant of one");
        if (!begun && !has_text(type, 0, "IHDR")) broken("a file that does not begin with its header");
        if (critical) {
            if (crc32(bytes.subspan(at + 4, 4 + length)) != big_endian_32(bytes, at + 8 + length)) broken("a wrong checksum");
        }
        if (has_text(type, 0, "IHDR")) {
            if (begun || length != 13) broken("a bad header");
            begun = true;
            header.width = big_endian_32(body, 0), header.height = big_endian_32(body, 4);
            const std::size_t depth = byte_at(body, 8), color = byte_at(body, 9);
            static constexpr std::array<std::size_t, 7> channels_of_color_type = {1, 0, 3, 1, 2, 0, 4};
            const std::size_t channels = color < channels_of_color_type.size() ? channels_of_color_type[color] : 0;
            const bool depth_fits = depth == 8 || (depth == 16 && color != 3) ||
                                    ((depth == 1 || depth == 2 || depth == 4) && (color == 0 || color == 3));
            if (channels == 0 || !depth_fits || byte_at(body, 10) != 0 || byte_at(body, 11) != 0 || byte_at(body, 12) > 1)
                broken("a bad header");
            if (header.width == 0 || header.height == 0 || header.width > 0x7FFFFFFF || header.height > 0x7FFFFFFF)
                broken("a width or height outside PNG's range");
            header.bits = depth == 16 ? 16 : 8;
            bits_per_pixel = depth * channels;
            // Inflated rows and the picture made of them, which a palette may give four channels; at the end 8-bit RGB.
            const std::size_t decoded = color == 3 ? 4 : channels * (std::max)(depth, std::size_t{8}) / 8;
            header.memory_per_pixel = decoded + (std::max)((bits_per_pixel + 7) / 8, std::size_t{3});
        } else if (has_text(type, 0, "IDAT")) {
            compressed += length;
        } else if (has_text(type, 0, "eXIf")) {
            header.exif = body;
        } else if (has_text(type, 0, "iCCP")) {
            header.profile_chunk = body;
        } else if (has_text(type, 0, "IEND")) {
            ended = true;
        }
        at += 12 + length;
    }
    // Deflate can't shrink anything to less than 1 / 1032.
    const double raw = nearest_double(header.width) * nearest_double(header.height) * nearest_double(bits_per_pixel) / 8;
    if (raw > 1032.0 * nearest_double(compressed) + 1024.0)
        broken(std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels in " + std::to_string(compressed) +
               " bytes of data");
    return header;
}

/// Raises unsupported (neither JPEG nor PNG, or a kind of them that is not read), invalid_data (empty, cut off, damaged).
inline picture_header read_picture_header(std::span<const std::byte> bytes, const std::string& where) {
    if (is_jpeg(bytes)) return read_jpeg_header(bytes, where);
    if (is_png(bytes)) return read_png_header(bytes, where);
    raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, "a JPEG or PNG file",
          describe_format(bytes));
}

}  // namespace ldi::detail
