// Builds HEIC files box by box for tests and fuzzers, with items that libheif's encoder would never write.
#pragma once

#include <tests/io/encoded_files.hpp>
#include <tests/io/phone_files.hpp>
#include <tests/support/files.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::testing {

inline byte_string box(std::string_view type, const byte_string& body) {
    byte_string result = big_endian(static_cast<std::uint32_t>(body.size() + 8), 4);
    append(result, bytes_of(type));
    append(result, body);
    return result;
}

inline byte_string full_box(std::string_view type, std::uint32_t version, const byte_string& body) {
    byte_string result = big_endian(version << 24, 4);
    append(result, body);
    return box(type, result);
}

inline byte_string size_box(std::uint32_t width, std::uint32_t height) {
    byte_string body = big_endian(width, 4);
    append(body, big_endian(height, 4));
    return full_box("ispe", 0, body);
}

/// messages  SEI messages about the auxiliary picture
inline byte_string auxiliary_box(std::string_view type, std::string_view messages = {}) {
    byte_string body = bytes_of(type);
    body.push_back(std::byte{0});
    append(body, bytes_of(messages));
    return full_box("auxC", 0, body);
}

/// States RGB samples of full range.
///
/// primaries, transfer  codes of H.273; the defaults are those of sRGB
inline byte_string color_box(char primaries = 1, char transfer = 13) {
    const char codes[] = {0, primaries, 0, transfer, 0, 0, '\x80'};
    byte_string body = bytes_of("nclx");
    append(body, bytes_of(std::string_view(codes, sizeof codes)));
    return box("colr", body);
}

/// Returns the data of an item of type "grid".
inline byte_string grid_data(std::uint32_t rows, std::uint32_t columns, std::uint32_t width, std::uint32_t height) {
    byte_string data = {std::byte{0}, std::byte{1}, static_cast<std::byte>(rows - 1), static_cast<std::byte>(columns - 1)};
    append(data, big_endian(width, 4)), append(data, big_endian(height, 4));
    return data;
}
/// Returns the data of an item of type "iovl" that overlays one picture.
inline byte_string overlay_data(std::uint32_t width, std::uint32_t height) {
    byte_string data(10);
    data[1] = std::byte{1};
    append(data, big_endian(width, 4)), append(data, big_endian(height, 4));
    data.resize(data.size() + 8);  // 8 bytes for the offset of the one overlaid picture
    return data;
}

struct file_items {
    struct item {
        std::uint32_t id;
        std::string type;
        std::vector<std::pair<std::size_t, std::size_t>> extents;  ///< first byte in the data, and length
        bool is_inside = false;                                    ///< the data are those in `inside`
    };
    struct reference {
        std::string type;
        std::uint32_t from;
        std::vector<std::uint32_t> to;
        byte_string rest = {};  ///< superfluous bytes at the end of the box
    };
    std::vector<item> items;
    std::vector<byte_string> properties;
    std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>> uses = {};  ///< per item: numbers of its properties, from 1
    std::vector<reference> references = {};
    std::size_t index_size = 0;  ///< bytes of an extent's index in 'iloc'
    byte_string inside = {};     ///< data in the 'idat' box
};

