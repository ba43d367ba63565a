#include <ldi/io/photo.hpp>

#include <catch2/catch.hpp>
#include <ldi/io/picture.hpp>
#include <tests/support/files.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <span>
#include <tuple>

using namespace ldi;
using namespace ldi::testing;

namespace {

const std::filesystem::path files = std::filesystem::path(LDI_SOURCE_DIR) / "tests/io/files";

/// Stores a picture so that it is upright in the given EXIF orientation. The definition is EXIF's own: "the 0th row is the
/// visual top (right, bottom, left) side, the 0th column the visual left (...) side".
image<std::uint8_t> stored_in(unsigned orientation, const image<std::uint8_t>& upright) {
    const std::size_t h = upright.height(), w = upright.width();
    const bool lying = orientation >= 5;
    image<std::uint8_t> stored(lying ? w : h, lying ? h : w, 3);
    for (std::size_t r = 0; r < stored.height(); ++r)
        for (std::size_t c = 0; c < stored.width(); ++c) {
            const std::size_t first = lying ? c : r, second = lying ? r : c;  // along the visual height, along the visual width
            const bool from_bottom = orientation == 3 || orientation == 4 || orientation == 7 || orientation == 8;
            const bool from_right = orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7;
            const std::size_t y = from_bottom ? h - 1 - first : first, x = from_right ? w - 1 - second : second;
            for (std::size_t k = 0; k < 3; ++k) stored(r, c, k) = upright(y, x, k);
        }
    return stored;
}

byte_string rows_of(const image<std::uint8_t>& picture) {
    const std::byte* const first = reinterpret_cast<const std::byte*>(picture.data());
    return byte_string(first, first + picture.size());
}

/// Divides both sides of a picture, rounded up, and returns the means of its blocks.
image<std::uint8_t> means_of_blocks(const image<std::uint8_t>& picture, std::size_t divisor) {
    image<std::uint8_t> result((picture.height() + divisor - 1) / divisor, (picture.width() + divisor - 1) / divisor, 3);
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x)
            for (std::size_t c = 0; c < 3; ++c) {
                std::size_t sum = 0, count = 0;
                for (std::size_t v = y * divisor; v < std::min((y + 1) * divisor, picture.height()); ++v)
                    for (std::size_t u = x * divisor; u < std::min((x + 1) * divisor, picture.width()); ++u)
                        sum += picture(v, u, c), ++count;
                result(y, x, c) = static_cast<std::uint8_t>((2 * sum + count) / (2 * count));
            }
    return result;
}

byte_string rgb_png(const image<std::uint8_t>& picture, const byte_string& extra = {}) {
    return png_file(static_cast<std::uint32_t>(picture.width()), static_cast<std::uint32_t>(picture.height()), 8, 2,
                    rows_of(picture), extra);
}

}  // namespace

TEST_CASE("PNG and JPEG photos with any of the eight EXIF orientations, in both byte orders, are rotated upright") {
    const image<std::uint8_t> upright = smooth_picture(13, 22, 3);
    for (unsigned orientation = 1; orientation <= 8; ++orientation)
        for (bool little_endian : {false, true}) {
            const image<std::uint8_t> stored = stored_in(orientation, upright);
            const byte_string exif = exif_bytes(orientation, 26, little_endian);
            const photo png = decode_photo(rgb_png(stored, png_chunk("eXIf", exif)));
            CHECK(largest_difference(png.color, upright) == 0);
            CHECK(png.focal_length_35mm == 26.0F);
            const photo jpeg = decode_photo(jpeg_with_exif(encode_jpeg(stored, 100), exif));
            CHECK(largest_difference(jpeg.color, upright) <= 8);
            CHECK(jpeg.focal_length_35mm == 26.0F);
        }
}

TEST_CASE(
    "a photo without EXIF, or with a focal length of 0 and an invalid orientation, is read unrotated and without focal length") {
    const image<std::uint8_t> picture = smooth_picture(5, 9, 3);
    CHECK_FALSE(decode_photo(rgb_png(picture)).focal_length_35mm);
    for (unsigned orientation : {0u, 9u, 65535u}) {
        const photo p = decode_photo(rgb_png(picture, png_chunk("eXIf", exif_bytes(orientation, 0))));
        CHECK(largest_difference(p.color, picture) == 0);
        CHECK_FALSE(p.focal_length_35mm);
    }
}

