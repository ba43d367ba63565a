#include <ldi/io/picture.hpp>

#include <catch2/catch.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <tests/support/files.hpp>

using namespace ldi;
using namespace ldi::testing;

TEST_CASE("8-bit PNG files with one and with three channels are lossless") {
    std::mt19937 random(3);
    for (std::size_t channels : {1u, 3u})
        for (int i = 0; i < 50; ++i) {
            image<std::uint8_t> picture(1 + random() % 20, 1 + random() % 20, channels);
            for (std::uint8_t& v : picture) v = static_cast<std::uint8_t>(random());
            const image<std::uint8_t> back = decode_photo(encode_png(picture)).color;
            REQUIRE(back.size() == picture.size() * 3 / channels);
            for (std::size_t k = 0; k < back.size(); ++k)
                if (back.data()[k] != picture.data()[channels == 1 ? k / 3 : k]) FAIL("value " << k);
        }
}

TEST_CASE("16-bit PNG files are lossless") {
    image<std::uint16_t> picture(256, 256);
    for (std::size_t i = 0; i < picture.size(); ++i) picture.data()[i] = static_cast<std::uint16_t>(i);
    const image<float> back = decode_depth_map(encode_png(picture));
    REQUIRE(back.size() == picture.size());
    for (std::size_t i = 0; i < back.size(); ++i)
        if (back.data()[i] != static_cast<float>(i)) FAIL("value " << i);
}

TEST_CASE("16-bit PNG files state no color space, by which other programs would convert a depth map") {
    const std::vector<std::byte> file = encode_png(image<std::uint16_t>(30, 40, 1, 7));
    std::string chunks;
    for (std::size_t at = 8; at < file.size(); at += 12 + detail::big_endian_32(file, at))
        chunks += std::string(reinterpret_cast<const char*>(file.data()) + at + 4, 4) + ' ';
    CHECK(chunks == "IHDR IDAT IEND ");
}

TEST_CASE("the encoders refuse pictures without pixels, or with a number of channels other than one or three") {
    for (const std::size_t channels : {2U, 4U}) {
        CHECK(raised([&] { encode_png(image<std::uint8_t>(3, 4, channels)); }) == error_code::mismatch);
        CHECK(raised([&] { encode_jpeg(image<std::uint8_t>(3, 4, channels)); }) == error_code::mismatch);
    }
    CHECK(raised([] { encode_png(image<std::uint16_t>(3, 4, 3)); }) == error_code::mismatch);
    CHECK(raised([] { encode_png(image<std::uint8_t>(0, 4, 3)); }) == error_code::mismatch);
    CHECK(raised([] { encode_jpeg(image<std::uint8_t>(3, 0, 3)); }) == error_code::mismatch);
}

TEST_CASE("JPEG files are close to the picture, larger at higher quality, and have half the chroma resolution up to quality 90") {
    const image<std::uint8_t> picture = smooth_picture(40, 44, 3);
    const auto error_at = [&](int quality) {
        return largest_difference(decode_photo(encode_jpeg(picture, quality)).color, picture);
    };
    CHECK(error_at(100) <= 6);
    CHECK(error_at(85) <= 24);
    CHECK(encode_jpeg(picture, 30).size() < encode_jpeg(picture, 85).size());

    const auto sampling_of_first_channel = [&](int quality) {
        const byte_string file = encode_jpeg(picture, quality);
        const byte_string frame = bytes_of(std::string_view("\xFF\xC0\0\x11\x08", 5));
        const auto at = std::search(file.begin(), file.end(), frame.begin(), frame.end());
        REQUIRE(at != file.end());
        return std::to_integer<int>(*(at + 11));
    };
    CHECK(sampling_of_first_channel(90) == 0x22);
    CHECK(sampling_of_first_channel(91) == 0x11);
}

TEST_CASE("a quality outside 1 to 100 and a picture too wide for JPEG are refused") {
    const image<std::uint8_t> picture = smooth_picture(2, 2, 3);
    for (int quality : {-1, 0, 101}) CHECK(raised([&] { encode_jpeg(picture, quality); }) == error_code::invalid_option);
    const image<std::uint8_t> wide(1, 65536, 1, 0);
    CHECK(raised([&] { encode_jpeg(wide); }) == error_code::too_large);
    CHECK(decode_photo(encode_png(wide)).color.width() == 65536);
}

TEST_CASE("saved files contain exactly the encoded picture, and no other files remain") {
    const scratch_folder folder;
    const image<std::uint8_t> picture = smooth_picture(8, 8, 3);
    save_png(folder / "picture.png", picture);
    save_jpeg(folder / "picture.jpg", picture, 70);
    CHECK(read_file(folder / "picture.png") == encode_png(picture));
    CHECK(read_file(folder / "picture.jpg") == encode_jpeg(picture, 70));
    CHECK(folder.file_count() == 2);
}
