// Reads the header of a JPEG or PNG file before anything is decoded or allocated: size, bit depth, position of EXIF data, and
// whether the file is complete. These functions also verify checksums and check whether a JPEG's picture is complete, because
// the decoder (stb_image) does neither.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/formats/checksums.hpp>
#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Whether a segment contains all bytes of its Huffman tables, and each table has at most 256 codes. Any other table would make
/// stb_image 2.27 write beyond its buffers.
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

/// Returns the offset of the first marker of a JPEG file at or after `at`, or the end of the file. Skips stray bytes between
/// segments, which some cameras write. Inside a scan, skips FF 00, which is data, and FF D0 to FF D7, which are restart markers.
inline std::size_t find_jpeg_marker(std::span<const std::byte> bytes, std::size_t at) {
    while (at + 1 < bytes.size()) {
        const void* const next = std::memchr(bytes.data() + at, 0xFF, bytes.size() - 1 - at);
        if (next == nullptr) break;
        at = static_cast<std::size_t>(static_cast<const std::byte*>(next) - bytes.data());
        const unsigned follower = byte_at(bytes, at + 1);
        if (follower != 0xFF && follower != 0 && follower != 1 && (follower < 0xD0 || follower > 0xD8)) return at;
        at += follower == 0xFF ? 1 : 2;
    }
    return bytes.size();
}