TEST_CASE("gray, palette, 1-bit, 16-bit and transparent PNG files are converted to 8-bit RGB") {
    const auto pixel = [](const photo& p, std::size_t x) {
        return std::array<int, 3>{p.color(0, x, 0), p.color(0, x, 1), p.color(0, x, 2)};
    };
    using color = std::array<int, 3>;
    const photo gray = decode_photo(png_file(2, 1, 8, 0, bytes_of("\x0A\xC8")));
    CHECK(pixel(gray, 0) == color{10, 10, 10});
    CHECK(pixel(gray, 1) == color{200, 200, 200});

    const photo one_bit = decode_photo(png_file(8, 1, 1, 0, bytes_of("\x55")));
    CHECK(pixel(one_bit, 0) == color{0, 0, 0});
    CHECK(pixel(one_bit, 7) == color{255, 255, 255});

    const photo palette = decode_photo(png_file(2, 1, 8, 3, {std::byte{1}, std::byte{0}}, png_chunk("PLTE", bytes_of("abcxyz"))));
    CHECK(pixel(palette, 0) == color{'x', 'y', 'z'});
    CHECK(pixel(palette, 1) == color{'a', 'b', 'c'});

    const photo deep = decode_photo(png_file(1, 1, 16, 2, bytes_of("\x01\xFF\x80\x10\xFE\x01")));
    CHECK(pixel(deep, 0) == color{0x01, 0x80, 0xFE});

    const photo clear = decode_photo(png_file(3, 1, 8, 6,
                                              bytes_of(std::string_view("abc\0abc\xFF"
                                                                        "abc\x33",
                                                                        12))));
    CHECK(pixel(clear, 0) == color{255, 255, 255});
    CHECK(pixel(clear, 1) == color{'a', 'b', 'c'});
    CHECK(pixel(clear, 2) == color{223, 224, 224});  // an opacity of 0x33 is one fifth: 255 - (255 - 97) / 5 and so on
}

TEST_CASE("a photo is reduced as far as the needed pixels allow, without a visible change of its proportions") {
    std::mt19937 random(11);
    for (int i = 0; i < 100'000; ++i) {
        const auto below = [&](std::uint32_t limit) { return 1 + std::size_t{random()} % limit; };
        const std::size_t height = below(i % 2 == 0 ? 20'000 : 500), width = below(i % 3 == 0 ? 20'000 : 2000);
        const std::size_t needed = i % 10 == 0 ? 0 : below(5000), divisor = detail::divisor_for(needed, height, width);
        const auto divided = [](std::size_t length, std::size_t by) { return (length + by - 1) / by; };
        const std::size_t longer = std::max(height, width), shorter = std::min(height, width);
        REQUIRE((divisor == 1 || divisor == 2 || divisor == 4 || divisor == 8));
        if (divisor > 1) REQUIRE((needed > 0 && divided(longer, divisor) >= needed));
        const bool is_largest = divisor == 8 || divided(longer, 2 * divisor) < needed || shorter < 200 * divisor;
        REQUIRE((needed == 0 || is_largest));
        const double before = static_cast<double>(width) / static_cast<double>(height);
        const double after = static_cast<double>(divided(width, divisor)) / static_cast<double>(divided(height, divisor));
        REQUIRE(std::abs(after / before - 1) < 0.0101);
    }
}

TEST_CASE("reducing a picture replaces each block by its mean, also at borders where blocks are smaller") {
    std::mt19937 random(12);
    for (int i = 0; i < 500; ++i) {
        const std::size_t height = 1 + random() % 40, width = 1 + random() % 40, divisor = std::size_t{1} << random() % 4;
        image<std::uint8_t> picture(height, width, 3);
        for (std::uint8_t& v : picture) v = static_cast<std::uint8_t>(i % 5 == 0 ? 255 : random());
        const image<std::uint8_t> expected = means_of_blocks(picture, divisor);
        for (const std::size_t channels : {std::size_t{1}, std::size_t{3}}) {
            auto stored = detail::allocate_picture(height, width, channels, "picture");
            for (std::size_t v = 0; v < height * width * channels; ++v) stored.samples[v] = picture.data()[v * 3 / channels];
            detail::average_blocks(stored, divisor);
            REQUIRE((stored.height == expected.height() && stored.width == expected.width()));
            for (std::size_t v = 0; v < stored.height * stored.width * channels; ++v)
                REQUIRE(stored.samples[v] == expected.data()[v * 3 / channels]);
        }
    }
}

