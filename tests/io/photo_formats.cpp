// HEIC, AVIF, WebP, TIFF, and color profiles. Formats without their library are not tested.
#include <ldi/io/photo_depth.hpp>

#include <catch2/catch.hpp>
#include <ldi/io/picture.hpp>
#include <tests/io/encoded_files.hpp>
#include <tests/io/item_files.hpp>

#include <algorithm>
#include <array>
#include <cmath>

using namespace ldi;
using namespace ldi::testing;

namespace {

const image<std::uint8_t> small_picture = smooth_picture(34, 50, 3);

image<std::uint8_t> with_alpha(const image<std::uint8_t>& color) {
    image<std::uint8_t> all(color.height(), color.width(), 4);
    for (std::size_t i = 0; i < color.size() / 3; ++i) {
        for (std::size_t c = 0; c < 3; ++c) all.data()[4 * i + c] = color.data()[3 * i + c];
        all.data()[4 * i + 3] = static_cast<std::uint8_t>(40 + i % 200);
    }
    return all;
}

/// Composites a picture on white, in double precision.
image<std::uint8_t> on_white(const image<std::uint8_t>& all) {
    image<std::uint8_t> color(all.height(), all.width(), 3);
    for (std::size_t i = 0; i < color.size(); ++i) {
        const double alpha = all.data()[4 * (i / 3) + 3] / 255.0;
        color.data()[i] = static_cast<std::uint8_t>(std::lround(alpha * all.data()[4 * (i / 3) + i % 3] + 255 * (1 - alpha)));
    }
    return color;
}

/// Converts Display P3 to sRGB, through linear light with the standards' matrix.
[[maybe_unused]] image<std::uint8_t> p3_to_srgb(const image<std::uint8_t>& p3) {
    const double matrix[3][3] = {{1.22494, -0.22494, 0}, {-0.04206, 1.04206, 0}, {-0.01964, -0.07864, 1.09828}};
    image<std::uint8_t> srgb(p3.height(), p3.width(), 3);
    for (std::size_t i = 0; i < p3.size(); i += 3)
        for (std::size_t c = 0; c < 3; ++c) {
            double light = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double v = p3.data()[i + k] / 255.0;
                light += matrix[c][k] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
            }
            light = std::clamp(light, 0.0, 1.0);
            srgb.data()[i + c] = static_cast<std::uint8_t>(
                std::lround(255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055)));
        }
    return srgb;
}

[[maybe_unused]] void check_damaged_copy(const byte_string& file, std::mt19937& random) {
    photo decoded;
    const bool is_refused =
        raised([&] { decoded = decode_photo(damaged_copy(file, random), {.limits = {.max_pixels = 1 << 20}}); }).has_value();
    REQUIRE(decoded.color.empty() == is_refused);
}

/// Checks that every truncated file raises an error other than file_access, and that damaged files become a picture or raise
/// an error.
[[maybe_unused]] void check_damage(const byte_string& file, int copies) {
    std::mt19937 random(10);
    for (std::size_t size = 12; size < file.size(); size += 1 + file.size() / 100)
        REQUIRE(raised([&] { decode_photo(std::span(file).first(size)); }));
    for (int i = 0; i < copies; ++i) check_damaged_copy(file, random);
}

}  // namespace

#if defined(LDI_WITH_LIBHEIF)

namespace {

/// Codes a picture as HEVC. Returns nothing, with a warning, if libheif has no encoder.
[[maybe_unused]] std::optional<coded_picture> hevc_of(const image<std::uint8_t>& picture) {
    const std::optional<byte_string> file = heif_file_of(picture);
    if (file) return coded_picture_of(*file);
    WARN("skipped: libheif has no HEVC encoder");
    return std::nullopt;
}

}  // namespace