/// Walks the segments of a JPEG file up to the end of its first picture.
class jpeg_header_reader {
public:
    jpeg_header_reader(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {
        header_.format = picture_format::jpeg;
    }

    picture_header read() {
        for (std::size_t at = 2;;) {
            at = find_jpeg_marker(bytes_, at);
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
        // Without Adobe's marker, the file does not say whether 0 or 255 is full ink, nor whether the channels are ink at all.
        if (components_ == 4 && !adobe_) unsupported("four channels without an Adobe marker");
        // A block of at most 256 pixels of one channel occupies at least one bit, so a byte holds at most 2048 pixels.
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
        } else if ((marker == 0xE1 || marker == 0xE2) && body.size() > 12) {  // shorter segments contain only an identifier
            header_.extensions.push_back(body);
        } else if (marker == 0xEE && has_text(body, 0, "Adobe") && body.size() >= 12) {
            adobe_ = true;
        }
    }

    void read_frame(unsigned marker, std::span<const std::byte> body) {
        if (marker > 0xC2) unsupported(marker == 0xC3 ? "a lossless JPEG" : "an arithmetic-coded or hierarchical JPEG");
        if (components_ != 0) broken("a second frame header");
        if (body.size() < 6) broken("a short frame header");
        if (byte_at(body, 0) != 8) unsupported(std::to_string(byte_at(body, 0)) + "-bit samples");
        header_.height = big_endian_16(body, 1), header_.width = big_endian_16(body, 3);
        components_ = byte_at(body, 5);
        // Bytes per pixel: the decoded channels, 2 bytes of coefficients per channel in a progressive file, and the picture
        // converted to RGB.
        const std::size_t stored = components_ * (marker == 0xC2 ? 3 : 1);
        header_.memory_per_pixel = stored + 3;
        if (header_.height == 0) unsupported("a JPEG that states its height at the end");
        if (header_.width == 0) broken("a width of 0");
        // The decoder processes whole blocks of up to 32 x 32 pixels.
        header_.more_memory = nearest_double(stored) * (32 * nearest_double(header_.width + header_.height) + 1024);
        if (components_ != 1 && components_ != 3 && components_ != 4) unsupported(std::to_string(components_) + " channels");
        if (body.size() != 6 + 3 * components_) broken("a frame header of the wrong length");
        for (std::size_t c = 0; c < components_; ++c) unscanned_.push_back(byte_at(body, 6 + 3 * c));
    }

    std::span<const std::byte> bytes_;
    const std::string& where_;
    picture_header header_;
    buffer<unsigned> unscanned_;  ///< identifiers of components that no scan has contained so far
    std::size_t components_ = 0;
    bool adobe_ = false;
};

/// Reads the header of a JPEG file. Raises invalid_data, unsupported.
inline picture_header read_jpeg_header(std::span<const std::byte> bytes, const std::string& where) {
    return jpeg_header_reader(bytes, where).read();
}

/// Properties of a PNG file that bound the memory for decoding it.
struct png_layout {
    std::size_t bits_per_pixel = 0;
    std::size_t decoded_bytes = 0;  ///< bytes per pixel of the decoded picture
    bool is_interlaced = false;
};

/// Reads the body of the IHDR chunk. Calls broken(found) for values that PNG does not allow.
template <class Broken>
png_layout read_png_size(std::span<const std::byte> body, picture_header& header, const Broken& broken) {
    header.width = big_endian_32(body, 0), header.height = big_endian_32(body, 4);
    const std::size_t depth = byte_at(body, 8), color = byte_at(body, 9);
    static constexpr std::array<std::size_t, 7> channels_of_color_type = {1, 0, 3, 1, 2, 0, 4};
    const std::size_t channels = color < channels_of_color_type.size() ? channels_of_color_type[color] : 0;
    const bool depth_fits =
        depth == 8 || (depth == 16 && color != 3) || ((depth == 1 || depth == 2 || depth == 4) && (color == 0 || color == 3));
    if (channels == 0 || !depth_fits || byte_at(body, 10) != 0 || byte_at(body, 11) != 0 || byte_at(body, 12) > 1)
        broken("a bad header");
    if (header.width == 0 || header.height == 0 || header.width > 0x7FFFFFFF || header.height > 0x7FFFFFFF)
        broken("a width or height outside PNG's range");
    header.bits = depth == 16 ? 16 : 8;
    const std::size_t decoded = color == 3 ? 4 : channels * (std::max)(depth, std::size_t{8}) / 8;  // a palette may have alpha
    return {depth * channels, decoded, byte_at(body, 12) == 1};
}

/// Walks over all chunks of a PNG file and checks the checksums of critical chunks. Raises invalid_data, unsupported.
inline picture_header read_png_header(std::span<const std::byte> bytes, const std::string& where) {
    const auto broken = [&](const std::string& found) { damaged(picture_format::png, where, found); };
    picture_header header;
    header.format = picture_format::png;
    png_layout layout;
    std::size_t compressed = 0;
    bool has_begun = false, has_ended = false, has_transparent_color = false;
    for (std::size_t at = 8; !has_ended;) {
        if (bytes.size() - at < 12) broken("a file that is cut off after " + std::to_string(bytes.size()) + " bytes");
        const std::size_t length = big_endian_32(bytes, at);
        if (length > bytes.size() - at - 12) broken("a chunk that is cut off");
        const std::span<const std::byte> type = bytes.subspan(at + 4, 4), body = bytes.subspan(at + 8, length);
        const bool critical = (byte_at(type, 0) & 0x20) == 0;
        if (has_text(type, 0, "CgBI")) raise(error_code::unsupported, where, "a standard PNG file", "Apple's CgBI variant");
        if (!has_begun && !has_text(type, 0, "IHDR")) broken("a file that does not begin with its header");
        if (critical) {
            if (crc32(bytes.subspan(at + 4, 4 + length)) != big_endian_32(bytes, at + 8 + length)) broken("a wrong checksum");
        }
        if (has_text(type, 0, "IHDR")) {
            if (has_begun || length != 13) broken("a bad header");
            has_begun = true;
            layout = read_png_size(body, header, broken);
        } else if (has_text(type, 0, "IDAT")) {
            compressed += length;
        } else if (has_text(type, 0, "tRNS")) {
            has_transparent_color = true;
        } else if (has_text(type, 0, "eXIf")) {
            header.exif = body;
        } else if (has_text(type, 0, "iCCP")) {
            header.profile_chunk = body;
        } else if (has_text(type, 0, "IEND")) {
            has_ended = true;
        }
        at += 12 + length;
    }
    // Deflate cannot compress data to less than 1 / 1032 of its size.
    const double raw = nearest_double(header.width) * nearest_double(header.height) * nearest_double(layout.bits_per_pixel) / 8;
    if (raw > 1032.0 * nearest_double(compressed) + 1024.0)
        broken(std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels in " + std::to_string(compressed) +
               " bytes of data");
    const auto [bits_per_pixel, decoded_bytes, interlaced] = layout;
    // Peak bytes per pixel: first the inflated rows and the decoded picture, then the decoded picture and its 8-bit RGB copy. An
    // interlaced file inflates to a few bytes more than stb_image expects. stb_image then doubles the buffer of the rows, and
    // both buffers exist for a moment.
    const std::size_t decoded = decoded_bytes + (has_transparent_color && bits_per_pixel >= 8 ? header.bits / 8 : 0);
    const std::size_t row = (bits_per_pixel + 7) / 8, rows = interlaced ? 2 * row : row;
    header.memory_per_pixel = (std::max)({rows + decoded, decoded + 3, interlaced ? 3 * row : 0});
    header.more_memory = 3 * nearest_double(compressed) + nearest_double(header.height);
    header.max_growth =
        (std::max)((header.width * header.height * bits_per_pixel / 8 + header.height) * (interlaced ? 2 : 1), 2 * compressed) +
        65536;
    return header;
}

}  // namespace detail

/// Reads the header of a JPEG or PNG file. Raises unsupported for any other format and for an unsupported variant, and
/// invalid_data for an empty, truncated or damaged file.
inline picture_header read_picture_header(std::span<const std::byte> bytes, const std::string& where) {
    if (detail::is_jpeg(bytes)) return detail::read_jpeg_header(bytes, where);
    if (detail::is_png(bytes)) return detail::read_png_header(bytes, where);
    raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, "a JPEG or PNG file",
          describe_format(bytes));
}

}}  // namespace ldi
