// Writes small valid files for the fuzzers to start from, in FOLDER/photo, FOLDER/depth_map and so on. Without them, a fuzzer
// needs days to get past the first bytes of a format.
//
//     make_corpus FOLDER
#include <ldi/io/picture.hpp>
#include <tests/io/encoded_files.hpp>
#include <tests/io/gif_bmp_files.hpp>
#include <tests/io/item_files.hpp>
#include <tests/io/phone_files.hpp>

#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>

using namespace ldi;
using namespace ldi::testing;

namespace {

const image<std::uint8_t> picture = smooth_picture(12, 20, 3);
const std::filesystem::path test_files = std::filesystem::path(LDI_SOURCE_DIR) / "tests/io/files";

void add(const std::filesystem::path& folder, const std::string& name, const byte_string& file) {
    std::filesystem::create_directories(folder);
    write_file(folder / name, file);
}

byte_string rows_of(const image<std::uint8_t>& color) {
    const std::byte* const first = reinterpret_cast<const std::byte*>(color.data());
    return byte_string(first, first + color.size());
}

void add_pictures(const std::filesystem::path& folder) {
    for (const char* name : {"progressive.jpg", "cmyk.jpg", "ycck.jpg"}) add(folder, name, read_file(test_files / name));
    add(folder, "color.jpg", jpeg_with_exif(encode_jpeg(picture, 85), exif_bytes(6, 26)));
    add(folder, "gray.jpg", encode_jpeg(smooth_picture(16, 24, 1), 80));
    add(folder, "color.png", png_file(20, 12, 8, 2, rows_of(picture), png_chunk("eXIf", exif_bytes(5, 26, true))));
    add(folder, "color.bmp", bmp_file(picture));
    add(folder, "gray.bmp", bmp_file(picture, 8, true));
    image<std::uint8_t> shades(12, 20);
    for (std::size_t i = 0; i < shades.size(); ++i) shades.data()[i] = static_cast<std::uint8_t>(7 * i);
    add(folder, "rows.gif", gif_file(shades, {.transparent = 7}));
    add(folder, "interlaced.gif", gif_file(shades, {.interlaced = true, .animated = true}));
    add(folder, "deep.png", png_file(4, 4, 16, 6, byte_string(128, std::byte{77})));
    add(folder, "palette.png", png_file(8, 4, 4, 3, byte_string(16, std::byte{0x21}), png_chunk("PLTE", bytes_of("abcdefghi"))));
#if defined(LDI_WITH_LCMS2)
    add(folder, "profile.png", png_file(20, 12, 8, 2, rows_of(picture), iccp_chunk(icc_profile())));
    add(folder, "profile.jpg", with_segments(encode_jpeg(picture, 85), icc_segments(icc_profile(), 2)));
#endif
#if defined(LDI_WITH_LIBWEBP)
    add(folder, "color.webp", webp_file(picture, exif_bytes(8, 26)));
#endif
#if defined(LDI_WITH_LIBTIFF)
    add(folder, "lzw.tif", tiff_file(picture, {.orientation = 6}));
    add(folder, "packbits.tif", tiff_file(picture, {.compression = COMPRESSION_PACKBITS}));
    add(folder, "jpeg.tif", tiff_file(picture, {.compression = COMPRESSION_JPEG}));
    const image<std::uint8_t> gray = smooth_picture(24, 32, 1);
    for (const std::uint16_t fax :
         std::array<std::uint16_t, 3>{COMPRESSION_CCITTRLE, COMPRESSION_CCITTFAX3, COMPRESSION_CCITTFAX4})
        add(folder, "fax" + std::to_string(fax) + ".tif", tiff_file(gray, {.compression = fax, .bits = 1}));
    add(folder, "deflate.tif", tiff_file(picture, {.compression = COMPRESSION_ADOBE_DEFLATE, .bits = 16}));
#endif
#if defined(LDI_WITH_LIBHEIF)
    image<std::uint8_t> transparent(12, 20, 4, 99);
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1})
        if (const std::optional<byte_string> file = heif_file_of(transparent, {format, exif_bytes(6, 26), {}, 0})) {
            add(folder, "alpha" + std::to_string(format) + ".heif", *file);
            add(folder, "depth" + std::to_string(format) + ".heif", alpha_called_depth(*file));
            const coded_picture coded = coded_picture_of(*heif_file_of(smooth_picture(64, 64, 3), {format, {}, {}, 0}));
            for (const auto& [name, items] : hostile_item_files(coded))
                add(folder, name + std::to_string(format) + ".heif", items);
        }
#endif
}

/// Adds photos whose metadata repeats one entry.
void add_lists_of_lists(const std::filesystem::path& folder, const byte_string& color) {
    std::string properties;
    for (int i = 0; i < 50; ++i) properties += "<a:b/>";
    add(folder, "namespace.jpg",
        with_segments(color, xmp_segment("<r xmlns:a=\"" + std::string(300, 'A') + "/\">" + properties + "</r>")));
    byte_string directory = bytes_of(std::string_view("MPF\0MM\0*\0\0\0\x08", 12));
    append(directory, big_endian(20, 2));
    for (int i = 0; i < 20; ++i) append(directory, bytes_of(std::string_view("\xB0\x02\0\7\0\0\1\0\0\0\0\x0A", 12)));
    directory.resize(400);
    add(folder, "directory.jpg", with_segments(color, jpeg_segment(0xE2, directory)));
}