TEST_CASE("HEIC and AVIF photos are decoded exactly, with their focal length, and damaged ones raise an error or are decoded") {
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1}) {
        const std::optional<byte_string> file = heif_file_of(small_picture, {format, exif_bytes(6, 26), {}, 0});
        if (!file) {
            WARN("skipped: libheif has no encoder of format " << format);
            continue;
        }
        const photo decoded = decode_photo(*file);
        CHECK(largest_difference(decoded.color, small_picture) ==
              0);  // not rotated, because the EXIF orientation does not apply to HEIF
        CHECK(decoded.focal_length_35mm == 26.0F);
        CHECK(raised([&] { decode_photo(*file, {.limits = {.max_pixels = 34 * 50 - 1}}); }) == error_code::too_large);
        check_damage(*file, 60);
        CHECK_THAT(message_of([&] { decode_photo(std::span(*file).first(file->size() / 2)); }), !Catch::Contains("\\x0A"));
        const image<std::uint8_t> transparent = with_alpha(small_picture);
        if (const std::optional<byte_string> with = heif_file_of(transparent, {format, {}, {}, 0}))
            CHECK(largest_difference(decode_photo(*with).color, on_white(transparent)) <= 1);
        image<std::uint8_t> multiplied = transparent;
        for (std::size_t i = 0; i < multiplied.size(); ++i)
            multiplied.data()[i] = i % 4 == 3
                                       ? multiplied.data()[i]
                                       : static_cast<std::uint8_t>(multiplied.data()[i] * multiplied.data()[i / 4 * 4 + 3] / 255);
        if (const std::optional<byte_string> with = heif_file_of(multiplied, {.format = format, .is_premultiplied = true}))
            CHECK(largest_difference(decode_photo(*with).color, on_white(transparent)) <= 1);
    }
}

TEST_CASE("a photo refused by libheif raises an error of one line, with a hint if libheif is old") {
    // A picture without a decoder configuration.
    const byte_string file =
        item_file({.items = {{1, "hvc1", {{0, 4}}}}, .properties = {size_box(64, 64)}, .uses = {{1, {1}}}}, byte_string(4));
    const std::string message = message_of([&] { decode_photo(file, {}, "a.heic"); });
    CHECK_THAT(message, Catch::Contains("a.heic") && !Catch::Contains("\n"));
    if (heif_get_version_number() < 0x01130800)
        CHECK_THAT(message, Catch::Contains("1.19.8") && Catch::Contains("update libheif, or save the photo as JPEG"));
}

#if defined(LDI_WITH_PUGIXML)
TEST_CASE("auxiliary depth pictures of HEIC and AVIF files are found, and alpha pictures are not read as depth") {
    const image<std::uint8_t> both = with_alpha(small_picture);
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1}) {
        const std::optional<byte_string> file = heif_file_of(both, {format, {}, {}, 0});
        if (!file) continue;
        CHECK_FALSE(decode_photo_with_depth(*file).depth);
        const photo_with_depth found = decode_photo_with_depth(alpha_called_depth(*file));
        INFO(found.refused);
        REQUIRE(found.depth);
        CHECK_FALSE(found.depth->is_inverse_depth);
        for (std::size_t i = 0; i < small_picture.size() / 3; ++i)
            REQUIRE(found.depth->disparity.data()[i] == Approx(both.data()[4 * i + 3] / 255.0).margin(1.01 / 255));
    }
}

TEST_CASE("a HEIC depth picture of distances without a range is inverted; without any statement, white near is a guess") {
    image<std::uint8_t> gray(64, 64, 3);
    for (std::size_t i = 0; i < gray.size(); ++i) gray.data()[i] = static_cast<std::uint8_t>(i / 3 % 256);
    const std::optional<coded_picture> picture = hevc_of(gray);
    if (!picture) return;
    const auto depth_of = [&](std::string_view messages) {
        const std::vector<std::pair<std::size_t, std::size_t>> place = {{0, picture->data.size()}};
        const photo_with_depth found = decode_photo_with_depth(item_file(
            {{{1, "hvc1", place}, {2, "hvc1", place}},
             {picture->configuration, size_box(64, 64), color_box(), auxiliary_box("urn:mpeg:hevc:2015:auxid:2", messages)},
             {{1, {1, 2, 3}}, {2, {1, 2, 4}}},
             {{"auxl", 2, {1}}}},
            picture->data));
        INFO(found.refused);
        REQUIRE(found.depth);
        return *found.depth;
    };
    const photo_depth unstated = depth_of({});
    CHECK(unstated.is_white_near_a_guess);
    CHECK(unstated.disparity(0, 51) == Approx(0.2).margin(0.005));
    // the length of all messages, then one with its length: depth representation information of type 2 (uniform Z), no numbers
    const photo_depth distances = depth_of(std::string_view("\0\0\0\x9\0\0\0\5\x4e\1\xb1\1\7", 13));
    CHECK_FALSE(distances.is_white_near_a_guess);
    CHECK(distances.disparity(0, 51) == Approx(0.8).margin(0.005));
    // type 1, uniform disparity
    const photo_depth disparities = depth_of(std::string_view("\0\0\0\x9\0\0\0\5\x4e\1\xb1\1\5", 13));
    CHECK_FALSE(disparities.is_white_near_a_guess);
    CHECK(disparities.disparity(0, 51) == Approx(0.2).margin(0.005));
}

