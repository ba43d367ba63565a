#include <ldi/formats/plain_png.hpp>
#include <ldi/io/photo.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <zlib.h>

#include <random>

using namespace ldi;
using namespace ldi::testing;

namespace {

/// Decodes the file, which checks every checksum. Gray becomes three equal channels.
void check_reads_back(const image<std::uint8_t>& picture) {
    const buffer<std::byte> file = encode_plain_png(picture);
    const image<std::uint8_t> back = decode_photo(file).color;
    REQUIRE(back.height() == picture.height());
    REQUIRE(back.width() == picture.width());
    for (std::size_t y = 0; y < back.height(); ++y)
        for (std::size_t x = 0; x < back.width(); ++x)
            for (std::size_t c = 0; c < 3; ++c) REQUIRE(back(y, x, c) == picture(y, x, picture.channels() == 3 ? c : 0));
}

image<std::uint8_t> random_picture(std::mt19937& random, std::size_t height, std::size_t width, std::size_t channels,
                                   unsigned noise) {
    image<std::uint8_t> picture(height, width, channels);
    for (std::uint8_t& value : picture) value = static_cast<std::uint8_t>(noise == 0 ? 7 : random() % noise);
    return picture;
}

}  // namespace

TEST_CASE("gray and RGB pictures of any shape, with or without noise, are encoded without loss") {
    std::mt19937 random(4);
    for (std::size_t channels : {std::size_t{1}, std::size_t{3}})
        for (unsigned noise : {0U, 2U, 40U, 256U})
            for (auto [height, width] : {std::pair{1, 1}, {1, 70}, {70, 1}, {33, 65}, {64, 48}})
                check_reads_back(
                    random_picture(random, static_cast<std::size_t>(height), static_cast<std::size_t>(width), channels, noise));
    check_reads_back(smooth_picture(120, 200, 3));
}

TEST_CASE("gaps between the rows of a view are not written") {
    const image<std::uint8_t> whole = smooth_picture(20, 30, 3);
    const image_view<const std::uint8_t> part(whole.row(2) + 12, 9, 11, 3, whole.row_stride());
    CHECK(encode_plain_png(part) == encode_plain_png(image<std::uint8_t>(part)));
}

TEST_CASE("Huffman codes have at most 15 bits, the limit of deflate") {
    // Counts that grow like Fibonacci's numbers produce the longest codes.
    std::array<std::size_t, 257> counts{};
    std::size_t a = 1, b = 1;
    for (std::size_t s = 0; s < 40; ++s) {
        counts[s] = a;
        b += a;
        std::swap(a, b);
    }
    const std::array<int, 257> lengths = detail::plain_png::code_lengths(counts);
    CHECK(*std::max_element(lengths.begin(), lengths.end()) <= 15);
    double filled = 0;
    for (const int length : lengths) filled += length > 0 ? std::ldexp(1.0, -length) : 0;
    CHECK(filled == 1);
}

TEST_CASE("checksums match zlib's") {
    std::mt19937 random(6);
    for (std::size_t size : {0U, 1U, 7U, 8U, 9U, 5551U, 5552U, 5553U, 100000U}) {
        byte_string bytes(size);
        for (std::byte& b : bytes) b = static_cast<std::byte>(random());
        const unsigned char* const data = reinterpret_cast<const unsigned char*>(bytes.data());
        CHECK(crc32(bytes) == ::crc32_z(0, data, size));
        CHECK(adler32(bytes) == ::adler32_z(1, data, size));
        if (size > 5) CHECK(crc32(std::span(bytes).subspan(5), crc32(std::span(bytes).first(5))) == crc32(bytes));
    }
    const byte_string ones(200000, std::byte{255});
    CHECK(adler32(ones) == ::adler32_z(1, reinterpret_cast<const unsigned char*>(ones.data()), ones.size()));
}

TEST_CASE("pictures without pixels, and pictures that are neither gray nor RGB, are refused") {
    const auto result_of = [](std::size_t height, std::size_t width, std::size_t channels) {
        return raised([&] { encode_plain_png(image<std::uint8_t>(height, width, channels)); });
    };
    for (const std::size_t channels : {1U, 3U}) {
        CHECK(result_of(0, 8, channels) == error_code::mismatch);
        CHECK(result_of(8, 0, channels) == error_code::mismatch);
    }
    for (const std::size_t channels : {0U, 2U, 4U, 5U}) CHECK(result_of(8, 8, channels) == error_code::mismatch);
    CHECK_THAT(message_of([] { encode_plain_png(image<std::uint8_t>(8, 6, 4)); }), Catch::Contains("found 8 x 6 x 4"));
}

TEST_CASE("a picture that is too large for a PNG file is refused") {
    const std::uint8_t pixel[3] = {};
    CHECK(raised([&] { encode_plain_png(image_view<const std::uint8_t>(pixel, 100000, 100000, 3)); }) == error_code::too_large);
}