/// Builds a file whose primary item has the id 1.
inline byte_string item_file(const file_items& of, const byte_string& data) {
    const auto number = [](std::size_t value, int size) { return big_endian(static_cast<std::uint32_t>(value), size); };
    const auto meta = [&](std::size_t base) {
        byte_string locations = bytes_of("\x44"), list = number(of.items.size(), 2), all_properties, uses, references = {};
        locations.push_back(static_cast<std::byte>(of.index_size));
        append(locations, number(of.items.size(), 2));
        for (const file_items::item& item : of.items) {
            append(locations, number(item.id, 2)), append(locations, number(item.is_inside ? 1 : 0, 2));
            append(locations, number(0, 2));
            append(locations, number(item.extents.size(), 2));
            for (const auto& [at, size] : item.extents) {
                append(locations, byte_string(of.index_size));
                append(locations, number(item.is_inside ? at : base + at, 4)), append(locations, number(size, 4));
            }
            byte_string entry = number(item.id, 2);
            append(entry, number(0, 2)), append(entry, bytes_of(item.type)), append(entry, number(0, 1));
            if (item.type == "mime") append(entry, bytes_of(std::string_view("application/rdf+xml\0", 20)));
            append(list, full_box("infe", 2, entry));
        }
        for (const byte_string& property : of.properties) append(all_properties, property);
        append(uses, number(of.uses.size(), 4));
        for (const auto& [id, numbers] : of.uses) {
            append(uses, number(id, 2)), append(uses, number(numbers.size(), 1));
            for (const std::uint32_t n : numbers) append(uses, number(n, 1));
        }
        for (const file_items::reference& r : of.references) {
            byte_string body = number(r.from, 2);
            append(body, number(r.to.size(), 2));
            for (const std::uint32_t id : r.to) append(body, number(id, 2));
            append(body, r.rest);
            append(references, box(r.type, body));
        }
        byte_string handler(4);
        append(handler, bytes_of("pict")), handler.resize(21);
        byte_string body = full_box("hdlr", 0, handler);
        append(body, full_box("pitm", 0, number(1, 2)));
        append(body, full_box("iloc", 1, locations));
        append(body, full_box("iinf", 0, list));
        byte_string properties = box("ipco", all_properties);
        append(properties, full_box("ipma", 0, uses));
        append(body, box("iprp", properties));
        if (!of.references.empty()) append(body, full_box("iref", 0, references));
        if (!of.inside.empty()) append(body, box("idat", of.inside));
        return full_box("meta", 0, body);
    };
    byte_string file = box("ftyp", bytes_of(std::string_view("heic\0\0\0\0mif1heic", 16)));
    append(file, meta(file.size() + meta(0).size() + 8));
    append(file, box("mdat", data));
    return file;
}

#if defined(LDI_WITH_LIBHEIF)

/// A coded picture and its decoder's configuration (hvcC, av1C), for use in other files.
struct coded_picture {
    std::string type;
    byte_string configuration, data;
};

/// Extracts the only picture of a file from libheif's encoder.
inline coded_picture coded_picture_of(const byte_string& file) {
    const auto find = [&](std::string_view type) {
        const byte_string name = bytes_of(type);
        const auto at = std::search(file.begin(), file.end(), name.begin(), name.end());
        if (at == file.end()) return byte_string();
        const std::size_t begin = static_cast<std::size_t>(at - file.begin()) - 4;
        std::size_t size = 0;
        for (std::size_t i = 0; i < 4; ++i) size = size << 8 | std::to_integer<std::size_t>(file[begin + i]);
        return byte_string(file.begin() + static_cast<std::ptrdiff_t>(begin),
                           file.begin() + static_cast<std::ptrdiff_t>(begin + size));
    };
    coded_picture result{"hvc1", find("hvcC"), find("mdat")};
    if (result.configuration.empty()) result.type = "av01", result.configuration = find("av1C");
    result.data.erase(result.data.begin(), result.data.begin() + 8);
    return result;
}