TEST_CASE("a HEIC photo of a phone is read: a grid of 48 tiles, rotated, with EXIF, thumbnail, gain map and disparity") {
    constexpr std::uint32_t rows = 6, columns = 8, side = 64, width = 500, height = 372;
    const image<std::uint8_t> picture = smooth_picture(rows * side, columns * side, 3), gray = smooth_picture(72, 96, 1);
    std::vector<coded_picture> tiles;
    for (std::uint32_t row = 0; row < rows; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            image<std::uint8_t> tile(side, side, 3);
            for (std::size_t y = 0; y < side; ++y)
                std::copy_n(picture.row(row * side + y) + 3 * std::size_t{column * side}, 3 * side, tile.row(y));
            const std::optional<coded_picture> coded = hevc_of(tile);
            if (!coded) return;
            tiles.push_back(*coded);
            REQUIRE(tiles.back().configuration == tiles.front().configuration);
        }
    image<std::uint8_t> as_color(gray.height(), gray.width(), 3);
    for (std::size_t i = 0; i < as_color.size(); ++i) as_color.data()[i] = gray.data()[i / 3];
    const byte_string file =
        phone_heic(tiles, columns, side, width, height, hevc_of(as_color).value(), 96, 72, exif_bytes(6, 26));

    const photo_with_depth found = decode_photo_with_depth(file);
    CHECK(found.photo.focal_length_35mm == 26.0F);
    REQUIRE(found.photo.color.height() == width);
    REQUIRE(found.photo.color.width() == height);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < 3; ++c) REQUIRE(found.photo.color(x, height - 1 - y, c) == picture(y, x, c));
    INFO(found.refused);
    REQUIRE(found.depth);
    CHECK(found.depth->is_inverse_depth);
    REQUIRE(found.depth->disparity.height() == 96);
    for (std::size_t y = 0; y < 72; ++y)
        for (std::size_t x = 0; x < 96; ++x) {
            const double expected = 1 + 2 * gray(y, x) / 255.0;
            REQUIRE(found.depth->disparity(x, 71 - y) == Approx(expected).margin(2.1 / 255));
        }
    const decoding_estimate estimate = estimate_photo_with_depth(file);
    CHECK(estimate.height == height);
    CHECK(estimate.width == width);
}
#endif

#if defined(LDI_WITH_LCMS2)
TEST_CASE("HEIC photos in PQ and HLG keep light up to half a white page, and their highlights approach white") {
    image<std::uint8_t> ramp(64, 256, 3);
    for (std::size_t i = 0; i < ramp.size(); ++i) ramp.data()[i] = static_cast<std::uint8_t>(i / 3 % 256);
    const std::optional<coded_picture> picture = hevc_of(ramp);
    if (!picture) return;
    for (const char transfer : {'\x10', '\x12'})
        for (const char primaries : {'\1', '\x9'}) {
            const photo decoded =
                decode_photo(item_file({{{1, "hvc1", {{0, picture->data.size()}}}},
                                        {picture->configuration, size_box(256, 64), color_box(primaries, transfer)},
                                        {{1, {1, 2, 3}}}},
                                       picture->data));
            CAPTURE(int{transfer}, int{primaries});
            for (std::size_t x = 0; x < 256; ++x) {
                const double sample = static_cast<double>(x) / 255;
                // BT.2100, tables 4 and 5: light in cd/m2 on a display with a peak of 10,000 (PQ) or 1,000 (HLG)
                const double power = std::pow(sample, 1 / 78.84375);
                const double pq =
                    10000 * std::pow(std::max(power - 0.8359375, 0.0) / (18.8515625 - 18.6875 * power), 1 / 0.1593017578125);
                const double scene =
                    sample <= 0.5 ? sample * sample / 3 : (std::exp((sample - 0.55991073) / 0.17883277) + 0.28466892) / 12;
                const double light = (transfer == '\x10' ? pq : 1000 * std::pow(scene, 1.2)) / 203;
                const double shown = light <= 0.5 ? light : 1 - 0.5 * std::exp(1 - 2 * light);
                const double expected = 255 * (shown <= 0.0031308 ? 12.92 * shown : 1.055 * std::pow(shown, 1 / 2.4) - 0.055);
                for (std::size_t c = 0; c < 3; ++c) REQUIRE(decoded.color(10, x, c) == Approx(expected).margin(2.5));
            }
        }
}
#endif

