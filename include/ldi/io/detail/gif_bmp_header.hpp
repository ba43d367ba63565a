// Reads the headers of GIF and BMP files before stb_image decodes them, and changes headers that stb_image reads differently than
// other programs. Checks that the files are complete, because stb_image does not. Also counts the pixels that the codes of a GIF
// file produce, because this number determines the time that stb_image needs to decode the file.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/formats/picture_header.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Walks over a GIF file up to the end of its first frame.
class gif_header_reader {
public:
    gif_header_reader(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {}

    picture_header read() {
        picture_header header;
        header.format = picture_format::gif;
        need(13);
        header.width = little_endian_16(bytes_, 6), header.height = little_endian_16(bytes_, 8);
        if (header.width == 0 || header.height == 0) broken("an empty picture");
        header.memory_per_pixel = 9;                         // RGBA, RGBA of the background, and a byte that marks covered pixels
        header.more_memory = nearest_double(bytes_.size());  // plain_gif()
        at_ = 13 + color_table(byte_at(bytes_, 10));
        for (;;) {
            need(1);
            const unsigned kind = byte_at(bytes_, at_++);
            if (kind == 0x21) {  // an extension: a label, then blocks
                ++at_;
                for (std::size_t size = block(); size > 0; size = block()) at_ += size;
            } else if (kind == 0x2C) {
                read_frame();
                return header;
            } else {
                broken("a file without a frame");
            }
        }
    }

private:
    [[noreturn]] void broken(const std::string& found) const { damaged(picture_format::gif, where_, found); }
    void need(std::size_t count) const {
        if (bytes_.size() < at_ || bytes_.size() - at_ < count)
            broken("a file that is cut off after " + std::to_string(bytes_.size()) + " bytes");
    }
    static std::size_t color_table(unsigned flags) { return (flags & 0x80) != 0 ? std::size_t{6} << (flags & 7) : 0; }
    /// Returns the length of the next block of data; 0 after the last block.
    std::size_t block() {
        need(1);
        const std::size_t size = byte_at(bytes_, at_++);
        need(size);
        return size;
    }

    /// Counts the pixels that the codes of a frame produce. Raises invalid_data unless the count matches the frame's size.
    void read_frame() {
        need(9);
        const std::size_t pixels = std::size_t{little_endian_16(bytes_, at_ + 4)} * little_endian_16(bytes_, at_ + 6);
        at_ += 9 + color_table(byte_at(bytes_, at_ + 8));
        need(1);
        const unsigned bits = byte_at(bytes_, at_++);
        if (bits > 11) broken("codes of " + std::to_string(bits) + " bits");
        const unsigned clear = 1U << bits;
        std::array<std::uint16_t, 4097> length{};  // number of pixels per code
        for (unsigned code = 0; code < clear; ++code) length[code] = 1;
        unsigned next = clear + 2, size = bits + 1, previous = clear, waiting = 0, waiting_bits = 0;
        std::size_t made = 0, left = 0;
        for (;;) {
            for (; waiting_bits < size; waiting_bits += 8, --left) {
                if (left == 0) left = block();
                if (left == 0) {
                    if (made == pixels) return;  // some writers leave the end code out
                    broken("a frame that is cut off");
                }
                waiting |= byte_at(bytes_, at_++) << waiting_bits;
            }
            const unsigned code = waiting & ((1U << size) - 1);
            waiting >>= size, waiting_bits -= size;
            if (code == clear) {
                next = clear + 2, size = bits + 1, previous = clear;
                continue;
            }
            if (code == clear + 1) break;
            if (code > next || (previous == clear && code >= clear)) broken("an undefined code");
            if (previous != clear && next < 4096) length[next++] = static_cast<std::uint16_t>(length[previous] + 1);
            if (code >= next) broken("an undefined code");
            made += length[code];
            if (made > pixels) broken("more data than its picture has");
            if (next == 1U << size && size < 12) ++size;
            previous = code;
        }
        if (made < pixels) broken("a frame that is cut off");
    }

    std::span<const std::byte> bytes_;
    const std::string& where_;
    std::size_t at_ = 0;
};

/// Reads the header of a GIF file. Raises invalid_data.
inline picture_header read_gif_header(std::span<const std::byte> bytes, const std::string& where) {
    return gif_header_reader(bytes, where).read();
}

/// Returns the file with background color 0. stb_image would fill the picture with any other background color; all other programs
/// leave it transparent.
inline std::vector<std::byte> plain_gif(std::span<const std::byte> bytes) {
    std::vector<std::byte> file(bytes.begin(), bytes.end());
    file[11] = std::byte{0};
    return file;
}

/// Returns the number of bytes between the header of a BMP file and its pixels, or 0 if the colors of a palette are there.
inline std::size_t bmp_gap(std::span<const std::byte> bytes) {
    const std::size_t data = little_endian_32(bytes, 10), header_size = little_endian_32(bytes, 14);
    if (header_size < 40 || little_endian_16(bytes, 28) < 16) return 0;
    const std::size_t masks = header_size == 40 && little_endian_32(bytes, 30) == 3 ? 12 : 0;
    const std::size_t begin = 14 + header_size + masks;
    return data > begin ? data - begin : 0;
}

/// Returns the file without the gap after its header, which stb_image would refuse.
inline std::vector<std::byte> plain_bmp(std::span<const std::byte> bytes) {
    const std::size_t gap = bmp_gap(bytes), data = little_endian_32(bytes, 10), begin = data - gap;
    std::vector<std::byte> file(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(begin));
    file.insert(file.end(), bytes.begin() + static_cast<std::ptrdiff_t>(data), bytes.end());
    for (std::size_t i = 0; i < 4; ++i) file[10 + i] = static_cast<std::byte>(begin >> 8 * i & 255);
    return file;
}

/// Reads the header of a BMP file. Raises invalid_data, unsupported (compressed data).
inline picture_header read_bmp_header(std::span<const std::byte> bytes, const std::string& where) {
    const auto broken = [&](const std::string& found) { damaged(picture_format::bmp, where, found); };
    const std::string cut_off = "a file that is cut off after " + std::to_string(bytes.size()) + " bytes";
    if (bytes.size() < 26) broken(cut_off);
    const std::size_t data = little_endian_32(bytes, 10), header_size = little_endian_32(bytes, 14);
    const bool is_old = header_size == 12;
    if (!is_old && header_size != 40 && header_size != 56 && header_size != 108 && header_size != 124)
        raise(error_code::unsupported, where, "a BMP header of 12, 40, 56, 108 or 124 bytes",
              std::to_string(header_size) + " bytes");
    if (!is_old && bytes.size() < 34) broken(cut_off);
    const std::uint32_t width = is_old ? little_endian_16(bytes, 18) : little_endian_32(bytes, 18);
    std::uint32_t height = is_old ? little_endian_16(bytes, 20) : little_endian_32(bytes, 22);
    if (height > 0x80000000U) height = 0U - height;  // negative: rows from top to bottom
    const std::size_t bits = little_endian_16(bytes, is_old ? 24 : 28);
    const std::uint32_t compression = is_old ? 0 : little_endian_32(bytes, 30);
    if (width == 0 || width > 0x7FFFFFFF || height == 0 || height > 0x7FFFFFFF) broken("a width or height outside BMP's range");
    if (bits != 1 && bits != 4 && bits != 8 && bits != 16 && bits != 24 && bits != 32) broken("a bad header");
    if (compression != 0 && compression != 3)
        raise(error_code::unsupported, where, "a BMP file without compression",
              "compression method " + std::to_string(compression));
    const std::size_t row = (std::size_t{width} * bits + 31) / 32 * 4;
    if (data > bytes.size() || row > (bytes.size() - data) / height) broken(cut_off);
    picture_header header;
    header.format = picture_format::bmp;
    header.width = width, header.height = height;
    header.memory_per_pixel = 7;                                                // 4 for RGBA, then 3 for RGB
    if (bmp_gap(bytes) > 0) header.more_memory = nearest_double(bytes.size());  // plain_bmp()
    return header;
}

}}}  // namespace ldi::detail
