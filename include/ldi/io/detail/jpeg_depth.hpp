// Reads depth from JPEG files, in the three formats that phones write:
//
//     GDepth          https://developers.google.com/depthmap-metadata: base64 in the XMP
//     Dynamic Depth   version 1.0: files appended to the photo, listed in the XMP (namespaces photos/dd/1.0 and photos/1.0)
//     Apple           a picture of the Multi-Picture Format (CIPA DC-007) whose own XMP identifies it as disparity or depth
//
// This code identifies depth by its XMP, not by its position, because files also contain other appended pictures (gain maps,
// second views) and videos.
#pragma once

#include <ldi/base/printable.hpp>
#include <ldi/io/detail/stored_depth.hpp>
#include <ldi/io/detail/tiff_directory.hpp>
#include <ldi/io/detail/xmp.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct found_depth {
    image<float> disparity;  ///< in the stored orientation
    bool is_metric = false;
    std::string source;
    bool is_inverse_depth = true;        ///< if false, only the order of distances is known
    bool is_white_near_a_guess = false;  ///< whether the file does not state whether white is near
};

/// Depth that was found in a file, but not decoded yet.
struct located_depth {
    std::span<const std::byte> depth, confidence;  ///< complete picture files; `confidence` may be empty
    depth_meaning meaning;
    std::string source, where;
    std::vector<std::byte> depth_in_text, confidence_in_text;  ///< decoded files that GDepth stores as base64 text
};

/// Reads range and unit from the properties of GDepth or Dynamic Depth. Raises unsupported, invalid_data.
///
/// space  XMP namespace of the properties
inline depth_meaning google_meaning(const xmp_properties& xmp, std::string_view space, const std::string& where) {
    depth_meaning meaning;
    const std::string_view format = xmp.text(space, "Format").value_or("RangeInverse");
    if (format != "RangeInverse" && format != "RangeLinear")
        raise(error_code::unsupported, where, "RangeInverse or RangeLinear", printable(format));
    meaning.coding = format == "RangeLinear" ? depth_coding::range_linear : depth_coding::range_inverse;
    const std::optional<double> first = xmp.number(space, "Near"), last = xmp.number(space, "Far");
    if (!first || !last) raise(error_code::invalid_data, where, "finite numbers in Near and Far", "a missing or invalid number");
    meaning.first = *first, meaning.last = *last;
    const std::string_view unit = xmp.text(space, "Units").value_or("");
    if (unit == "m" || unit == "Meters" || unit == "meters") meaning.unit = 1;
    if (unit == "mm" || unit == "Millimeters") meaning.unit = 0.001;
    return meaning;
}

inline const char* range_name(const depth_meaning& meaning) {
    return meaning.coding == depth_coding::range_linear ? "RangeLinear" : "RangeInverse";
}

inline std::optional<located_depth> locate_gdepth(const xmp_properties& xmp, decoding_budget& budget, const std::string& where) {
    constexpr std::string_view space = "http://ns.google.com/photos/1.0/depthmap";
    const std::optional<std::string_view> data = xmp.text(space, "Data"), confidence = xmp.text(space, "Confidence");
    if (!data) return std::nullopt;
    const std::string here = where + ", GDepth";
    const depth_meaning meaning = google_meaning(xmp, space, here);
    const std::size_t written = data->size() + confidence.value_or("").size();
    budget.charge(nearest_double(written), here, "base64 text of " + std::to_string(written) + " bytes");
    located_depth found{{},
                        {},
                        meaning,
                        std::string("GDepth, ") + range_name(meaning),
                        here,
                        decode_base64(*data),
                        decode_base64(confidence.value_or(""))};
    found.depth = found.depth_in_text, found.confidence = found.confidence_in_text;
    return found;
}

/// A file appended to the photo, as listed in a directory.
struct appended_item {
    std::string_view semantic, address;
    std::size_t length = 0, padding = 0;
};

