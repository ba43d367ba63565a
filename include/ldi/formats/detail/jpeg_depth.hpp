// Depth inside JPEG files, in the three ways that phones write it:
//
//   GDepth         https://developers.google.com/depthmap-metadata: base64 in the XMP
//   Dynamic Depth  version 1.0: files appended to the photo, which a directory in the XMP lists; so it is for
//   photos/1.0/container Apple          a picture of the Multi-Picture Format (CIPA DC-007), whose own XMP says that it is
//   disparity or depth
//
// Other pictures that are appended (gain maps, second views, videos) are told apart by what the XMP calls them, never by their
// place.
#pragma once

#include <ldi/formats/detail/stored_depth.hpp>
#include <ldi/formats/detail/xmp.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::inline LDI_CONFIGURATION::detail {

struct found_depth {
    image<float> disparity;  ///< as stored, not turned
    bool is_metric = false;
    std::string source;
    bool is_inverse_depth = true;  ///< else only the order of distances is known
};

/// Range and unit in the words of GDepth and Dynamic Depth. Raises unsupported, invalid_data.
inline depth_meaning google_meaning(const xmp_properties& xmp, std::string_view space, const std::string& where) {
    depth_meaning meaning;
    const std::string_view format = xmp.text(space, "Format").value_or("RangeInverse");
    if (format != "RangeInverse" && format != "RangeLinear")
        raise(error_code::unsupported, where, "RangeInverse or RangeLinear", std::string(format.substr(0, 40)));
    meaning.coding = format == "RangeLinear" ? depth_coding::range_linear : depth_coding::range_inverse;
    const std::optional<double> first = xmp.number(space, "Near"), last = xmp.number(space, "Far");
    if (!first || !last) raise(error_code::invalid_data, where, "a nearest and a farthest distance", "no such numbers");
    meaning.first = *first, meaning.last = *last;
    const std::string_view unit = xmp.text(space, "Units").value_or("");
    if (unit == "m" || unit == "Meters" || unit == "meters") meaning.unit = 1;
    if (unit == "mm" || unit == "Millimeters") meaning.unit = 0.001;
    return meaning;
}

/// depth, confidence  whole files; confidence may be empty
inline found_depth decode_google_depth(std::span<const std::byte> depth, std::span<const std::byte> confidence,
                                       const depth_meaning& meaning, const picture_limits& limits, const std::string& where) {
    image<float> values = decode_gray_unit(depth, limits, where);
    if (!confidence.empty()) drop_unsure(values, decode_gray_unit(confidence, limits, where + ", confidence"));
    return {to_disparity(std::move(values), meaning, where), meaning.unit > 0,
            meaning.coding == depth_coding::range_linear ? "RangeLinear" : "RangeInverse"};
}

inline std::optional<found_depth> find_gdepth(const xmp_properties& xmp, const picture_limits& limits, const std::string& where) {
    constexpr std::string_view space = "http://ns.google.com/photos/1.0/depthmap";
    const std::optional<std::string_view> data = xmp.text(space, "Data"), confidence = xmp.text(space, "Confidence");
    if (!data) return std::nullopt;
    const std::string here = where + ", GDepth";
    found_depth found = decode_google_depth(decode_base64(*data), decode_base64(confidence.value_or("")),
                                            google_meaning(xmp, space, here), limits, here);
    found.source = "GDepth, " + found.source;
    return found;
}

/// A file behind the photo, as a directory lists it.
struct appended_item {
    std::string_view semantic, address;
    std::size_t length = 0, padding = 0;
};