TEST_CASE("a large photo can be decoded at a part of its size, in any orientation") {
    std::mt19937 random(13);
    std::size_t reduced_photos = 0;
    for (int i = 0; i < 40; ++i) {
        const std::size_t height = 150 + random() % 300, width = 150 + random() % 300, needed = 50 + random() % 200;
        const std::size_t divisor = detail::divisor_for(needed, height, width), channels = i % 4 == 0 ? 1 : 3;
        const bool is_subsampled = i % 2 == 0;
        const byte_string jpeg = encode_jpeg(smooth_picture(height, width, channels), is_subsampled ? 85 : 95);
        const byte_string file = jpeg_with_exif(jpeg, exif_bytes(1 + random() % 8, 26));
        const image<std::uint8_t> whole = decode_photo(file).color, reduced = decode_photo(file, {.long_side = needed}).color;
        INFO(width << " x " << height << ", " << needed << " needed, divisor " << divisor);
        REQUIRE(reduced.height() == (whole.height() + divisor - 1) / divisor);
        REQUIRE(reduced.width() == (whole.width() + divisor - 1) / divisor);
        reduced_photos += divisor > 1 ? 1 : 0;
        // A photo is turned after it is reduced, so smaller blocks may be at the other end.
        if (height % divisor != 0 || width % divisor != 0) continue;
        const image<std::uint8_t> means = means_of_blocks(whole, divisor);
        double sum = 0;
        for (std::size_t v = 0; v < means.size(); ++v) sum += std::abs(int{means.data()[v]} - int{reduced.data()[v]});
        CHECK(sum / static_cast<double>(means.size()) < 4);
        if (!is_subsampled)
            CHECK(largest_difference(reduced, means) <= 6);  // otherwise, reduced colors are sharper than the means
    }
    CHECK(reduced_photos > 10);
    CHECK(decode_photo(encode_png(smooth_picture(400, 600, 3)), {.long_side = 10}).color.width() == 600);
}

TEST_CASE("a large photo is refused if it is truncated, whether it is reduced or not, and damaged ones keep their size") {
    const byte_string file = encode_jpeg(smooth_picture(210, 230, 3), 80);
    std::mt19937 random(14);
    for (int i = 0; i < 100; ++i) {
        const std::span<const std::byte> cut = std::span(file).first(random() % file.size());
        REQUIRE(raised([&] { decode_photo(cut, {.long_side = 100}); }) == raised([&] { decode_photo(cut); }));
        REQUIRE(raised([&] { decode_photo(cut, {.long_side = 100}); }));
        const byte_string damaged = damaged_copy(file, random);
        std::optional<std::size_t> whole, reduced;
        raised([&] { whole = decode_photo(damaged, {.limits = {.max_pixels = 1 << 20}}).color.width(); });
        raised([&] { reduced = decode_photo(damaged, {.limits = {.max_pixels = 1 << 20}, .long_side = 100}).color.width(); });
        if (whole) REQUIRE(reduced);
        if (whole == std::size_t{230}) REQUIRE(reduced == std::size_t{115});
    }
}

#if defined(LDI_WITH_LIBJPEG)

TEST_CASE("libjpeg reduces sequential photos in gray and YCbCr, and leaves all other JPEG files to stb_image") {
    const auto decode = [](std::span<const std::byte> bytes, std::size_t height, std::size_t width, std::size_t divisor) {
        return detail::jpeg_decoder().decode(bytes, height, width, divisor);
    };
    for (const std::size_t divisor : {2U, 4U, 8U})
        for (const std::size_t channels : {1U, 3U})
            for (const int quality : {85, 95}) {
                const auto picture = decode(encode_jpeg(smooth_picture(33, 50, channels), quality), 33, 50, divisor);
                REQUIRE(picture.samples);
                CHECK(picture.height == (33 + divisor - 1) / divisor);
                CHECK(picture.width == (50 + divisor - 1) / divisor);
                CHECK(picture.channels == channels);
            }
    for (const char* name : {"progressive.jpg", "cmyk.jpg", "ycck.jpg"})
        CHECK_FALSE(decode(read_file(files / name), 16, 24, 2).samples);
    const byte_string file = encode_jpeg(smooth_picture(33, 50, 3), 95);
    CHECK_FALSE(decode(file, 33, 51, 2).samples);  // not the size in the header, for which memory is granted
    CHECK_FALSE(decode(std::span(file).first(file.size() - 20), 33, 50, 2).samples);
    byte_string named = file;
    for (const auto& [marker, first, step] : {std::tuple{0xC0, 10, 3}, std::tuple{0xDA, 5, 2}}) {
        const std::byte start[] = {std::byte{0xFF}, static_cast<std::byte>(marker)};
        const auto at = std::search(named.begin(), named.end(), start, start + 2);
        for (int c = 0; c < 3; ++c) at[first + step * c] = static_cast<std::byte>("RGB"[c]);
    }
    CHECK(decode_photo(named).color.width() == 50);
    CHECK_FALSE(decode(named, 33, 50, 2).samples);
}