/// Lists the items of a Dynamic Depth directory. The first item is the photo itself.
inline std::vector<appended_item> list_items(const xmp_properties& xmp, std::string_view space) {
    constexpr std::size_t max_items = 64;  // real files have two to five
    std::vector<appended_item> items;
    for (const xmp_property& p : xmp.all()) {
        if (p.space != space || p.name != "Mime" || items.size() == max_items) continue;
        const auto count = [&](std::string_view name) {
            return static_cast<std::size_t>(std::clamp(xmp.number(space, name, p.owner).value_or(0), 0.0, 1e15));
        };
        const std::optional<std::string_view> data_uri = xmp.text(space, "DataURI", p.owner),
                                              uri = xmp.text(space, "URI", p.owner);
        items.push_back({xmp.text(space, "Semantic", p.owner).value_or(""), data_uri ? *data_uri : uri.value_or(""),
                         count("Length"), count("Padding")});
    }
    return items;
}

/// Returns the bytes of an item, a JPEG or PNG file; empty if there is none. Items follow the photo in order, so the lengths of
/// the preceding items determine the position. If no picture starts there, because the file contains other data, the lengths of
/// the following items determine the position from the end of the file.
inline std::span<const std::byte> item_bytes(std::span<const std::byte> bytes, std::size_t photo_end,
                                             const std::vector<appended_item>& items, std::size_t index) {
    const auto piece = [&](std::size_t at) -> std::span<const std::byte> {
        if (at > bytes.size() || items[index].length > bytes.size() - at) return {};
        const std::span<const std::byte> item = bytes.subspan(at, items[index].length);
        return is_jpeg(item) || is_png(item) ? item : std::span<const std::byte>();
    };
    std::size_t before = photo_end + items[0].padding, after = 0;
    for (std::size_t i = 1; i < items.size(); ++i) {
        std::size_t& sum = i < index ? before : after;
        sum = (std::min)(sum + items[i].length + items[i].padding, bytes.size() + 1);
    }
    const std::span<const std::byte> from_photo = piece(before);
    return !from_photo.empty() || after > bytes.size() ? from_photo : piece(bytes.size() - after);
}

inline std::optional<located_depth> locate_dynamic_depth(std::span<const std::byte> bytes, std::size_t photo_end,
                                                         const xmp_properties& xmp, const std::string& where) {
    constexpr std::string_view space = "http://ns.google.com/photos/dd/1.0/depthmap";
    const std::string here = where + ", Dynamic Depth";
    if (!xmp.text(space, "Near")) return std::nullopt;
    for (const std::string_view items_space :
         {"http://ns.google.com/photos/dd/1.0/item", "http://ns.google.com/photos/1.0/container/item"}) {
        const std::vector<appended_item> items = list_items(xmp, items_space);
        const auto find = [&](std::string_view semantic, std::string_view address) -> std::span<const std::byte> {
            for (std::size_t i = 1; i < items.size(); ++i)
                if ((!address.empty() && items[i].address == address) || items[i].semantic == semantic)
                    return item_bytes(bytes, photo_end, items, i);
            return {};
        };
        const std::span<const std::byte> depth = find("Depth", xmp.text(space, "DepthURI").value_or("")),
                                         confidence = find("Confidence", xmp.text(space, "ConfidenceURI").value_or(""));
        if (depth.empty()) continue;
        const depth_meaning meaning = google_meaning(xmp, space, here);
        return located_depth{depth, confidence, meaning, std::string("Dynamic Depth, ") + range_name(meaning), here, {}, {}};
    }
    raise(error_code::invalid_data, here, "the depth map that the XMP describes", "no such file after the photo");
}

/// Reads range and unit from Apple's properties; empty if the picture is not depth.
inline std::optional<depth_meaning> apple_meaning(const xmp_properties& xmp) {
    constexpr std::string_view space = "http://ns.apple.com/pixeldatainfo/1.0";
    const std::string_view kind = xmp.text(space, "AuxiliaryImageType").value_or("");
    const std::optional<double> first = xmp.number(space, "FloatMinValue"), last = xmp.number(space, "FloatMaxValue");
    if ((kind != "disparity" && kind != "depth") || !first || !last) return std::nullopt;
    depth_meaning meaning{kind == "depth" ? depth_coding::range_linear : depth_coding::disparity, *first, *last, 0};
    if (xmp.text("http://ns.apple.com/depthData/1.0", "Accuracy") == "absolute") meaning.unit = 1;
    return meaning;
}

