// GIF and BMP files, of the kinds that people have.
#include <ldi/formats/photo.hpp>

#include <catch2/catch.hpp>
#include <tests/formats/support.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string_view>
#include <utility>
#include <vector>

using namespace ldi;
using namespace ldi::test;

namespace {

byte_string little_endian(std::uint32_t value, int size) {
    const byte_string bytes = big_endian(value, size);
    return byte_string(bytes.rbegin(), bytes.rend());
}

/// Colors of a picture of 256 shades: of each its own.
std::array<std::uint8_t, 3> shade(unsigned index) {
    return {static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(255 - index), static_cast<std::uint8_t>(index / 2)};
}

struct gif_writing {
    bool interlaced = false;
    int transparent = -1;
    std::uint32_t left = 0, top = 0, screen_width = 0, screen_height = 0;
    bool animated = false;
};

/// A GIF file of an H x W x 1 picture of shades. Its codes are cleared before they grow.
byte_string gif_file(const image<std::uint8_t>& picture, const gif_writing& writing = {}) {
    const std::uint32_t width = static_cast<std::uint32_t>(picture.width()),
                        height = static_cast<std::uint32_t>(picture.height());
    byte_string file = bytes_of("GIF89a");
    append(file, little_endian(writing.screen_width != 0 ? writing.screen_width : width, 2));
    append(file, little_endian(writing.screen_height != 0 ? writing.screen_height : height, 2));
    append(file, bytes_of(std::string_view("\xF7\0\0", 3)));
    for (unsigned i = 0; i < 256; ++i)
        for (const std::uint8_t v : shade(i)) file.push_back(std::byte{v});
    append(file, bytes_of(std::string_view("\x21\xFE\5hello\0", 9)));
    if (writing.transparent >= 0) {
        append(file, bytes_of(std::string_view("\x21\xF9\4\1\0\0", 6)));
        file.push_back(static_cast<std::byte>(writing.transparent)), file.push_back(std::byte{0});
    }
    std::vector<std::uint32_t> rows;
    for (const auto [begin, step] : writing.interlaced
                                        ? std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 8}, {4, 8}, {2, 4}, {1, 2}}
                                        : std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}})
        for (std::uint32_t y = begin; y < height; y += step) rows.push_back(y);
    byte_string bits;
    unsigned waiting = 0, waiting_bits = 0, count = 0;
    const auto put = [&](unsigned code) {
        for (waiting |= code << waiting_bits, waiting_bits += 9; waiting_bits >= 8; waiting >>= 8, waiting_bits -= 8)
            bits.push_back(static_cast<std::byte>(waiting & 255));
    };
    for (const std::uint32_t y : rows)
        for (std::uint32_t x = 0; x < width; ++x) {
            if (count++ % 250 == 0) put(256);
            put(picture(y, x));
        }
    put(257), put(0);
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
        std::reverse(bits.begin(), bits.end());  // some other frame
        add_frame();
    }
    file.push_back(std::byte{';'});
    return file;
}

image<std::uint8_t> shades_of(std::size_t height, std::size_t width) {
    image<std::uint8_t> picture(height, width);
    for (std::size_t i = 0; i < picture.size(); ++i) picture.data()[i] = static_cast<std::uint8_t>(7 * i);
    return picture;
}

image<std::uint8_t> colors_of(const image<std::uint8_t>& shades) {
    image<std::uint8_t> color(shades.height(), shades.width(), 3);
    for (std::size_t i = 0; i < color.size(); ++i) color.data()[i] = shade(shades.data()[i / 3])[i % 3];
    return color;
}