void add_photos_with_depth(const std::filesystem::path& folder) {
    const byte_string color = encode_jpeg(picture, 80), depth = encode_png(smooth_picture(6, 10, 1)),
                      gain = encode_jpeg(smooth_picture(6, 10, 1), 80);
    add(folder, "gdepth.jpg",
        gdepth_jpeg(color, depth, "GDepth:Near=\"2\" GDepth:Far=\"8\" GDepth:Format=\"RangeLinear\" GDepth:Units=\"m\""));
    const std::string identifier(32, 'A'), space = gdepth_space;
    byte_string parts = xmp_segment(xmp_packet(
        space + "xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\" GDepth:Near=\"1\" GDepth:Far=\"2\" xmpNote:HasExtendedXMP=\"" +
        identifier + "\""));
    append(parts, extended_xmp_segments(xmp_packet(space + "GDepth:Data=\"" + base64(depth) + "\""), identifier, 200));
    add(folder, "extended.jpg", with_segments(color, parts));
    const std::string fields = "DepthMap:Near=\"0.5\" DepthMap:Far=\"4\" DepthMap:Units=\"Meters\"";
    add(folder, "dynamic.jpg",
        dynamic_depth_jpeg(color, {{"GainMap", "", gain}, {"Depth", "", depth}, {"Confidence", "", depth}}, fields));
    add(folder, "photos.jpg", dynamic_depth_jpeg(color, {{"Depth", "", depth}}, fields, photos_words));
    add(folder, "apple.jpg",
        multi_picture_jpeg(color, {gain, with_segments(gain, xmp_segment(apple_packet("disparity", "0.5", "4")))}));
    add_lists_of_lists(folder, color);
    image<std::uint8_t> both(12, 40, 3);
    for (std::size_t i = 0; i < both.size(); ++i)
        both.data()[i] = i / 3 % 40 < 20 ? static_cast<std::uint8_t>(70 * (i % 3) + i / 120)
                                         : static_cast<std::uint8_t>(5 * (i / 3 % 20) + i / 120);
    add(folder, "beside.png", encode_png(both));
}

void add_depth_maps(const std::filesystem::path& folder) {
    add(folder, "gray.png", encode_png(smooth_picture(9, 7, 1)));
    add(folder, "gray.jpg", encode_jpeg(smooth_picture(9, 7, 1), 80));
    image<std::uint16_t> deep(9, 7);
    for (std::size_t i = 0; i < deep.size(); ++i) deep.data()[i] = static_cast<std::uint16_t>(1000 * i);
    add(folder, "color.bmp", bmp_file(picture));
    add(folder, "gray.bmp", bmp_file(picture, 8, true));
    image<std::uint8_t> shades(12, 20);
    for (std::size_t i = 0; i < shades.size(); ++i) shades.data()[i] = static_cast<std::uint8_t>(7 * i);
    add(folder, "rows.gif", gif_file(shades, {.transparent = 7}));
    add(folder, "interlaced.gif", gif_file(shades, {.interlaced = true, .animated = true}));
    add(folder, "deep.png", encode_png(deep));
    const std::string floats(24, '@'), doubles(48, '@');  // floats of about 3, doubles of about 32.5
    add(folder, "map.pfm", bytes_of("Pf\n3 2\n-1.0\n" + floats));
    for (const std::string type : {"<f4", "<f8"}) {
        const std::string head = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (2, 3), }\n";
        byte_string file = bytes_of(std::string_view("\x93NUMPY\1\0", 8));
        file.push_back(static_cast<std::byte>(head.size())), file.push_back(std::byte{0});
        append(file, bytes_of(head + (type == "<f4" ? floats : doubles)));
        add(folder, type.substr(1) + ".npy", file);
    }
}

void add_key_frames(const std::filesystem::path& folder) {
    add(folder, "one.json", bytes_of(R"([{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2]}])"));
    add(folder, "two.json", bytes_of(R"([{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2]},
        {"time": 1.5e0, "position": [0.1, -2, 3], "target": [0, 1, -2], "zoom": 1.2}])"));
}

/// Adds inputs in the format that tests/fuzz/geometry.cpp defines.
void add_geometry(const std::filesystem::path& folder) {
    for (unsigned kind = 0; kind < 8; ++kind) {
        byte_string bytes = {static_cast<std::byte>(20), static_cast<std::byte>(14), static_cast<std::byte>(kind),
                             std::byte{128}};
        for (unsigned i = 0; i < 20 * 14; ++i) {
            const bool is_near = i % 20 > 6 && i % 20 < 13 && i / 20 > 4;
            bytes.push_back(static_cast<std::byte>((is_near ? 200 : 40) + i % 3));
        }
        add(folder, std::to_string(kind), bytes);
    }
}

}  // namespace

int main(int count, char** values) {
    if (count != 2) return 2;
    const std::filesystem::path folder = values[1];
    try {
        add_pictures(folder / "photo");
        add_photos_with_depth(folder / "photo");
        add_depth_maps(folder / "depth_map");
        add_key_frames(folder / "key_frames");
        add_geometry(folder / "geometry");
    } catch (const std::exception& e) {
        std::fprintf(stderr, "make_corpus: %s\n", e.what());
        return 1;
    }
    return 0;
}