#endif

#if defined(LDI_WITH_LIBWEBP)

TEST_CASE("WebP photos are decoded exactly: upright, composited on white, and with their focal length") {
    CHECK(largest_difference(decode_photo(webp_file(small_picture)).color, small_picture) == 0);
    const image<std::uint8_t> transparent = with_alpha(small_picture);
    CHECK(largest_difference(decode_photo(webp_file(transparent)).color, on_white(transparent)) <= 1);
    const photo turned = decode_photo(webp_file(small_picture, exif_bytes(8, 26)));
    CHECK(turned.focal_length_35mm == 26.0F);
    REQUIRE(turned.color.height() == 50);
    CHECK(turned.color(49, 0, 0) == small_picture(0, 0, 0));  // EXIF orientation 8: top left becomes bottom left
    CHECK(turned.color(0, 0, 0) == small_picture(0, 49, 0));
    CHECK(raised([&] { decode_photo(webp_file(small_picture), {.limits = {.max_pixels = 34 * 50 - 1}}); }) ==
          error_code::too_large);
    check_damage(webp_file(small_picture, exif_bytes(8, 26)), 1000);
}

#endif

#if defined(LDI_WITH_LIBTIFF)

TEST_CASE(
    "TIFF photos with baseline JPEG are decoded; with progressive JPEG or any compression that ldi does not list, they are "
    "unsupported") {
    const byte_string jpeg = tiff_file(small_picture, {.compression = COMPRESSION_JPEG});
    CHECK(largest_difference(decode_photo(jpeg).color, small_picture) < 60);
    byte_string progressive = jpeg;
    for (std::size_t i = 0; i + 1 < progressive.size(); ++i)
        if (progressive[i] == std::byte{0xFF} && progressive[i + 1] == std::byte{0xC0}) progressive[i + 1] = std::byte{0xC2};
    CHECK(raised([&] { decode_photo(progressive); }) == error_code::unsupported);
    CHECK_THAT(message_of([&] { decode_photo(progressive); }), Catch::Contains("progressive JPEG"));
    // libjpeg skips stray bytes and fill bytes before a marker.
    const byte_string strip = bytes_of(std::string_view("\xFF\xD8zz\xFF\xFF\xE0\0\4ab\xFF\xFF\xC2\0\x0B", 16));
    CHECK(detail::is_progressive_jpeg(strip));
    CHECK_FALSE(detail::is_progressive_jpeg(std::span(strip).first(11)));
    const byte_string lzw = tiff_file(small_picture, {.compression = COMPRESSION_LZW});
    const byte_string entry = bytes_of(std::string_view("\3\1\3\0\1\0\0\0\5\0", 10));  // the tag, one SHORT, LZW
    const auto at = std::search(lzw.begin(), lzw.end(), entry.begin(), entry.end()) - lzw.begin();
    for (const unsigned compression : {6U, 34661U, 34712U, 34887U, 34925U, 50000U, 50001U, 65000U}) {
        byte_string other = lzw;
        other.at(static_cast<std::size_t>(at) + 8) = static_cast<std::byte>(compression & 255);
        other.at(static_cast<std::size_t>(at) + 9) = static_cast<std::byte>(compression >> 8);
        CHECK(raised([&] { decode_photo(other); }) == error_code::unsupported);
        CHECK(raised([&] { estimate_photo(other); }) == error_code::unsupported);
    }
}