/// Returns a HEIC file like those of an iPhone, turned by 270 degrees counterclockwise: a grid of tiles with a crop at its right
/// and lower borders, a thumbnail, EXIF, a gain map, and disparity from 1 (black) to 3 (white) with its metadata.
///
/// tiles  rows x columns tiles of equal size, all with the same configuration
inline byte_string phone_heic(const std::vector<coded_picture>& tiles, std::uint32_t columns, std::uint32_t tile_side,
                              std::uint32_t width, std::uint32_t height, const coded_picture& disparity,
                              std::uint32_t disparity_width, std::uint32_t disparity_height, const byte_string& exif) {
    byte_string data;
    const auto stored = [&](const byte_string& bytes) {
        const std::size_t at = data.size();
        append(data, bytes);
        return std::vector{std::pair{at, bytes.size()}};
    };
    file_items file{
        .items = {},
        .properties = {tiles.front().configuration, size_box(tile_side, tile_side), size_box(width, height),
                       box("irot", bytes_of("\3")), color_box(), disparity.configuration,
                       size_box(disparity_width, disparity_height), auxiliary_box("urn:mpeg:hevc:2015:auxid:2"),
                       auxiliary_box("urn:com:apple:photo:2020:aux:hdrgainmap"), full_box("pixi", 0, bytes_of("\3\10\10\10"))}};
    constexpr std::uint32_t essential = 0x80;
    const std::uint32_t count = static_cast<std::uint32_t>(tiles.size());
    const std::uint32_t thumbnail = count + 2, gain = count + 3, depth = count + 4, photo_exif = count + 5, depth_xmp = count + 6,
                        toned = count + 7;
    file.inside = grid_data(count / columns, columns, width, height);
    file.items.push_back({1, "grid", {{0, file.inside.size()}}, true});
    file.uses.push_back({1, {3, essential | 4, 5, 10}});
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < count; ++i) {
        all.push_back(i + 2);
        file.items.push_back({i + 2, "hvc1", stored(tiles[i].data)});
        file.uses.push_back({i + 2, {essential | 1, 2, 5, 10}});
    }
    file.items.push_back({thumbnail, "hvc1", stored(tiles.front().data)});
    file.uses.push_back({thumbnail, {essential | 1, 2, essential | 4, 5, 10}});
    file.items.push_back({gain, "hvc1", stored(disparity.data)});
    file.uses.push_back({gain, {essential | 6, 7, essential | 4, 9}});
    file.items.push_back({depth, "hvc1", stored(disparity.data)});
    file.uses.push_back({depth, {essential | 6, 7, essential | 4, 8}});
    byte_string block = big_endian(0, 4);
    append(block, exif);
    file.items.push_back({photo_exif, "Exif", stored(block)});
    file.items.push_back({depth_xmp, "mime", stored(bytes_of(apple_packet("disparity", "1", "3")))});
    const byte_string curve(62);
    file.items.push_back({toned, "tmap", {{file.inside.size(), curve.size()}}, true});
    append(file.inside, curve);
    file.uses.push_back({toned, {3, 5}});
    file.references = {{"dimg", 1, all},          {"thmb", thumbnail, {1}},     {"auxl", gain, {1}},       {"auxl", depth, {1}},
                       {"cdsc", photo_exif, {1}}, {"cdsc", depth_xmp, {depth}}, {"dimg", toned, {1, gain}}};
    return item_file(file, data);
}

