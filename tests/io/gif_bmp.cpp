// Common kinds of GIF and BMP files.
#include <ldi/io/photo.hpp>

#include <catch2/catch.hpp>
#include <tests/io/gif_bmp_files.hpp>
#include <tests/support/files.hpp>

#include <cstdint>
#include <random>

using namespace ldi;
using namespace ldi::testing;

namespace {

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

TEST_CASE("the first frame of GIF files is decoded exactly, with and without interlacing") {
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

TEST_CASE("a GIF file with all pixels but without an end code is decoded exactly") {
    for (const std::size_t width : {1U, 2U, 3U, 7U, 8U, 34U, 255U}) {
        const image<std::uint8_t> shades = shades_of(5, width);
        CHECK(largest_difference(decode_photo(gif_file(shades, {.has_end_code = false})).color, colors_of(shades)) == 0);
    }
}

TEST_CASE("a GIF file that never clears its code table is decoded exactly if it is small; larger ones are unsupported") {
    const image<std::uint8_t> small = shades_of(60, 60), large = shades_of(100, 100);
    CHECK(largest_difference(decode_photo(gif_file(small, {.clears_table = false})).color, colors_of(small)) == 0);
    CHECK(raised([&] { decode_photo(gif_file(large, {.clears_table = false})); }) == error_code::unsupported);
    CHECK(largest_difference(decode_photo(gif_file(large)).color, colors_of(large)) == 0);
}

TEST_CASE("transparent pixels of a GIF file, and pixels outside its first frame, are white") {
    image<std::uint8_t> shades = shades_of(3, 4);
    const photo with_hole = decode_photo(gif_file(shades, {.transparent = 7}));
    image<std::uint8_t> expected = colors_of(shades);
    for (std::size_t c = 0; c < 3; ++c) expected(0, 1, c) = 255;  // the transparent shade
    CHECK(largest_difference(with_hole.color, expected) == 0);
    for (const unsigned background : {0U, 1U, 255U}) {
        const photo framed = decode_photo(
            gif_file(shades, {.left = 2, .top = 1, .screen_width = 8, .screen_height = 5, .background = background}));
        REQUIRE(framed.color.width() == 8);
        for (std::size_t c = 0; c < 3; ++c) CHECK(framed.color(0, 0, c) == 255);
        CHECK(framed.color(1, 2, 1) == colors_of(shades)(0, 0, 1));
        CHECK(framed.color(3, 5, 0) == colors_of(shades)(2, 3, 0));
    }
}

TEST_CASE("BMP files of 8, 24 and 32 bits are decoded exactly, from bottom to top and from top to bottom") {
    const image<std::uint8_t> picture = smooth_picture(13, 22, 3);
    for (const std::uint32_t bits : {24U, 32U})
        for (const bool from_top : {false, true})
            for (const std::size_t gap : {0U, 2U, 8U, 1024U})
                CHECK(largest_difference(decode_photo(bmp_file(picture, bits, from_top, gap)).color, picture) == 0);
    image<std::uint8_t> gray = picture;
    for (std::size_t i = 0; i < gray.size(); ++i) gray.data()[i] = picture.data()[i / 3 * 3];
    CHECK(largest_difference(decode_photo(bmp_file(gray, 8)).color, gray) == 0);
    const byte_string file = bmp_file(picture);
    CHECK(raised([&] { decode_photo(file, {.limits = {.max_pixels = 13 * 22 - 1}}); }) == error_code::too_large);
    check_damage(file);
    byte_string compressed = file;
    compressed[30] = std::byte{1};
    CHECK(raised([&] { decode_photo(compressed); }) == error_code::unsupported);
    for (const int header_size : {16, 41, 52, 64, 255}) {
        byte_string other = file;
        other[14] = static_cast<std::byte>(header_size);
        CHECK(raised([&] { decode_photo(other); }) == error_code::unsupported);
    }
}

TEST_CASE("a BMP file with less data than its size requires, and a GIF file with a huge screen, are refused") {
    byte_string bmp = bmp_file(smooth_picture(4, 4, 3));
    for (const std::size_t at : {18U, 19U, 22U, 23U}) bmp[at] = std::byte{0x20};
    CHECK(raised([&] { decode_photo(bmp); }) == error_code::invalid_data);
    byte_string gif = gif_file(shades_of(4, 4));
    for (const std::size_t at : {6U, 7U, 8U, 9U}) gif[at] = std::byte{0xFF};  // the screen size; frames may be smaller
    CHECK(raised([&] { decode_photo(gif); }) == error_code::too_large);
}