/// What one of the two directories lists, the photo itself first.
inline std::vector<appended_item> list_items(const xmp_properties& xmp, std::string_view space) {
    constexpr std::size_t most = 64;  // real ones have two to five
    std::vector<appended_item> items;
    for (const xmp_property& p : xmp.all()) {
        if (p.space != space || p.name != "Mime" || items.size() == most) continue;
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

/// The bytes of an item: after the photo and the items before it. Where other things lie in between, counted from the end of the
/// file.
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

inline std::optional<found_depth> find_dynamic_depth(std::span<const std::byte> bytes, std::size_t photo_end,
                                                     const xmp_properties& xmp, const picture_limits& limits,
                                                     const std::string& where) {
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
        found_depth found = decode_google_depth(depth, confidence, google_meaning(xmp, space, here), limits, here);
        found.source = "Dynamic Depth, " + found.source;
        return found;
    }
    raise(error_code::invalid_data, here, "the depth map that is announced", "no such file behind the photo");
}

/// Range and unit in Apple's words; nothing if they are not of depth.
inline std::optional<depth_meaning> apple_meaning(const xmp_properties& xmp) {
    constexpr std::string_view space = "http://ns.apple.com/pixeldatainfo/1.0";
    const std::string_view kind = xmp.text(space, "AuxiliaryImageType").value_or("");
    const std::optional<double> first = xmp.number(space, "FloatMinValue"), last = xmp.number(space, "FloatMaxValue");
    if ((kind != "disparity" && kind != "depth") || !first || !last) return std::nullopt;
    depth_meaning meaning{kind == "depth" ? depth_coding::range_linear : depth_coding::disparity, *first, *last, 0};
    if (xmp.text("http://ns.apple.com/depthData/1.0", "Accuracy") == "absolute") meaning.unit = 1;
    return meaning;
}

/// Offset and length of the pictures that a Multi-Picture Format segment lists.
inline std::vector<std::pair<std::size_t, std::size_t>> list_pictures(std::span<const std::byte> bytes,
                                                                      std::span<const std::byte> segment) {
    const std::span<const std::byte> tiff = segment.subspan(4);
    const bool little_endian = has_text(tiff, 0, "II");
    const auto number = [&](std::size_t at, std::size_t size) {
        std::size_t value = 0;
        for (std::size_t i = 0; i < size && at + size <= tiff.size(); ++i)
            value = value << 8 | byte_at(tiff, at + (little_endian ? size - 1 - i : i));
        return value;
    };
    const std::size_t origin = static_cast<std::size_t>(tiff.data() - bytes.data()), directory = number(4, 4);
    std::vector<std::pair<std::size_t, std::size_t>> pictures;
    for (std::size_t i = 0; i < number(directory, 2); ++i) {
        const std::size_t entry = directory + 2 + 12 * i;
        if (number(entry, 2) != 0xB002) continue;  // the list of pictures, 16 bytes each
        const std::size_t length = number(entry + 4, 4), list = number(entry + 8, 4);
        for (std::size_t at = list; at + 16 <= tiff.size() && at + 16 <= list + length; at += 16)
            pictures.emplace_back(origin + number(at + 8, 4), number(at + 4, 4));
    }
    return pictures;
}

inline std::optional<found_depth> find_apple_depth(std::span<const std::byte> bytes, const picture_header& photo,
                                                   const picture_limits& limits, const std::string& where) {
    constexpr std::size_t most = 16;  // a photo has one to three
    for (const std::span<const std::byte> segment : photo.extensions) {
        if (!has_text(segment, 0, std::string_view("MPF\0", 4))) continue;
        std::size_t count = 0;
        for (const auto& [at, length] : list_pictures(bytes, segment)) {
            if (at >= bytes.size() || length > bytes.size() - at || ++count > most) continue;
            const std::span<const std::byte> picture = bytes.subspan(at, length);
            if (picture.data() == bytes.data() || !is_jpeg(picture)) continue;
            const std::string here = where + ", picture " + std::to_string(count);
            xmp_properties xmp;
            add_jpeg_xmp(xmp, read_jpeg_header(picture, here).extensions, picture.size());
            const std::optional<depth_meaning> meaning = apple_meaning(xmp);
            if (!meaning) continue;
            return found_depth{to_disparity(decode_gray_unit(picture, limits, here), *meaning, here), meaning->unit > 0,
                               meaning->coding == depth_coding::disparity ? "Apple disparity" : "Apple depth"};
        }
    }
    return std::nullopt;
}

/// Raises unsupported, invalid_data, too_large.
inline std::optional<found_depth> find_jpeg_depth(std::span<const std::byte> bytes, const picture_limits& limits,
                                                  const std::string& where) {
    const picture_header header = read_jpeg_header(bytes, where);
    xmp_properties xmp;
    add_jpeg_xmp(xmp, header.extensions, bytes.size());
    std::optional<found_depth> found = find_dynamic_depth(bytes, header.end, xmp, limits, where);
    if (!found) found = find_gdepth(xmp, limits, where);
    if (!found) found = find_apple_depth(bytes, header, limits, where);
    return found;
}

}  // namespace ldi::detail
