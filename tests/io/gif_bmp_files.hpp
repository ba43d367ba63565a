// Builds GIF and BMP files byte by byte for tests and fuzzers.
#pragma once

#include <tests/support/files.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::testing {

inline byte_string little_endian(std::uint32_t value, int size) {
    const byte_string bytes = big_endian(value, size);
    return byte_string(bytes.rbegin(), bytes.rend());
}

/// Returns the color of one of 256 different shades.
inline std::array<std::uint8_t, 3> shade(unsigned index) {
    return {static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(255 - index), static_cast<std::uint8_t>(index / 2)};
}

struct gif_writing {
    bool interlaced = false;
    int transparent = -1;
    std::uint32_t left = 0, top = 0, screen_width = 0, screen_height = 0;
    bool animated = false;
    bool has_end_code = true, clears_table = true;
    unsigned background = 0;  ///< index of the background color
};

/// A GIF file of an H x W x 1 picture of shades. If `clears_table`, clears the code table before codes exceed 9 bits.
inline byte_string gif_file(const image<std::uint8_t>& picture, const gif_writing& writing = {}) {
    const std::uint32_t width = static_cast<std::uint32_t>(picture.width()),
                        height = static_cast<std::uint32_t>(picture.height());
    byte_string file = bytes_of("GIF89a");
    append(file, little_endian(writing.screen_width != 0 ? writing.screen_width : width, 2));
    append(file, little_endian(writing.screen_height != 0 ? writing.screen_height : height, 2));
    file.push_back(std::byte{0xF7}), file.push_back(static_cast<std::byte>(writing.background)), file.push_back(std::byte{0});
    for (unsigned i = 0; i < 256; ++i)
        for (const std::uint8_t v : shade(i)) file.push_back(std::byte{v});
    append(file, bytes_of(std::string_view("\x21\xFE\5hello\0", 9)));
    if (writing.transparent >= 0) {
        append(file, bytes_of(std::string_view("\x21\xF9\4\1\0\0", 6)));
        file.push_back(static_cast<std::byte>(writing.transparent)), file.push_back(std::byte{0});
    }
    std::vector<std::uint32_t> rows;
    for (const auto& [begin, step] : writing.interlaced
                                         ? std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 8}, {4, 8}, {2, 4}, {1, 2}}
                                         : std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}})
        for (std::uint32_t y = begin; y < height; y += step) rows.push_back(y);
    byte_string bits;
    unsigned waiting = 0, waiting_bits = 0, count = 0, code_bits = 9, next_code = 257;
    const auto put = [&](unsigned code) {
        for (waiting |= code << waiting_bits, waiting_bits += code_bits; waiting_bits >= 8; waiting >>= 8, waiting_bits -= 8)
            bits.push_back(static_cast<std::byte>(waiting & 255));
    };
    for (const std::uint32_t y : rows)
        for (std::uint32_t x = 0; x < width; ++x) {
            if (count == 0 || (writing.clears_table && count % 250 == 0)) put(256), next_code = 257;
            put(picture(y, x));
            if (++next_code == 1U << code_bits && code_bits < 12) ++code_bits;
            ++count;
        }
    if (writing.has_end_code)
        put(257), put(0);
    else if (waiting_bits > 0)
        bits.push_back(static_cast<std::byte>(waiting & 255));
    const auto add_frame = [&] {
        file.push_back(std::byte{','});
        for (const std::uint32_t number : {writing.left, writing.top, width, height}) append(file, little_endian(number, 2));
        file.push_back(std::byte{static_cast<std::uint8_t>(writing.interlaced ? 0x40 : 0)}), file.push_back(std::byte{8});
        for (std::size_t at = 0; at < bits.size(); at += 255) {
            const std::size_t size = std::min(bits.size() - at, std::size_t{255});
            file.push_back(static_cast<std::byte>(size));
            file.insert(file.end(), bits.begin() + static_cast<std::ptrdiff_t>(at),
                        bits.begin() + static_cast<std::ptrdiff_t>(at + size));
        }
        file.push_back(std::byte{0});
    };
    add_frame();
    if (writing.animated) {
        std::reverse(bits.begin(), bits.end());  // a second frame with other pixels
        add_frame();
    }
    file.push_back(std::byte{';'});
    return file;
}

/// A BMP file of an H x W x 3 picture with 24 or 32 bits, or with 8 bits and a palette of grays.
/// gap  bytes between the header and the pixels; they may be an unused palette
inline byte_string bmp_file(const image<std::uint8_t>& picture, std::uint32_t bits = 24, bool from_top = false,
                            std::size_t gap = 0) {
    const std::uint32_t width = static_cast<std::uint32_t>(picture.width()),
                        height = static_cast<std::uint32_t>(picture.height());
    const std::size_t row = (picture.width() * bits + 31) / 32 * 4;
    const std::uint32_t begin = static_cast<std::uint32_t>(54 + (bits == 8 ? 1024 : gap));
    byte_string file = bytes_of("BM");
    append(file, little_endian(static_cast<std::uint32_t>(begin + row * height), 4));
    append(file, little_endian(0, 4)), append(file, little_endian(begin, 4));
    append(file, little_endian(40, 4)), append(file, little_endian(width, 4));
    append(file, little_endian(from_top ? 0U - height : height, 4));
    append(file, little_endian(1, 2)), append(file, little_endian(bits, 2));
    append(file, byte_string(24));
    for (unsigned i = 0; bits == 8 && i < 256; ++i) append(file, little_endian(i * 0x010101, 4));
    if (bits > 8) append(file, byte_string(gap));
    for (std::size_t line = 0; line < height; ++line) {
        const std::size_t y = from_top ? line : height - 1 - line, end = file.size() + row;
        for (std::size_t x = 0; x < width; ++x) {
            if (bits == 8) file.push_back(std::byte{picture(y, x, 0)});
            for (std::size_t c = 3; bits > 8 && c-- > 0;) file.push_back(std::byte{picture(y, x, c)});
            if (bits == 32) file.push_back(std::byte{255});
        }
        file.resize(end);
    }
    return file;
}

}  // namespace ldi::testing