/// Returns HEIC files, each with a name: their pictures lack data, contain themselves, or contain too many or too large pictures.
inline std::vector<std::pair<std::string, byte_string>> hostile_item_files(const coded_picture& coded) {
    const std::size_t n = coded.data.size();
    const std::vector<byte_string> properties = {coded.configuration, size_box(64, 64)};
    const auto with = [&](const byte_string& more) {
        byte_string data = coded.data;
        append(data, more);
        return data;
    };
    std::vector<std::pair<std::string, byte_string>> files;
    const auto file_with = [&](const std::vector<std::pair<std::size_t, std::size_t>>& extents) {
        return item_file({{{1, coded.type, extents}}, properties, {{1, {1, 2}}}}, coded.data);
    };
    files.emplace_back("data_beyond_the_file", file_with({{n + 1000, 8}}));
    files.emplace_back("data_without_length", file_with({{0, 0}}));
    files.emplace_back("part_without_length", file_with({{0, n}, {n, 0}}));
    for (const std::string type : {"grid", "iovl", "iden"}) {
        const byte_string own = type == "grid" ? grid_data(1, 1, 64, 64) : type == "iovl" ? overlay_data(64, 64) : byte_string();
        const std::pair<std::size_t, std::size_t> place{n, own.size()};
        files.emplace_back(type + "_self",
                           item_file({{{1, type, {place}}}, properties, {{1, {2}}}, {{"dimg", 1, {1}}}}, with(own)));
        files.emplace_back(type + "_cycle", item_file({{{1, type, {place}}, {2, type, {place}}, {3, type, {place}}},
                                                       properties,
                                                       {{1, {2}}, {2, {2}}, {3, {2}}},
                                                       {{"dimg", 1, {2}}, {"dimg", 2, {3}}, {"dimg", 3, {1}}}},
                                                      with(own)));
        file_items levels{{}, properties, {}, {}};
        for (std::uint32_t i = 1; i <= 24; ++i) {
            levels.items.push_back({i, type, {place}});
            levels.uses.push_back({i, {2}});
            levels.references.push_back({"dimg", i, {i < 24 ? i + 1 : 100, i < 24 ? i + 1 : 100}});
        }
        levels.items.push_back({100, coded.type, {{0, n}}});
        levels.uses.push_back({100, {1, 2}});
        files.emplace_back(type + "_levels", item_file(levels, with(own)));
    }
    for (const std::string type : {"grid", "iovl"}) {
        const byte_string own = type == "grid" ? grid_data(1, 1, 30000, 30000) : overlay_data(30000, 30000);
        files.emplace_back(type + "_large", item_file({{{1, type, {{n, own.size()}}}, {2, coded.type, {{0, n}}}},
                                                       properties,
                                                       {{1, {2}}, {2, {1, 2}}},
                                                       {{"dimg", 1, {2}}}},
                                                      with(own)));
    }
    const byte_string tiles = grid_data(80, 80, 5120, 5120);
    files.emplace_back("grid_tiles", item_file({{{1, "grid", {{n, tiles.size()}}}, {2, coded.type, {{0, n}}}},
                                                {coded.configuration, size_box(64, 64), size_box(5120, 5120)},
                                                {{1, {3}}, {2, {1, 2}}},
                                                {{"dimg", 1, std::vector<std::uint32_t>(6400, 2)}}},
                                               with(tiles)));
    const byte_string turn = box("irot", bytes_of("\1"));
    files.emplace_back("turns", item_file({{{1, coded.type, {{0, n}}}},
                                           {coded.configuration, size_box(8192, 8192), turn},
                                           {{1, std::vector<std::uint32_t>(255, 3)}}},
                                          coded.data));
    // libheif 1.15 also reads the references that these two files hide, and recurses endlessly. One file hides them in unused
    // bytes at the end of a reference's box, whose size libheif ignores, the other in a 'uuid' box, whose header is 16 bytes
    // longer.
    byte_string back_reference =
        box("dimg", {std::byte{0}, std::byte{2}, std::byte{0}, std::byte{1}, std::byte{0}, std::byte{1}});
    byte_string of_uuid(16);
    append(of_uuid, big_endian(9 << 16, 4)), append(of_uuid, back_reference);
    std::vector<std::uint32_t> numbers;
    for (std::size_t i = 4; i < of_uuid.size(); i += 2)
        numbers.push_back(std::to_integer<std::uint32_t>(of_uuid[i]) << 8 | std::to_integer<std::uint32_t>(of_uuid[i + 1]));
    const auto references = [&](const std::string& name, std::vector<file_items::reference> list) {
        files.emplace_back(name, item_file({{{1, "iden", {{0, n}}}, {2, "iden", {{0, n}}}, {3, coded.type, {{0, n}}}},
                                            properties,
                                            {{1, {2}}, {2, {2}}, {3, {1, 2}}},
                                            std::move(list)},
                                           coded.data));
    };
    references("unused_bytes_of_reference", {{"dimg", 1, {2}, back_reference}});
    references("reference_uuid", {{"dimg", 1, {2}}, {"uuid", 0, numbers}});
    files.emplace_back("extent_index", item_file({{{1, coded.type, {{0, n}}}}, properties, {{1, {1, 2}}}, {}, 4}, coded.data));
    files.emplace_back("no_data", item_file({{{1, coded.type, {{0, 0}}}}, properties, {{1, {1, 2}}}}, {}));
    const byte_string alpha = auxiliary_box("urn:mpeg:hevc:2015:auxid:1");
    files.emplace_back("alpha_cycle", item_file({{{1, coded.type, {{0, n}}}, {2, coded.type, {{0, n}}}},
                                                 {coded.configuration, size_box(64, 64), alpha},
                                                 {{1, {1, 2, 3}}, {2, {1, 2, 3}}},
                                                 {{"auxl", 1, {2}}, {"auxl", 2, {1}}}},
                                                coded.data));
    return files;
}

#endif

}  // namespace ldi::testing