#endif

TEST_CASE("photos of one pixel are decoded") {
    const image<std::uint8_t> picture = smooth_picture(1, 1, 3);
    CHECK(largest_difference(decode_photo(encode_png(picture)).color, picture) == 0);
    CHECK(largest_difference(decode_photo(encode_jpeg(picture, 100)).color, picture) <= 2);
}

TEST_CASE("gray, progressive, CMYK and YCCK JPEG files have the right colors") {
    const image<std::uint8_t> gray = smooth_picture(16, 24, 1);
    const image<std::uint8_t> decoded = decode_photo(encode_jpeg(gray, 95)).color;
    image<std::uint8_t> expected(16, 24, 3);
    for (std::size_t i = 0; i < expected.size(); ++i) expected.data()[i] = gray.data()[i / 3];
    CHECK(largest_difference(decoded, expected) <= 4);

    // Pillow and ImageMagick wrote the three files from these formulas.
    for (std::size_t y = 0; y < 16; ++y)
        for (std::size_t x = 0; x < 24; ++x) {
            expected(y, x, 0) = static_cast<std::uint8_t>(40 + 8 * x);
            expected(y, x, 1) = static_cast<std::uint8_t>(220 - 10 * y);
            expected(y, x, 2) = static_cast<std::uint8_t>(60 + 3 * (x + y));
        }
    CHECK(largest_difference(load_photo(files / "progressive.jpg").color, expected) <= 16);
    CHECK(largest_difference(load_photo(files / "ycck.jpg").color, expected) <= 16);
    for (std::size_t y = 0; y < 16; ++y)
        for (std::size_t x = 0; x < 24; ++x) {
            const std::size_t paper = 255 - 5 * x;  // brightness of the paper under the black ink
            expected(y, x, 0) = static_cast<std::uint8_t>((255 - 4 * x) * paper / 255);
            expected(y, x, 1) = static_cast<std::uint8_t>((255 - 10 * y) * paper / 255);
            expected(y, x, 2) = static_cast<std::uint8_t>((255 - 3 * (x + y)) * paper / 255);
        }
    CHECK(largest_difference(load_photo(files / "cmyk.jpg").color, expected) <= 8);
}

TEST_CASE("a JPEG file with four channels of unknown meaning is refused") {
    byte_string file = read_file(files / "cmyk.jpg");
    const byte_string adobe = bytes_of("Adobe");
    const auto at = std::search(file.begin(), file.end(), adobe.begin(), adobe.end());
    REQUIRE(at != file.end());
    *at = std::byte{'X'};
    CHECK(raised([&] { decode_photo(file); }) == error_code::unsupported);
}

TEST_CASE("a JPEG file whose Huffman tables have more than 256 codes is refused") {
    byte_string file = encode_jpeg(smooth_picture(8, 8, 3), 80);
    const byte_string tables = bytes_of("\xFF\xC4");
    const auto at = std::search(file.begin(), file.end(), tables.begin(), tables.end());
    REQUIRE(at != file.end());
    std::fill(at + 5, at + 21, std::byte{20});  // 16 lengths of 20 codes each
    CHECK_THAT(message_of([&] { decode_photo(file); }), Catch::Contains("a bad Huffman table"));
    CHECK(raised([&] { decode_photo(file); }) == error_code::invalid_data);
}

TEST_CASE("an animated PNG file is decoded to its first frame") {
    const image<std::uint8_t> first = smooth_picture(4, 6, 3);
    byte_string animation = png_chunk("acTL", bytes_of(std::string_view("\0\0\0\2\0\0\0\0", 8)));
    append(animation, png_chunk("fcTL", byte_string(26)));
    byte_string file = rgb_png(first, animation);
    const byte_string end = png_chunk("IEND", {});
    file.resize(file.size() - end.size());
    append(file, png_chunk("fdAT", bytes_of("the second frame")));
    append(file, end);
    CHECK(largest_difference(decode_photo(file).color, first) == 0);
}

