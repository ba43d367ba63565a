// Hostile files: small ones that request much memory or endless work. SECURITY.md states the guarantees; tests/hostile runs the
// program on about a hundred more of them.
#include <ldi/io/photo_depth.hpp>

#include <catch2/catch.hpp>
#include <ldi/io/detail/heif_items.hpp>
#include <ldi/io/picture.hpp>
#include <tests/io/encoded_files.hpp>
#include <tests/io/gif_bmp_files.hpp>
#include <tests/io/item_files.hpp>
#include <tests/io/phone_files.hpp>
#include <tests/support/peak_memory.hpp>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <zlib.h>

using namespace ldi;
using namespace ldi::testing;
using ldi::testing::measures_resident_memory;
using ldi::testing::peak_memory;

namespace {

constexpr double megabyte = 1e6;
const image<std::uint8_t> small = smooth_picture(24, 32, 3);
const byte_string small_jpeg = encode_jpeg(small, 80);
const std::string identifier(32, 'A');

/// A JPEG file with this XMP packet, split into as many segments as necessary.
byte_string with_extended_xmp(const std::string& packet) {
    byte_string segments =
        xmp_segment(xmp_packet("xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\" xmpNote:HasExtendedXMP=\"" + identifier + "\""));
    append(segments, extended_xmp_segments(packet, identifier, 60'000));
    return with_segments(small_jpeg, segments);
}

/// Memory for decoding, in bytes per byte of the file.
double memory_per_byte(const byte_string& file) {
    const std::optional<double> bytes = peak_memory([&] { decode_photo_with_depth(file); });
    REQUIRE(bytes);
    return *bytes / static_cast<double>(file.size());
}

std::string repeated(const std::string& text, int count) {
    std::string result;
    for (int i = 0; i < count; ++i) result += text;
    return result;
}

}  // namespace

#if defined(LDI_WITH_PUGIXML)

TEST_CASE("thousands of XMP properties with one long namespace need less than 20 bytes of memory per byte of the file") {
    const byte_string file =
        with_extended_xmp("<r xmlns:a=\"" + std::string(400'000, 'A') + "\">" + repeated("<a:b/>", 9990) + "</r>");
    CHECK(memory_per_byte(file) < 20);
    CHECK_FALSE(decode_photo_with_depth(file).depth);
}

TEST_CASE("XMP with many elements, attributes or levels needs bounded memory per byte, and is refused above the limit") {
    std::string attributes = "<r";
    for (int i = 0; i < 100'000; ++i) attributes += " a" + std::to_string(i) + "=\"\"";
    for (const std::string& packet :
         {"<r>" + repeated("<a/>", 200'000) + "</r>", attributes + "/>", repeated("<a:b xmlns:a=\"u\">", 50'000)}) {
        const byte_string file = with_extended_xmp(packet);
        CHECK(memory_per_byte(file) < 140);
        const photo_with_depth found =
            decode_photo_with_depth(file, {.limits = {.max_memory = 2'000'000, .max_memory_per_byte = 1}});
        CHECK_THAT(found.refused, Catch::Contains("XMP of"));
    }
}

TEST_CASE(
    "an XMP prefix stands for the namespace of the nearest enclosing declaration, and is undefined outside of its declarations") {
    const byte_string packet = bytes_of(
        "<r xmlns:a='outer/'><a:one/><s xmlns:a='inner' a:two='2'><a:three>3</a:three></s><s a:four=''/><b:five/>"
        "<s xmlns:b='sibling'/><s b:six=''/><a:s xmlns:a='own'/></r>");
    detail::decoding_budget budget({}, {}, 0);
    detail::xmp_properties xmp;
    xmp.add(packet, budget, "file");
    std::vector<std::string> found;
    for (const detail::xmp_property& p : xmp.all()) found.push_back(std::string(p.space) + ":" + std::string(p.name));
    CHECK(found == std::vector<std::string>{"outer:one", "inner:two", "inner:three", "outer:four", "own:s"});
}

TEST_CASE("only the first 16 XMP packets of a JPEG file are read, and each counts as at least 32 KiB toward the memory limit") {
    const byte_string packet = bytes_of("<a b:c='1' xmlns:b='u'/>");
    detail::decoding_budget budget({}, {}, 0);
    detail::xmp_properties xmp;
    for (int i = 0; i < 1000; ++i) xmp.add(packet, budget, "file");
    CHECK(xmp.all().size() == 16);
    CHECK(budget.charged() > 16 * 32768);
    CHECK(budget.charged() < 16 * 34'000);

    byte_string segments;
    for (int i = 0; i < 20'000; ++i) append(segments, xmp_segment("<a/>"));
    CHECK(memory_per_byte(with_segments(small_jpeg, segments)) < 20);
}

TEST_CASE("a Multi-Picture Format directory that repeats its list of pictures is read only once") {
    constexpr std::uint32_t entries = 5000;
    byte_string tiff = bytes_of(std::string_view("MM\0*\0\0\0\x08", 8));
    append(tiff, big_endian(entries, 2));
    for (std::uint32_t i = 0; i < entries; ++i) {
        append(tiff, big_endian(0xB0020007, 4));
        append(tiff, big_endian(60'000, 4)), append(tiff, big_endian(10, 4));
    }
    tiff.resize(65'000);
    byte_string segment = bytes_of(std::string_view("MPF\0", 4));
    append(segment, tiff);
    CHECK(detail::list_pictures(segment, segment).size() <= 16);
    const byte_string file = with_segments(small_jpeg, jpeg_segment(0xE2, segment));
    CHECK(memory_per_byte(file) < 20);
    CHECK_FALSE(decode_photo_with_depth(file).depth);
}

TEST_CASE("decoding a depth map inside a photo needs less than 9 bytes per pixel; filling its holes adds less than 4.5") {
    constexpr std::uint32_t width = 4000, height = 3000;
    byte_string rows(std::size_t{width} * height, std::byte{90});
    const byte_string depth = png_file(width, height, 8, 0, rows);
    const byte_string file =
        gdepth_jpeg(small_jpeg, depth, "GDepth:Near=\"1\" GDepth:Far=\"100\" GDepth:Format=\"RangeInverse\"");
    const auto per_pixel = [&](auto&& call) {
        const std::optional<double> bytes = peak_memory(call);
        REQUIRE(bytes);
        return *bytes / (double{width} * height);
    };
    CHECK(decode_photo_with_depth(file).depth);
    CHECK(per_pixel([&] { decode_photo_with_depth(file); }) < 9);
    image<float> map(height, width, 1, std::numeric_limits<float>::quiet_NaN());
    map(5, 7) = 1;
    CHECK(per_pixel([&] { fill_invalid(std::move(map)); }) < 4.5);  // without the map itself
}

TEST_CASE("one memory limit covers the photo, its depth map and the map's confidence together") {
    const byte_string depth = encode_png(smooth_picture(96, 128, 1)), photo = encode_jpeg(smooth_picture(96, 128, 3), 80);
    const byte_string file =
        dynamic_depth_jpeg(photo, {{"Depth", "", depth}, {"Confidence", "", depth}}, "DepthMap:Near=\"0.5\" DepthMap:Far=\"4\"");
    const std::size_t of_photo = estimate_photo(photo).memory, of_map = estimate_depth_map(depth).memory;
    const auto refused_within = [&](std::size_t bytes) {
        return decode_photo_with_depth(file, {.limits = {.max_memory = bytes, .max_memory_per_byte = 0}}).refused;
    };
    CHECK(decode_photo_with_depth(file).depth);
    CHECK(refused_within(2 * of_photo + 2 * of_map) == "");
    // The limits allow first the photo and its map, then only the photo, then nothing.
    const std::size_t decoding = of_photo - detail::max_profile_memory;
    CHECK_THAT(refused_within(decoding + of_map + of_map / 2), Catch::Contains("confidence") && Catch::Contains("are left"));
    CHECK_THAT(refused_within(decoding + of_map / 2), Catch::Contains("Dynamic Depth") && Catch::Contains("are left"));
    CHECK(raised([&] { refused_within(decoding / 2); }) == error_code::too_large);
}

#endif

TEST_CASE("AV1 frames have the size of their sequence header unless they state their own, which may be larger") {
    // Sequence header of a picture of 100 x 66 by SVT-AV1, and the first two bytes of its frame. The second byte of a frame that
    // states its own size has another bit.
    const auto size_of = [](std::string_view units) {
        std::optional<detail::av1_sequence> sequence;
        std::size_t units_left = 10;
        return detail::size_in_av1_units(bytes_of(units), units_left, sequence);
    };
    const std::string sequence("\x0a\x0a\0\0\0\x03\x36\x38\x27\xdf\xcc\x02", 12);
    for (const std::string& units : {sequence, sequence + std::string("\x32\x02\x10\0", 4)}) {
        const detail::coded_size size = size_of(units);
        CHECK(size.width == 100);
        CHECK(size.height == 66);
        CHECK(size.pictures == (units == sequence ? 0 : 1));
    }
    const detail::coded_size own = size_of(sequence + std::string("\x32\x02\x12\0", 4));
    CHECK(own.width == 128);
    CHECK(own.height == 128);
}

TEST_CASE("each slice of a HEIC item counts as a picture, because each may cover the whole picture") {
    byte_string record(23);
    record[21] = std::byte{3};  // lengths of units have four bytes
    const auto code_of = [&](std::size_t slices, std::uint32_t side) {
        byte_string data;
        for (std::size_t i = 0; i < slices; ++i) append(data, bytes_of(std::string_view("\0\0\0\3\x26\1\x80", 7)));
        const byte_string file =
            item_file({{{1, "hvc1", {{0, data.size()}}}}, {box("hvcC", record), size_box(side, side)}, {{1, {1, 2}}}}, data);
        return raised([&] {
            detail::decoding_budget budget({}, {}, file.size());
            detail::heif_items(file, budget, "file").take_primary(budget);
        });
    };
    CHECK_FALSE(code_of(18, 2048));
    CHECK(code_of(100, 2048) == error_code::too_large);  // 1.3 gigasamples
    CHECK_FALSE(code_of(4000, 64));
    CHECK(code_of(4097, 64) == error_code::too_large);
}

TEST_CASE(
    "HEIC pictures that are derived from each other in more than 8 levels are refused, whatever the order of their numbers") {
    byte_string record(23);
    const auto code_of = [&](std::uint32_t levels, bool refers_to_lower) {
        file_items items{{}, {box("hvcC", record), size_box(64, 64)}, {}, {}};
        for (std::uint32_t i = 0; i <= levels; ++i) {
            const std::uint32_t id = refers_to_lower ? levels + 1 - i : i + 1, next = refers_to_lower ? id - 1 : id + 1;
            const bool is_last = i == levels;
            items.items.push_back({id, is_last ? "hvc1" : "iden", {{0, 10}}});
            items.uses.push_back({id, is_last ? std::vector<std::uint32_t>{1, 2} : std::vector<std::uint32_t>{2}});
            if (!is_last) items.references.push_back({"dimg", id, {next}});
        }
        const byte_string file = item_file(items, byte_string(10));
        return raised([&] {
            detail::decoding_budget budget({}, {}, file.size());
            detail::heif_items(file, budget, "file").take_primary(budget);
        });
    };
    for (const bool refers_to_lower : {false, true}) {
        CHECK_FALSE(code_of(3, refers_to_lower));
        CHECK(code_of(12, refers_to_lower) == error_code::invalid_data);
        CHECK(code_of(4000, refers_to_lower) == error_code::invalid_data);
    }
}

TEST_CASE("HEIC items with many properties, two configurations or too many coded units are refused") {
    const auto code_of = [](const file_items& items, const byte_string& data) {
        const byte_string file = item_file(items, data);
        return raised([&] {
            detail::decoding_budget budget({}, {}, file.size());
            detail::heif_items(file, budget, "file").take_primary(budget);
        });
    };
    byte_string record(23);  // a decoder configuration without coded units; lengths of units have one byte
    const byte_string configuration = box("hvcC", record), data(10), size = size_box(64, 64);
    const auto one_item = [&](const std::vector<std::uint32_t>& uses, std::size_t bytes) {
        return file_items{{{1, "hvc1", {{0, bytes}}}}, {configuration, size}, {{1, uses}}};
    };
    std::vector<std::uint32_t> uses(64, 2);
    uses[0] = 1;
    CHECK_FALSE(code_of(one_item(uses, 10), data));
    uses.push_back(2);
    CHECK(code_of(one_item(uses, 10), data) == error_code::too_large);
    file_items split = one_item(std::vector<std::uint32_t>(40, 2), 10);
    split.uses.push_back(split.uses[0]);
    CHECK(code_of(split, data) == error_code::too_large);
    CHECK(code_of(one_item({1, 2, 1}, 10), data) == error_code::invalid_data);

    // An overlay that contains one item with 900 kB of data several times.
    record[21] = std::byte{3};  // lengths of units have four bytes
    for (const std::size_t uses_of_item : {20U, 60U}) {
        byte_string coded(900'000);
        const byte_string places = overlay_data(64, 64);
        file_items overlay{{{1, "iovl", {{coded.size(), places.size()}}}, {2, "hvc1", {{0, coded.size()}}}},
                           {box("hvcC", record), size},
                           {{1, {2}}, {2, {1, 2}}},
                           {{"dimg", 1, std::vector<std::uint32_t>(uses_of_item, 2)}}};
        append(coded, places);
        CHECK(code_of(overlay, coded) == (uses_of_item == 20 ? std::nullopt : std::optional(error_code::too_large)));
    }
    record[21] = std::byte{0};

    // A grid of items that share one extent or one configuration, both with many units.
    record[22] = std::byte{1};
    append(record, bytes_of(std::string_view("\0\xFF\xFF", 3)));
    record.resize(record.size() + 2 * 0xFFFF);
    const byte_string canvas = grid_data(4, 1, 64, 256);
    for (const bool in_configuration : {false, true})
        for (const std::uint32_t tiles : {2U, 4U}) {
            byte_string shared(in_configuration ? 10 : 100'000);
            file_items grid{{{1, "grid", {{shared.size(), canvas.size()}}}},
                            {in_configuration ? box("hvcC", record) : configuration, size},
                            {{1, {2}}}};
            grid.references.push_back({"dimg", 1, {}});
            for (std::uint32_t i = 2; i < tiles + 2; ++i) {
                grid.items.push_back({i, "hvc1", {{0, shared.size()}}});
                grid.uses.push_back({i, {1, 2}});
                grid.references[0].to.push_back(i);
            }
            append(shared, canvas);
            CHECK(code_of(grid, shared) == (tiles == 2 ? std::nullopt : std::optional(error_code::too_large)));
        }
}

#if defined(LDI_WITH_LIBHEIF)

TEST_CASE("decoding and estimating refuse recursive, nested, oversized and empty HEIC items without large allocations") {
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1}) {
        const std::optional<byte_string> made = heif_file_of(smooth_picture(64, 64, 3), {format, {}, {}, 0});
        if (!made) {
            WARN("skipped: libheif has no encoder of format " << format);
            continue;
        }
        const coded_picture coded = coded_picture_of(*made);
        const byte_string sound = item_file(
            {{{1, coded.type, {{0, coded.data.size()}}}}, {coded.configuration, size_box(64, 64)}, {{1, {1, 2}}}}, coded.data);
        CHECK(largest_difference(decode_photo(sound).color, decode_photo(*made).color) == 0);
        for (const auto& [name, file] : hostile_item_files(coded)) {
            INFO(name);
            const auto decode = [&file = file] { decode_photo_with_depth(file); };
            const std::optional<double> bytes = peak_memory(decode);
            REQUIRE(bytes);  // no value if a signal ended the process
            CHECK(*bytes < 20 * megabyte);
            const std::optional<error_code> code = raised(decode);
            CHECK((code == error_code::invalid_data || code == error_code::too_large || code == error_code::unsupported));
            CHECK(raised([&file = file] { estimate_photo_with_depth(file); }) == code);
        }
    }
}

TEST_CASE("the pixel limit applies to the coded size of a HEIC picture, even if its file states a smaller size") {
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1}) {
        const std::optional<byte_string> made = heif_file_of(image<std::uint8_t>(600, 800, 3, 99), {format, {}, {}, 0});
        if (!made) continue;
        const coded_picture coded = coded_picture_of(*made);
        const byte_string file = item_file(
            {{{1, coded.type, {{0, coded.data.size()}}}}, {coded.configuration, size_box(64, 64)}, {{1, {1, 2}}}}, coded.data);
        CHECK(raised([&] { decode_photo(file, {.limits = {.max_pixels = 600 * 800 - 1}}); }) == error_code::too_large);
        CHECK(estimate_photo(file).width >= 800);
    }
}

TEST_CASE("HEIC items that refer to the same bytes count once per reference toward the memory limit") {
    const std::optional<byte_string> made = heif_file_of(smooth_picture(64, 64, 3), {heif_compression_HEVC, {}, {}, 0});
    if (!made) {
        WARN("skipped: libheif has no encoder of HEVC");
        return;
    }
    const coded_picture coded = coded_picture_of(*made);
    const std::size_t n = coded.data.size(), more = 1'000'000;
    byte_string data = coded.data;
    append(data, bytes_of(std::string_view("\0\0\0\6Exif\0\0MM\0*\0\0\0\x08\0\0", 20)));
    data.resize(n + more);
    for (const std::size_t items : {std::size_t{400}, std::size_t{20}}) {
        file_items all{{{1, coded.type, {{0, n}}}}, {coded.configuration, size_box(64, 64)}, {{1, {1, 2}}}, {}};
        for (std::uint32_t i = 0; i < items; ++i) {
            const std::size_t pieces = 400 / items;
            all.items.push_back({10 + i, "Exif", std::vector<std::pair<std::size_t, std::size_t>>(pieces, {n, more})});
            all.references.push_back({"cdsc", 10 + i, {1}});
        }
        const byte_string file = item_file(all, data);
        CHECK(raised([&] { decode_photo(file); }) == error_code::too_large);
        CHECK(memory_per_byte(file) < 20);
    }
}

#endif

#if defined(LDI_WITH_LIBTIFF)

TEST_CASE("TIFF entries that share bytes count once per reference toward the memory limit, and tiles count at their full size") {
    using entry = std::array<std::uint32_t, 4>;
    const auto tiff = [](const std::vector<entry>& entries, std::size_t size) {
        byte_string file = bytes_of(std::string_view("MM\0*\0\0\0\x08", 8));
        append(file, big_endian(static_cast<std::uint32_t>(entries.size()), 2));
        for (const entry& e : entries) {
            append(file, big_endian(e[0], 2)), append(file, big_endian(e[1], 2));
            append(file, big_endian(e[2], 4));
            append(file, e[1] == 3 ? big_endian(e[3] << 16, 4) : big_endian(e[3], 4));
        }
        file.resize(size);
        return file;
    };
    std::vector<entry> entries = {{256, 4, 1, 64},  {257, 4, 1, 64}, {258, 3, 1, 8},  {259, 3, 1, 1},   {262, 3, 1, 1},
                                  {273, 4, 1, 400}, {277, 3, 1, 1},  {278, 4, 1, 64}, {279, 4, 1, 4096}};
    const byte_string sound = tiff(entries, 1'000'000);
    CHECK(decode_photo(sound).color.width() == 64);
    for (std::uint32_t i = 0; i < 1000; ++i) entries.push_back({40'000 + i, 7, 900'000, 8});
    const byte_string file = tiff(entries, 1'000'000);
    CHECK(raised([&] { decode_photo(file); }) == error_code::too_large);
    CHECK(memory_per_byte(file) < 20);

    const byte_string tile = tiff({{256, 4, 1, 64},
                                   {257, 4, 1, 64},
                                   {258, 3, 1, 1},
                                   {259, 3, 1, 32773},
                                   {262, 3, 1, 1},
                                   {277, 3, 1, 1},
                                   {322, 4, 1, 16384},
                                   {323, 4, 1, 16384},
                                   {324, 4, 1, 400},
                                   {325, 4, 1, 90'000}},
                                  100'000);
    CHECK(raised([&] { decode_photo(tile); }) == error_code::too_large);
    CHECK(*peak_memory([&] { decode_photo(tile); }) < 20 * megabyte);

    // 64 tiles, each with only its first row inside the picture
    const byte_string high_tiles = tiff({{256, 4, 1, 1024},
                                         {257, 4, 1, 1},
                                         {258, 3, 1, 8},
                                         {259, 3, 1, 32773},
                                         {262, 3, 1, 1},
                                         {277, 3, 1, 1},
                                         {322, 4, 1, 16},
                                         {323, 4, 1, 2'000'000},
                                         {324, 4, 64, 1000},
                                         {325, 4, 64, 2000}},
                                        100'000);
    CHECK_THROWS_WITH(decode_photo(high_tiles), Catch::Contains("64 tiles of 16 x 2000000"));

    // Strips of one row that all contain the same bytes
    byte_string strips = tiff({{256, 4, 1, 16},
                               {257, 4, 1, 1000},
                               {258, 3, 1, 8},
                               {259, 3, 1, 32773},
                               {262, 3, 1, 1},
                               {273, 4, 1000, 1000},
                               {277, 3, 1, 1},
                               {278, 4, 1, 1},
                               {279, 4, 1000, 5000}},
                              100'000);
    for (std::size_t i = 0; i < 1000; ++i) {
        const byte_string place = big_endian(9000, 4), bytes = big_endian(90'000, 4);
        std::copy(place.begin(), place.end(), strips.begin() + static_cast<std::ptrdiff_t>(1000 + 4 * i));
        std::copy(bytes.begin(), bytes.end(), strips.begin() + static_cast<std::ptrdiff_t>(5000 + 4 * i));
    }
    CHECK_THROWS_WITH(decode_photo(strips), Catch::Contains("strips or tiles of at most twice the file's size"));

    // libtiff's decoder of fax codes has two tables with an entry of 4 bytes for each pixel of a row, and allocates twice their
    // size
    const auto row_of = [&](std::uint32_t compression) {
        return tiff({{256, 4, 1, 20'000'000},
                     {257, 4, 1, 1},
                     {258, 3, 1, 1},
                     {259, 3, 1, compression},
                     {262, 3, 1, 1},
                     {273, 4, 1, 400},
                     {277, 3, 1, 1},
                     {278, 4, 1, 1},
                     {279, 4, 1, 90'000}},
                    100'000);
    };
    const photo_options limited = {.limits = {.max_memory = 300'000'000}};
    for (const int compression : {COMPRESSION_CCITTRLE, COMPRESSION_CCITTFAX3, COMPRESSION_CCITTFAX4})
        CHECK(raised([&] { decode_photo(row_of(static_cast<std::uint32_t>(compression)), limited); }) == error_code::too_large);
    CHECK(raised([&] { decode_photo(row_of(COMPRESSION_PACKBITS), limited); }) != error_code::too_large);
}

#endif

TEST_CASE("EXIF entries that refer to the same bytes need less than 20 bytes of memory per byte of the file") {
    byte_string exif = bytes_of(std::string_view("MM\0*\0\0\0\x08", 8));
    append(exif, big_endian(50'000, 2));
    for (int i = 0; i < 50'000; ++i) {
        append(exif, big_endian(0x010E, 2)), append(exif, big_endian(2, 2));
        append(exif, big_endian(900'000, 4)), append(exif, big_endian(100, 4));
    }
    exif.resize(std::size_t{1} << 20, std::byte{'a'});
    CHECK(memory_per_byte(png_file(8, 8, 8, 0, byte_string(64), png_chunk("eXIf", exif))) < 20);
}

TEST_CASE("a GIF file whose codes expand to fewer or more pixels than its picture is refused") {
    // 64 x 64 pixels. The codes are a clear code and one pixel, then longer and longer repetitions of this pixel.
    const auto gif = [](unsigned codes) {
        byte_string file = bytes_of(std::string_view("GIF89a\x40\0\x40\0\0\0\0,\0\0\0\0\x40\0\x40\0\0\x08", 24));
        byte_string bits;
        unsigned waiting = 0, waiting_bits = 0, size = 9, next = 258;
        const auto put = [&](unsigned code) {
            for (waiting |= code << waiting_bits, waiting_bits += size; waiting_bits >= 8; waiting >>= 8, waiting_bits -= 8)
                bits.push_back(static_cast<std::byte>(waiting & 255));
        };
        put(256), put(0);
        for (unsigned i = 0; i < codes; ++i) {
            put(next < 4096 ? next : 4095);
            if (next < 4096 && ++next == 1U << size && size < 12) ++size;
        }
        put(257), put(0);
        for (std::size_t at = 0; at < bits.size(); at += 255) {
            const std::size_t count = std::min(bits.size() - at, std::size_t{255});
            file.push_back(static_cast<std::byte>(count));
            file.insert(file.end(), bits.begin() + static_cast<std::ptrdiff_t>(at),
                        bits.begin() + static_cast<std::ptrdiff_t>(at + count));
        }
        append(file, bytes_of(std::string_view("\0;", 2)));
        return file;
    };
    CHECK_THAT(message_of([&] { decode_photo(gif(88)); }), Catch::Contains("cut off"));  // 1 + 2 + ... + 89 = 4005 of 4096 pixels
    CHECK_THAT(message_of([&] { decode_photo(gif(100)); }), Catch::Contains("more data than its picture has"));
    CHECK_THAT(message_of([&] { decode_photo(gif(100'000)); }), Catch::Contains("more data than its picture has"));
}

/// A gray PNG file of width x 1 pixels whose data begins with empty blocks, 4 in 5 bytes. IDAT chunks have at most 100,000 bytes.
byte_string png_with_empty_blocks(std::size_t blocks, std::uint16_t width) {
    byte_string data = bytes_of("\x78\x01");
    for (std::size_t i = 0; i < blocks; i += 4) append(data, bytes_of(std::string_view("\x02\x08\x20\x80\0", 5)));
    const std::uint16_t stored = static_cast<std::uint16_t>(width + 1);  // a filter byte, and the pixels
    append(data, {std::byte{1}});                                        // the last block, stored
    append(data, little_endian(stored, 2)), append(data, little_endian(static_cast<std::uint16_t>(~stored), 2));
    byte_string row(stored, std::byte{7});
    row[0] = std::byte{0};
    const unsigned long sum = ::adler32(1, reinterpret_cast<const unsigned char*>(row.data()), stored);
    append(data, row), append(data, big_endian(static_cast<std::uint32_t>(sum), 4));

    byte_string header = big_endian(width, 4);
    append(header, big_endian(1, 4)), append(header, bytes_of(std::string_view("\x08\0\0\0\0", 5)));
    byte_string file = bytes_of("\x89PNG\r\n\x1A\n");
    append(file, png_chunk("IHDR", header));
    for (std::size_t begin = 0; begin < data.size(); begin += 100'000) {
        const auto first = data.begin() + static_cast<std::ptrdiff_t>(begin);
        append(file,
               png_chunk("IDAT",
                         {first, first + static_cast<std::ptrdiff_t>((std::min)(data.size() - begin, std::size_t{100'000}))}));
    }
    append(file, png_chunk("IEND", {}));
    return file;
}

TEST_CASE("a PNG file with more than a million blocks of compressed data is too large") {
    CHECK(decode_photo(png_with_empty_blocks(1000, 5)).color(0, 4, 0) == 7);
    CHECK(message_of([] { decode_photo(png_with_empty_blocks(1'000'004, 5)); }) ==
          "photo: expected a PNG file with at most 1000000 blocks of compressed data, found more blocks (too large)");
}

TEST_CASE("a color profile with too many blocks of compressed data is ignored") {
    for (const std::size_t blocks : {1000U, 60'000U}) {
        byte_string chunk = bytes_of(std::string_view("a\0\0\x78\1", 5));
        for (std::size_t i = 0; i < blocks; i += 4) append(chunk, bytes_of(std::string_view("\x02\x08\x20\x80\0", 5)));
        append(chunk, bytes_of(std::string_view("\1\1\0\xFE\xFF*", 6)));  // the last block, stored
        CHECK(detail::png_profile(chunk).size() == (blocks == 1000 ? 1 : 0));
    }
}

TEST_CASE("a PNG file with damaged data is damaged even if it is too long to be decoded without counting its blocks") {
    const std::size_t height = 1000, width = 1500;
    byte_string noise(height * width);
    std::mt19937 engine(1);
    for (std::byte& value : noise) value = static_cast<std::byte>(engine());
    byte_string file = png_file(width, height, 8, 0, noise);
    CHECK(decode_photo(file).color(height - 1, width - 1, 2) == static_cast<std::uint8_t>(noise.back()));
    file[43] ^= std::byte{0x06};  // the kind of the first block
    CHECK_THAT(message_of([&] { decode_photo(with_right_checksums(file)); }), Catch::Contains("data that cannot be inflated"));
}

#if defined(LDI_WITH_LCMS2)

/// A profile whose color table has 87 x 87 x `points` entries. All its curves are the same tables, which are inside the color
/// table.
std::vector<std::byte> profile_with_table(std::uint8_t points) {
    const std::size_t entries = 32'767, table = std::size_t{87} * 87 * points * 3;
    byte_string tag = bytes_of(std::string_view("mAB \0\0\0\0\3\3\0\0", 12));
    const std::uint32_t matrix = 32, colors = matrix + 48, curves = colors + 20;
    for (const std::uint32_t offset : {curves, matrix, curves, colors, curves}) append(tag, big_endian(offset, 4));
    for (int i = 0; i < 12; ++i) append(tag, big_endian(i < 9 && i % 4 == 0 ? 1 << 16 : 0, 4));
    append(tag, {std::byte{87}, std::byte{87}, static_cast<std::byte>(points)});
    tag.resize(colors + 16);
    append(tag, bytes_of(std::string_view("\1\0\0\0", 4)));
    for (int c = 0; c < 3; ++c) {
        append(tag, bytes_of(std::string_view("curv\0\0\0\0", 8))), append(tag, big_endian(entries, 4));
        for (std::size_t i = 0; i < entries; ++i) append(tag, big_endian(static_cast<std::uint32_t>(2 * i), 2));
        tag.resize((tag.size() + 3) / 4 * 4);
    }
    tag.resize((std::max)(tag.size(), curves + table), std::byte{99});
    byte_string profile = big_endian(static_cast<std::uint32_t>(144 + tag.size()), 4);
    profile.resize(8);
    append(profile, bytes_of(std::string_view("\4\x20\0\0scnrRGB Lab ", 16)));
    profile.resize(36);
    append(profile, bytes_of("acsp"));
    profile.resize(128);
    append(profile, big_endian(1, 4)), append(profile, bytes_of("A2B0"));
    append(profile, big_endian(144, 4)), append(profile, big_endian(static_cast<std::uint32_t>(tag.size()), 4));
    append(profile, tag);
    return {profile.begin(), profile.end()};
}

TEST_CASE("colors stay as they are if their profile needs more memory than the limit") {
    bool was_converted = false, was_exceeded = false;
    for (unsigned points = 84; points <= 91; ++points) {
        image<std::uint8_t> color = smooth_picture(8, 8, 3);
        const image<std::uint8_t> before = color;
        detail::convert_to_srgb(color, {profile_with_table(static_cast<std::uint8_t>(points)), 0});
        const bool is_same = std::equal(color.begin(), color.end(), before.begin());
        was_converted = was_converted || !is_same;
        was_exceeded = was_exceeded || detail::is_profile_memory_exceeded;
        CHECK((is_same || !detail::is_profile_memory_exceeded));
    }
    CHECK(was_converted);
    CHECK(was_exceeded);
}

#endif

#if defined(LDI_WITH_LIBWEBP)

/// A lossless WebP file of 1024 x 1024 black pixels, with `groups` groups of prefix codes, 1 to 65,536. Four by four pixels share
/// a group. Each group needs 20 bits of the file; its pixels need none.
byte_string webp_with_groups(std::uint32_t groups, std::uint32_t cache_bits = 0) {
    byte_string stream;
    unsigned used = 0;
    const auto put = [&](std::uint32_t value, unsigned count) {
        for (unsigned i = 0; i < count; ++i, ++used) {
            if (used % 8 == 0) stream.push_back(std::byte{0});
            stream.back() |= static_cast<std::byte>(((value >> i) & 1U) << (used % 8));
        }
    };
    const auto put_code = [&](std::uint32_t code) {  // 8 bits, the most significant one first
        for (unsigned i = 8; i-- > 0;) put(code >> i, 1);
    };
    const auto one_symbol = [&] { put(1, 4); };  // a code with the single symbol 0
    put(0x2F, 8), put(1023, 14), put(1023, 14), put(0, 4);
    put(0, 1);  // no transform
    put(cache_bits > 0 ? 1 : 0, 1), put(cache_bits, cache_bits > 0 ? 4 : 0);
    put(1, 1), put(0, 3);                        // groups for blocks of 4 x 4 pixels
    put(0, 1);                                   // their picture has no cache
    for (const bool is_green : {true, false}) {  // 256 symbols of 8 bits: only the length 8 occurs
        put(0, 1), put(8, 4);
        for (int i = 0; i < 12; ++i) put(i == 11 ? 1 : 0, 3);  // the twelfth length in the file's order is 8
        put(is_green ? 1 : 0, 1);
        if (is_green) put(3, 3), put(254, 8);  // only 256 of the 280 symbols have a length
    }
    for (int i = 0; i < 3; ++i) one_symbol();
    for (std::uint32_t block = 0; block < 65'536; ++block) put_code(block % groups % 256), put_code(block % groups / 256);
    for (std::uint32_t group = 0; group < groups; ++group)
        for (int i = 0; i < 5; ++i) one_symbol();
    byte_string file = bytes_of("RIFF");
    append(file, little_endian(static_cast<std::uint32_t>(12 + stream.size() + stream.size() % 2), 4));
    append(file, bytes_of("WEBPVP8L")), append(file, little_endian(static_cast<std::uint32_t>(stream.size()), 4));
    append(file, stream);
    if (stream.size() % 2 != 0) file.push_back(std::byte{0});
    return file;
}

TEST_CASE("the memory estimate of a lossless WebP file includes libwebp's tables, which 295 kB can make as large as 800 MB") {
    const photo black = decode_photo(webp_with_groups(300));
    CHECK(black.color.height() == 1024);
    CHECK(std::all_of(black.color.begin(), black.color.end(), [](std::uint8_t v) { return v == 0; }));
    const auto tables = [](std::uint32_t groups, std::uint32_t cache_bits) {
        const byte_string file = webp_with_groups(groups, cache_bits), few = webp_with_groups(1, cache_bits);
        const double all = static_cast<double>(estimate_photo(file).memory),
                     least = static_cast<double>(estimate_photo(few).memory);
        return (all - least) / (groups - 1);
    };
    for (const std::uint32_t groups : {2U, 257U, 10'000U}) {
        CHECK(tables(groups, 0) > 12'000);
        CHECK(tables(groups, 11) > 20'000);
    }
    CHECK(raised([] { decode_photo(webp_with_groups(65'536)); }) == error_code::too_large);
    if (!measures_resident_memory) return;
    const byte_string file = webp_with_groups(20'000);
    const std::optional<double> used = peak_memory([&] { decode_photo(file); });
    REQUIRE(used);
    CHECK(*used <= static_cast<double>(estimate_photo(file).memory));
    CHECK(*used > 50 * megabyte);
}

TEST_CASE("a WebP file with several lossless pictures is refused") {
    byte_string file = webp_with_groups(1);
    const byte_string chunk(file.begin() + 12, file.end());
    append(file, chunk);
    CHECK(raised([&] { decode_photo(file); }) == error_code::invalid_data);
}

#endif

TEST_CASE("the memory estimate bounds the measured peak of decoding, and is at most about twice as large") {
    constexpr std::size_t height = 1400, width = 2000;
    const image<std::uint8_t> color = smooth_picture(height, width, 3);
    const image<std::uint8_t> transparent(height / 2, width / 2, 4, 99), plain(height / 2, width / 2, 3, 99);
    const byte_string rows(reinterpret_cast<const std::byte*>(color.data()),
                           reinterpret_cast<const std::byte*>(color.data()) + color.size());
    std::vector<std::pair<std::string, byte_string>> files = {
        {"JPEG", encode_jpeg(color, 85)},
        {"PNG", encode_png(color)},
        {"gray PNG", encode_png(smooth_picture(height, width, 1))},
        {"deep PNG", png_file(width, height, 16, 6, byte_string(8 * width * height, std::byte{7}))},
        {"palette PNG", png_file(width, height, 8, 3, byte_string(width * height), png_chunk("PLTE", bytes_of("abc")))},
    };
    const byte_string depth = encode_png(smooth_picture(height, width, 1));
#if defined(LDI_WITH_PUGIXML)
    files.emplace_back("depth inside",
                       dynamic_depth_jpeg(encode_jpeg(color, 85), {{"Depth", "", depth}, {"Confidence", "", depth}},
                                          "DepthMap:Near=\"0.5\" DepthMap:Far=\"4\""));
    files.emplace_back("depth as text",
                       gdepth_jpeg(small_jpeg, encode_png(smooth_picture(24, 32, 1)), "GDepth:Near=\"1\" GDepth:Far=\"9\""));
#endif
#if defined(LDI_WITH_LIBHEIF)
    for (const heif_compression_format format : {heif_compression_HEVC, heif_compression_AV1})
        if (const std::optional<byte_string> file = heif_file_of(transparent, {format, {}, {}, 0})) {
            files.emplace_back("HEIF " + std::to_string(format), *heif_file_of(plain, {format, {}, {}, 0}));
            files.emplace_back("HEIF with alpha " + std::to_string(format), *file);
            files.emplace_back("HEIF with depth " + std::to_string(format), alpha_called_depth(*file));
        }
#endif
#if defined(LDI_WITH_LIBWEBP)
    files.emplace_back("WebP", webp_file(color));
    files.emplace_back("transparent WebP", webp_file(transparent));
#endif
#if defined(LDI_WITH_LIBTIFF)
    files.emplace_back("TIFF", tiff_file(color));
    files.emplace_back("deep TIFF", tiff_file(color, {.compression = COMPRESSION_ADOBE_DEFLATE, .bits = 16}));
#endif
    for (const auto& [name, file] : files) {
        INFO(name);
        const double estimate = static_cast<double>(estimate_photo_with_depth(file).memory - detail::max_profile_memory);
        const std::optional<double> measured = peak_memory([&file = file] {
            photo_with_depth found = decode_photo_with_depth(file);
            if (found.depth) fill_invalid(std::move(found.depth->disparity));
        });
        REQUIRE(measured);
        INFO(*measured / megabyte << " MB measured, " << estimate / megabyte << " estimated");
        if (!measures_resident_memory) continue;
        CHECK(*measured < estimate + 5 * megabyte);  // tables of libraries, and memory that malloc() keeps
        CHECK(estimate < 2 * *measured + 5 * megabyte);
    }
    const std::optional<double> measured = peak_memory([&] { fill_invalid(decode_depth_map(depth)); });
    CHECK(*measured < static_cast<double>(estimate_depth_map(depth).memory) + 2 * megabyte);
    CHECK(estimate_depth_map(depth).height == height);
}

TEST_CASE("a disabled picture format is refused for photos, depth maps and depth inside photos") {
    const std::pair<picture_format, byte_string> files[] = {{picture_format::jpeg, small_jpeg},
                                                            {picture_format::png, encode_png(small)}};
    for (const auto& [format, file] : files) {
        CHECK(decode_photo(file, {.formats = {format}}).color.width() == 32);
        const photo_options others = {.formats = {picture_format::gif, picture_format::tiff}};
        CHECK(raised([&file = file, &others] { decode_photo(file, others); }) == error_code::unsupported);
        CHECK_THAT(message_of([&file = file, &others] { decode_photo(file, others); }),
                   Catch::Contains("an enabled format: gif, tiff") && Catch::Contains(std::string(to_string(format))));
        CHECK(raised([&file = file] { decode_depth_map(file, {.formats = {picture_format::npy}}); }) == error_code::unsupported);
    }
#if defined(LDI_WITH_LIBWEBP)
    const byte_string webp = webp_file(small);
    CHECK(raised([&] { decode_photo(webp, {.formats = {picture_format::jpeg}}); }) == error_code::unsupported);
    CHECK(raised([&] { estimate_photo(webp, {.formats = {picture_format::jpeg}}); }) == error_code::unsupported);
#endif
#if defined(LDI_WITH_LIBTIFF)
    const byte_string tiff = tiff_file(small);
    CHECK(raised([&] { decode_photo(tiff, {.formats = {picture_format::jpeg}}); }) == error_code::unsupported);
#endif
#if defined(LDI_WITH_LIBHEIF)
    if (const std::optional<byte_string> heif = heif_file_of(small, {heif_compression_HEVC, {}, {}, 0}))
        CHECK_THAT(message_of([&] { decode_photo(*heif, {.formats = {picture_format::jpeg}}); }),
                   Catch::Contains("an enabled format: jpeg"));
#endif
    const byte_string pfm = bytes_of("Pf\n1 1\n-1.0\n????");
    CHECK(raised([&] { decode_depth_map(pfm, {.formats = {picture_format::npy}}); }) == error_code::unsupported);
#if defined(LDI_WITH_PUGIXML)
    const byte_string gdepth =
        gdepth_jpeg(small_jpeg, encode_png(smooth_picture(24, 32, 1)), "GDepth:Near=\"1\" GDepth:Far=\"9\"");
    CHECK(decode_photo_with_depth(gdepth).depth);
    CHECK_THAT(decode_photo_with_depth(gdepth, {.formats = {picture_format::jpeg}}).refused,
               Catch::Contains("an enabled format: jpeg"));
#endif
    CHECK(picture_formats::parse("jpeg,png")->text() == "jpeg, png");
    CHECK_FALSE(picture_formats::parse("jpeg, png"));
    CHECK_FALSE(picture_formats::parse(""));
    CHECK(picture_formats().contains(picture_format::npy));
}