/// Lists the appended pictures of a Multi-Picture Format segment.
inline std::vector<std::span<const std::byte>> list_pictures(std::span<const std::byte> bytes,
                                                             std::span<const std::byte> segment) {
    constexpr std::size_t list_tag = 0xB002, entry_bytes = 16, max_pictures = 16;  // real photos have one to three pictures
    const std::span<const std::byte> tiff = segment.subspan(4);
    const std::size_t origin = static_cast<std::size_t>(tiff.data() - bytes.data());
    const tiff_directory directory(tiff);
    std::vector<std::span<const std::byte>> pictures;
    bool is_listed = false;
    directory.for_each([&](const tiff_directory::entry& list) {
        if (list.tag != list_tag || is_listed) return;
        is_listed = true;
        for (std::size_t i = 0; i < max_pictures && nearest_double(entry_bytes * (i + 1)) <= list.bytes; ++i) {
            const std::size_t entry = list.place + entry_bytes * i;
            const std::size_t length = static_cast<std::size_t>(directory.number(entry + 4, 4)),
                              at = origin + static_cast<std::size_t>(directory.number(entry + 8, 4));
            if (at >= bytes.size() || length > bytes.size() - at) continue;
            const std::span<const std::byte> picture = bytes.subspan(at, length);
            if (picture.data() != bytes.data() && is_jpeg(picture)) pictures.push_back(picture);
        }
    });
    return pictures;
}

/// Returns the header of an appended picture; nothing if it is damaged or of an unusual kind.
inline std::optional<picture_header> find_jpeg_header(std::span<const std::byte> picture, const std::string& where) {
    try {
        return read_jpeg_header(picture, where);
    } catch (const error& failed) {
        if (failed.code() != error_code::invalid_data && failed.code() != error_code::unsupported) throw;
        return std::nullopt;
    }
}

inline std::optional<located_depth> locate_apple_depth(std::span<const std::byte> bytes, const picture_header& photo,
                                                       decoding_budget& budget, const std::string& where) {
    const auto segment = std::find_if(photo.extensions.begin(), photo.extensions.end(),
                                      [](std::span<const std::byte> s) { return has_text(s, 0, std::string_view("MPF\0", 4)); });
    if (segment == photo.extensions.end()) return std::nullopt;
    std::size_t count = 0;
    for (const std::span<const std::byte> picture : list_pictures(bytes, *segment)) {
        const std::string here = where + ", picture " + std::to_string(++count);
        // Charges each listed picture, because the search for its end reads the whole picture. A hostile file may list the same
        // picture many times.
        budget.charge(nearest_double(picture.size()), here, "pictures of " + std::to_string(picture.size()) + " bytes");
        const std::optional<picture_header> header = find_jpeg_header(picture, here);
        if (!header) continue;  // a damaged preview
        xmp_properties xmp;
        add_jpeg_xmp(xmp, header->extensions, picture.size(), budget, here);
        if (const std::optional<depth_meaning> meaning = apple_meaning(xmp))
            return located_depth{
                picture, {}, *meaning, meaning->coding == depth_coding::disparity ? "Apple disparity" : "Apple depth",
                here,    {}, {}};
    }
    return std::nullopt;
}

/// Locates depth in a JPEG file. Raises unsupported, invalid_data, too_large.
///
/// header  header of the photo
inline std::optional<located_depth> locate_jpeg_depth(std::span<const std::byte> bytes, const picture_header& header,
                                                      decoding_budget& budget, const std::string& where) {
    xmp_properties xmp;
    add_jpeg_xmp(xmp, header.extensions, bytes.size(), budget, where);
    std::optional<located_depth> found = locate_dynamic_depth(bytes, header.end, xmp, where);
    if (!found) found = locate_gdepth(xmp, budget, where);
    if (!found) found = locate_apple_depth(bytes, header, budget, where);
    return found;
}

/// Decodes located depth without rotating it. Raises unsupported, invalid_data, too_large.
inline found_depth decode_located(const located_depth& located, decoding_budget& budget) {
    image<float> values = decode_gray_unit(located.depth, budget, located.where);
    if (!located.confidence.empty())
        drop_unsure(values, decode_gray_unit(located.confidence, budget, located.where + ", confidence"));
    return {to_disparity(std::move(values), located.meaning, located.where), located.meaning.unit > 0, located.source};
}

}}}  // namespace ldi::detail