TEST_CASE("the error for a file of an unsupported format names the file and the format") {
    const auto refused = [](std::string_view begin, const std::string& name) {
        const byte_string file = bytes_of(begin);
        CHECK(raised([&] { decode_photo(file); }) == error_code::unsupported);
        CHECK_THAT(message_of([&] { decode_photo(file, {}, "picture.jpg"); }),
                   Catch::Contains("picture.jpg") && Catch::Contains(name));
    };
    refused("8BPS????????", "a Photoshop file");
    refused(std::string_view("\0\0\0\x18"
                             "ftypqt  ????",
                             16),
            "a video file");
    for (const char* text : {"BM2 is a road; ????", "GIF8 is a format; ?", "the key WEBP ?????"})  // text files
        refused(text, "found " + std::to_string(std::string_view(text).size()) + " bytes of an unknown format");
    refused("hello, world", "12 bytes of an unknown format");
    CHECK(raised([] { decode_photo({}); }) == error_code::invalid_data);
    CHECK_THAT(message_of([] { decode_photo({}); }), Catch::Contains("an empty file"));
}

TEST_CASE("a truncated photo is always refused") {
    const image<std::uint8_t> picture = smooth_picture(24, 40, 3);
    for (const byte_string& file :
         {encode_png(picture), encode_jpeg(picture, 80), jpeg_with_exif(encode_jpeg(picture, 95), exif_bytes(6, 26)),
          read_file(files / "progressive.jpg"), read_file(files / "cmyk.jpg")})
        for (std::size_t size = 0; size < file.size(); ++size) {
            const std::optional<error_code> code = raised([&] { decode_photo(std::span(file).first(size)); });
            REQUIRE((code == error_code::invalid_data || (code == error_code::unsupported && size < 8)));
        }
}

TEST_CASE("a change of any byte after the signature of a PNG file is detected") {
    const byte_string file = rgb_png(smooth_picture(8, 8, 3));
    for (std::size_t i = 8; i < file.size(); ++i) {
        byte_string changed = file;
        changed[i] ^= std::byte{4};
        CHECK(raised([&] { decode_photo(changed); }));
    }
}

TEST_CASE("photos above the pixel limit, and photos with less data than their size requires, are refused") {
    const image<std::uint8_t> picture = smooth_picture(10, 10, 3);
    for (const byte_string& file : {encode_png(picture), encode_jpeg(picture, 80)}) {
        CHECK(decode_photo(file, {.limits = {.max_pixels = 100}}).color.width() == 10);
        CHECK(raised([&] { decode_photo(file, {.limits = {.max_pixels = 99}}); }) == error_code::too_large);
        CHECK_THAT(message_of([&] { decode_photo(file, {.limits = {.max_pixels = 99}}); }), Catch::Contains("10 x 10"));
    }
    CHECK(raised([] { decode_photo(png_file(14000, 14000, 8, 2, {})); }) == error_code::invalid_data);
    CHECK(raised([] { decode_photo(png_file(20000, 20000, 8, 2, {})); }) == error_code::invalid_data);
    byte_string jpeg = encode_jpeg(picture, 80);
    const byte_string frame = bytes_of(std::string_view("\xFF\xC0\0\x11\x08", 5));
    const auto at = std::search(jpeg.begin(), jpeg.end(), frame.begin(), frame.end());
    REQUIRE(at != jpeg.end());
    std::fill(at + 5, at + 9, std::byte{0x30});
    CHECK(raised([&] { decode_photo(jpeg); }) == error_code::invalid_data);
}