TEST_CASE("TIFF photos of 8 and 16 bits are decoded exactly, in all orientations") {
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS})
        for (const std::uint16_t bits : {std::uint16_t{8}, std::uint16_t{16}}) {
            const byte_string file =
                tiff_file(small_picture, {.compression = static_cast<std::uint16_t>(compression), .bits = bits});
            CHECK(largest_difference(decode_photo(file).color, small_picture) == 0);
        }
    const image<std::uint8_t> transparent = with_alpha(small_picture);
    CHECK(largest_difference(decode_photo(tiff_file(transparent)).color, on_white(transparent)) <= 1);
    for (unsigned orientation = 1; orientation <= 8; ++orientation) {
        const photo tiff = decode_photo(tiff_file(small_picture, {.orientation = static_cast<std::uint16_t>(orientation)}));
        const photo png =
            decode_photo(png_file(50, 34, 8, 2,
                                  byte_string(reinterpret_cast<const std::byte*>(small_picture.data()),
                                              reinterpret_cast<const std::byte*>(small_picture.data()) + small_picture.size()),
                                  png_chunk("eXIf", exif_bytes(orientation, 0))));
        CHECK(largest_difference(tiff.color, png.color) == 0);
    }
    CHECK(raised([&] { decode_photo(tiff_file(small_picture), {.limits = {.max_pixels = 34 * 50 - 1}}); }) ==
          error_code::too_large);
    const auto result_with = [&](std::uint64_t samples) {
        return raised([&] { decode_photo(tiff_file(small_picture), {.limits = {.max_scanned_samples = samples}}); });
    };
    CHECK_FALSE(result_with(34 * 50 * 3));
    CHECK(result_with(34 * 50 * 3 - 1) == error_code::too_large);
    const byte_string raw = tiff_file(small_picture, {.subfile_type = FILETYPE_REDUCEDIMAGE});
    CHECK(raised([&] { decode_photo(raw); }) == error_code::unsupported);
    CHECK_THAT(message_of([&] { decode_photo(raw); }), Catch::Contains("raw"));
    std::mt19937 random(11);
    const byte_string file = tiff_file(small_picture);
    for (int i = 0; i < 1000; ++i) check_damaged_copy(file, random);
}

#endif

#if defined(LDI_WITH_LCMS2)

TEST_CASE(
    "Display P3 photos of every format are converted to sRGB, whether a profile or AVIF's color code states the color space") {
    const image<std::uint8_t> expected = p3_to_srgb(small_picture);
    REQUIRE(largest_difference(expected, small_picture) > 10);
    const byte_string icc = icc_profile();
    const auto difference = [&](const byte_string& file) { return largest_difference(decode_photo(file).color, expected); };
    const byte_string rows(reinterpret_cast<const std::byte*>(small_picture.data()),
                           reinterpret_cast<const std::byte*>(small_picture.data()) + small_picture.size());
    CHECK(difference(png_file(50, 34, 8, 2, rows, iccp_chunk(icc))) <= 2);
    for (std::size_t parts : {std::size_t{1}, std::size_t{3}}) {
        byte_string jpeg = encode_jpeg(small_picture, 100);
        const byte_string segments = icc_segments(icc, parts);
        jpeg.insert(jpeg.begin() + 2, segments.begin(), segments.end());
        CHECK(difference(jpeg) <= 10);
    }
#if defined(LDI_WITH_LIBWEBP)
    CHECK(difference(webp_file(small_picture, {}, icc)) <= 2);
#endif
#if defined(LDI_WITH_LIBTIFF)
    CHECK(difference(tiff_file(small_picture, {.icc = icc})) <= 2);
#endif
#if defined(LDI_WITH_LIBHEIF)
    if (const std::optional<byte_string> file = heif_file_of(small_picture, {heif_compression_HEVC, {}, icc, 0}))
        CHECK(difference(*file) <= 2);
    if (const std::optional<byte_string> file = heif_file_of(small_picture, {heif_compression_AV1, {}, {}, 12}))
        CHECK(difference(*file) <= 2);
#endif
}

TEST_CASE("a gray profile is applied, and a damaged profile does not prevent decoding") {
    const image<std::uint8_t> gray = smooth_picture(6, 7, 1);
    const byte_string rows(reinterpret_cast<const std::byte*>(gray.data()),
                           reinterpret_cast<const std::byte*>(gray.data()) + gray.size());
    const image<std::uint8_t> light = decode_photo(png_file(7, 6, 8, 0, rows, iccp_chunk(icc_profile(true)))).color;
    for (std::size_t i = 0; i < light.size(); ++i) {
        const double v = gray.data()[i / 3] / 255.0;  // linear
        CHECK(light.data()[i] == Approx(255 * (1.055 * std::pow(v, 1 / 2.4) - 0.055)).margin(2));
    }
    std::mt19937 random(12);
    const byte_string icc = icc_profile();
    CHECK(largest_difference(decode_photo(png_file(7, 6, 8, 0, rows, png_chunk("iCCP", bytes_of("x")))).color,
                             decode_photo(png_file(7, 6, 8, 0, rows)).color) == 0);
    for (int i = 0; i < 300; ++i)
        CHECK(decode_photo(png_file(7, 6, 8, 0, rows, iccp_chunk(damaged_copy(icc, random)))).color.size() == 126);
}

#endif