/// A BMP file of an H x W x 3 picture, of 24 or 32 bits, or of 8 with a palette of grays.
byte_string bmp_file(const image<std::uint8_t>& picture, std::uint32_t bits = 24, bool from_top = false) {
    const std::uint32_t width = static_cast<std::uint32_t>(picture.width()),
                        height = static_cast<std::uint32_t>(picture.height());
    const std::size_t row = (picture.width() * bits + 31) / 32 * 4;
    const std::uint32_t begin = 54 + (bits == 8 ? 1024 : 0);
    byte_string file = bytes_of("BM");
    append(file, little_endian(static_cast<std::uint32_t>(begin + row * height), 4));
    append(file, little_endian(0, 4)), append(file, little_endian(begin, 4));
    append(file, little_endian(40, 4)), append(file, little_endian(width, 4));
    append(file, little_endian(from_top ? 0U - height : height, 4));
    append(file, little_endian(1, 2)), append(file, little_endian(bits, 2));
    append(file, byte_string(24));
    for (unsigned i = 0; bits == 8 && i < 256; ++i) append(file, little_endian(i * 0x010101, 4));
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

void check_damage(const byte_string& file) {
    std::mt19937 random(13);
    for (std::size_t size = 0; size + 1 < file.size(); size += 1 + file.size() / 300)
        REQUIRE(raised([&] { decode_photo(std::span(file).first(size)); }));
    for (int i = 0; i < 2000; ++i) {
        photo decoded;
        const byte_string copy = damaged_copy(file, random);
        const bool is_refused = raised([&] { decoded = decode_photo(copy, {.limits = {.max_pixels = 1 << 20}}); }).has_value();
        REQUIRE(decoded.color.empty() == is_refused);
    }
}

}  // namespace

TEST_CASE("GIF files give back every pixel of their first frame, by rows and interlaced") {
    const image<std::uint8_t> shades = shades_of(21, 34);
    for (const bool interlaced : {false, true})
        for (const bool animated : {false, true})
            CHECK(largest_difference(decode_photo(gif_file(shades, {.interlaced = interlaced, .animated = animated})).color,
                                     colors_of(shades)) == 0);
    CHECK_FALSE(decode_photo(gif_file(shades)).focal_length_35mm);
    const byte_string file = gif_file(shades);
    CHECK(raised([&] { decode_photo(file, {.limits = {.max_pixels = 21 * 34 - 1}}); }) == error_code::too_large);
    check_damage(file);
}

TEST_CASE("transparent pixels of a GIF file, and those that its first frame leaves out, are white") {
    image<std::uint8_t> shades = shades_of(3, 4);
    const photo with_hole = decode_photo(gif_file(shades, {.transparent = 7}));
    image<std::uint8_t> expected = colors_of(shades);
    for (std::size_t c = 0; c < 3; ++c) expected(0, 1, c) = 255;  // its shade is 7
    CHECK(largest_difference(with_hole.color, expected) == 0);
    const photo framed = decode_photo(gif_file(shades, {.left = 2, .top = 1, .screen_width = 8, .screen_height = 5}));
    REQUIRE(framed.color.width() == 8);
    CHECK(framed.color(0, 0, 0) == 255);
    CHECK(framed.color(1, 2, 1) == colors_of(shades)(0, 0, 1));
    CHECK(framed.color(3, 5, 0) == colors_of(shades)(2, 3, 0));
}

TEST_CASE("BMP files give back every pixel, of 8, 24 and 32 bits, from the bottom and from the top") {
    const image<std::uint8_t> picture = smooth_picture(13, 22, 3);
    for (const std::uint32_t bits : {24U, 32U})
        for (const bool from_top : {false, true})
            CHECK(largest_difference(decode_photo(bmp_file(picture, bits, from_top)).color, picture) == 0);
    image<std::uint8_t> gray = picture;
    for (std::size_t i = 0; i < gray.size(); ++i) gray.data()[i] = picture.data()[i / 3 * 3];
    CHECK(largest_difference(decode_photo(bmp_file(gray, 8)).color, gray) == 0);
    const byte_string file = bmp_file(picture);
    CHECK(raised([&] { decode_photo(file, {.limits = {.max_pixels = 13 * 22 - 1}}); }) == error_code::too_large);
    check_damage(file);
    byte_string compressed = file;
    compressed[30] = std::byte{1};
    CHECK(raised([&] { decode_photo(compressed); }) == error_code::unsupported);
}

TEST_CASE("a GIF or BMP file that promises more than it holds is refused") {
    byte_string bmp = bmp_file(smooth_picture(4, 4, 3));
    for (const std::size_t at : {18U, 19U, 22U, 23U}) bmp[at] = std::byte{0x20};
    CHECK(raised([&] { decode_photo(bmp); }) == error_code::invalid_data);
    byte_string gif = gif_file(shades_of(4, 4));
    for (const std::size_t at : {6U, 7U, 8U, 9U}) gif[at] = std::byte{0xFF};  // the screen, which no frame need fill
    CHECK(raised([&] { decode_photo(gif); }) == error_code::too_large);
}