TEST_CASE("a PNG file that inflates to far more data than its picture is refused") {
    const auto inflating = [](std::size_t bytes) { return png_file(1, 1, 8, 0, byte_string(bytes, std::byte{7})); };
    CHECK(decode_photo(inflating(1)).color(0, 0, 0) == 7);
    CHECK(decode_photo(inflating(50'000)).color(0, 0, 0) == 7);  // accepted, as other readers do
    CHECK(raised([&] { decode_photo(inflating(50'000'000)); }) == error_code::invalid_data);
    CHECK_THAT(message_of([&] { decode_photo(inflating(50'000'000)); }), Catch::Contains("more data than its picture has"));
    CHECK(decode_photo(encode_png(smooth_picture(300, 200, 3))).color.height() == 300);  // the limit does not affect later files
}

TEST_CASE("a progressive JPEG file with more scans than the limit on scanned samples is refused") {
    const byte_string file = read_file(files / "progressive.jpg");
    byte_string repeated(file.begin(), file.end() - 2);
    // Each scan adds a bit, which is 0, to the averages (DC coefficients) of the first channel.
    for (int i = 0; i < 2000; ++i) append(repeated, bytes_of(std::string_view("\xFF\xDA\0\x08\1\1\0\0\0\x10\0", 11)));
    append(repeated, bytes_of("\xFF\xD9"));
    const auto decode = [&](const byte_string& bytes, std::uint64_t samples) {
        return raised([&] { decode_photo(bytes, {.limits = {.max_scanned_samples = samples}}); });
    };
    constexpr std::uint64_t pixels = 32 * 32;  // of the 24 x 16 pixels, rounded up to whole blocks
    CHECK_FALSE(decode(file, 30 * pixels));
    CHECK(decode(repeated, 30 * pixels) == error_code::too_large);
    CHECK(decode(repeated, 2000 * pixels) == error_code::too_large);
    CHECK_FALSE(decode(repeated, 2100 * pixels));
}

TEST_CASE("memory for decoding is limited to a fixed amount plus an amount per byte of the file") {
    const image<std::uint8_t> picture = smooth_picture(100, 100, 3);
    for (const byte_string& file : {encode_png(picture), encode_jpeg(picture, 80)}) {
        const std::size_t needed = estimate_photo(file).memory - detail::max_profile_memory;
        const auto decode = [&](const picture_limits& limits) { return raised([&] { decode_photo(file, {.limits = limits}); }); };
        CHECK_FALSE(decode({.max_memory = needed, .max_memory_per_byte = 0}));
        CHECK(decode({.max_memory = needed / 2, .max_memory_per_byte = 0}) == error_code::too_large);
        CHECK_FALSE(decode({.max_memory = 0, .max_memory_per_byte = needed / file.size() + 1}));
    }
}

TEST_CASE("thousands of damaged photos raise an error or are decoded") {
    const image<std::uint8_t> picture = smooth_picture(19, 27, 3);
    image<std::uint8_t> noise = picture;
    std::mt19937 random(7);
    for (std::uint8_t& v : noise) v = static_cast<std::uint8_t>(random());
    byte_string palette = png_file(8, 4, 4, 3, byte_string(16, std::byte{0x21}), png_chunk("PLTE", bytes_of("abcdefghi")));
    const byte_string originals[] = {jpeg_with_exif(encode_jpeg(picture, 85), exif_bytes(6, 26)),
                                     jpeg_with_exif(encode_jpeg(noise, 95), exif_bytes(3, 26, true)),
                                     read_file(files / "progressive.jpg"),
                                     read_file(files / "cmyk.jpg"),
                                     read_file(files / "ycck.jpg"),
                                     rgb_png(noise, png_chunk("eXIf", exif_bytes(5, 26))),
                                     png_file(4, 4, 16, 6, byte_string(128, std::byte{77})),
                                     palette};
    std::size_t decoded = 0, refused = 0;
    for (const byte_string& original : originals)
        for (int i = 0; i < 1500; ++i) {
            byte_string file = damaged_copy(original, random);
            if (file.size() > 8 && file[1] == std::byte{'P'}) file = with_right_checksums(file);
            const std::optional<error_code> code = raised([&] {
                const photo p = decode_photo(file, {.limits = {.max_pixels = 1 << 20}});
                REQUIRE(p.color.size() > 0);
            });
            ++(code ? refused : decoded);
        }
    CHECK(decoded > 1000);
    CHECK(refused > 1000);
}

TEST_CASE("a photo with a damaged EXIF block is decoded completely, and its focal length, if any, is positive") {
    const image<std::uint8_t> picture = smooth_picture(3, 5, 3);
    std::mt19937 random(8);
    for (int i = 0; i < 4000; ++i) {
        const byte_string exif = damaged_copy(exif_bytes(1 + random() % 8, 26, i % 2 == 0), random);
        const photo p = decode_photo(rgb_png(picture, png_chunk("eXIf", exif)));
        REQUIRE(p.color.size() == picture.size());
        if (p.focal_length_35mm) REQUIRE(*p.focal_length_35mm > 0);
    }
}

TEST_CASE("the photos of the published network load upright with their focal length") {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/input";
    if (!std::filesystem::exists(folder)) {
        WARN("skipped: no " << folder);
        return;
    }
    for (const char* name : {"columns.jpg", "pumpkin.jpg"}) {
        const photo p = load_photo(folder / name);
        CHECK(p.color.height() == 1024);
        CHECK(p.color.width() == 768);
        CHECK(p.focal_length_35mm == 52.0F);
    }
}
