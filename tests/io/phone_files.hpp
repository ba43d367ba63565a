// Builds JPEG files with depth inside, as phones write them, byte by byte for tests and fuzzers.
#pragma once

#include <ldi/io/picture.hpp>
#include <tests/support/files.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace ldi::testing {

/// A segment of a JPEG file. Its marker is, for example, 0xE1 for APP1.
inline byte_string jpeg_segment(unsigned marker, const byte_string& body) {
    byte_string segment = {std::byte{0xFF}, static_cast<std::byte>(marker)};
    append(segment, big_endian(static_cast<std::uint32_t>(body.size() + 2), 2));
    append(segment, body);
    return segment;
}

/// Inserts segments after a JPEG file's first two bytes.
inline byte_string with_segments(const byte_string& jpeg, const byte_string& segments) {
    byte_string file(jpeg.begin(), jpeg.begin() + 2);
    append(file, segments);
    file.insert(file.end(), jpeg.begin() + 2, jpeg.end());
    return file;
}

/// An XMP packet with one description.
inline std::string xmp_packet(const std::string& attributes, const std::string& children = "") {
    return "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">"
           "<rdf:Description rdf:about=\"\" " +
           attributes + ">" + children + "</rdf:Description></rdf:RDF></x:xmpmeta>";
}

inline byte_string xmp_segment(const std::string& packet) {
    return jpeg_segment(0xE1, bytes_of(std::string("http://ns.adobe.com/xap/1.0/") + '\0' + packet));
}

/// Extended XMP: a packet in parts of `part_size` bytes.
inline byte_string extended_xmp_segments(const std::string& packet, const std::string& identifier, std::size_t part_size) {
    byte_string segments;
    for (std::size_t at = 0; at < packet.size(); at += part_size) {
        byte_string body = bytes_of(std::string("http://ns.adobe.com/xmp/extension/") + '\0' + identifier);
        append(body, big_endian(static_cast<std::uint32_t>(packet.size()), 4));
        append(body, big_endian(static_cast<std::uint32_t>(at), 4));
        append(body, bytes_of(std::string_view(packet).substr(at, part_size)));
        append(segments, jpeg_segment(0xE1, body));
    }
    return segments;
}

inline std::string base64(const byte_string& bytes) {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k) text += i + k < bytes.size() + 1 ? digits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

constexpr const char* gdepth_space = "xmlns:GDepth=\"http://ns.google.com/photos/1.0/depthmap/\" ";

/// A photo with depth in GDepth's format.
///
/// fields  attributes of GDepth, such as GDepth:Near="1"
inline byte_string gdepth_jpeg(const byte_string& photo, const byte_string& depth, const std::string& fields) {
    return with_segments(photo, xmp_segment(xmp_packet(gdepth_space + fields + " GDepth:Data=\"" + base64(depth) + "\"")));
}

/// A file appended to a photo, as listed in a directory.
struct appended_file {
    std::string semantic, address;
    byte_string bytes;
};

/// Namespaces and attribute names of a container format.
struct container_words {
    const char *container, *item, *address;
};
constexpr container_words dynamic_depth_words = {"http://ns.google.com/photos/dd/1.0/container/",
                                                 "http://ns.google.com/photos/dd/1.0/item/", "DataURI"};
constexpr container_words photos_words = {"http://ns.google.com/photos/1.0/container/",
                                          "http://ns.google.com/photos/1.0/container/item/", "URI"};

/// A photo with appended files, which Dynamic Depth or Google Photos' container lists.
///
/// fields  attributes of DepthMap, such as DepthMap:Near="0.5"
inline byte_string dynamic_depth_jpeg(const byte_string& photo, const std::vector<appended_file>& files,
                                      const std::string& fields, const container_words& words = dynamic_depth_words) {
    std::string list = "<rdf:li><Container:Item Item:Mime=\"image/jpeg\" Item:Semantic=\"Primary\" Item:Length=\"0\"/></rdf:li>";
    for (const appended_file& f : files)
        list += "<rdf:li><Container:Item Item:Mime=\"image/jpeg\" Item:Semantic=\"" + f.semantic + "\" Item:" + words.address +
                "=\"" + f.address + "\" Item:Length=\"" + std::to_string(f.bytes.size()) + "\"/></rdf:li>";
    const std::string spaces = std::string("xmlns:Container=\"") + words.container + "\" xmlns:Item=\"" + words.item +
                               "\" xmlns:Device=\"http://ns.google.com/photos/dd/1.0/device/\" "
                               "xmlns:Camera=\"http://ns.google.com/photos/dd/1.0/camera/\" "
                               "xmlns:DepthMap=\"http://ns.google.com/photos/dd/1.0/depthmap/\"";
    const std::string children = "<Device:Cameras><rdf:Seq><rdf:li rdf:parseType=\"Resource\"><Camera:DepthMap " + fields +
                                 "/></rdf:li></rdf:Seq></Device:Cameras><Container:Directory><rdf:Seq>" + list +
                                 "</rdf:Seq></Container:Directory>";
    byte_string file = with_segments(photo, xmp_segment(xmp_packet(spaces, children)));
    for (const appended_file& f : files) append(file, f.bytes);
    return file;
}

/// Apple's metadata for a picture of disparity or depth.
inline std::string apple_packet(const std::string& kind, const std::string& first, const std::string& last,
                                const std::string& accuracy = "relative") {
    return xmp_packet(
        "xmlns:apdi=\"http://ns.apple.com/pixeldatainfo/1.0/\" xmlns:depthData=\"http://ns.apple.com/depthData/1.0/\"",
        "<depthData:Accuracy>" + accuracy +
            "</depthData:Accuracy><apdi:IntMinValue>0</apdi:IntMinValue>"
            "<apdi:IntMaxValue>255</apdi:IntMaxValue><apdi:FloatMinValue>" +
            first +
            "</apdi:FloatMinValue>"
            "<apdi:FloatMaxValue>" +
            last + "</apdi:FloatMaxValue><apdi:AuxiliaryImageType>" + kind + "</apdi:AuxiliaryImageType>");
}

/// A file of the Multi-Picture Format: a photo and appended pictures.
inline byte_string multi_picture_jpeg(const byte_string& photo, const std::vector<byte_string>& others) {
    const std::size_t count = others.size() + 1, segment_size = 2 + 2 + 4 + 8 + 2 + 2 * 12 + 4 + 16 * count;
    byte_string tiff = bytes_of(std::string_view("MM\0*\0\0\0\x08", 8));
    append(tiff, big_endian(2, 2));
    const auto entry = [&](std::uint32_t tag, std::uint32_t type, std::size_t components, std::size_t value) {
        append(tiff, big_endian(tag, 2)), append(tiff, big_endian(type, 2));
        append(tiff, big_endian(static_cast<std::uint32_t>(components), 4)),
            append(tiff, big_endian(static_cast<std::uint32_t>(value), 4));
    };
    entry(0xB001, 4, 1, count);
    entry(0xB002, 7, 16 * count, 8 + 2 + 2 * 12 + 4);
    append(tiff, big_endian(0, 4));
    std::size_t place = photo.size() + segment_size;
    const std::size_t origin = 2 + 2 + 2 + 4;  // origin of the offsets in the file
    const auto picture = [&](std::uint32_t kind, std::size_t size, std::size_t offset) {
        append(tiff, big_endian(kind, 4)), append(tiff, big_endian(static_cast<std::uint32_t>(size), 4));
        append(tiff, big_endian(static_cast<std::uint32_t>(offset), 4)), append(tiff, big_endian(0, 4));
    };
    picture(0x030000, place, 0);
    for (const byte_string& other : others) {
        picture(0, other.size(), place - origin);
        place += other.size();
    }
    byte_string body = bytes_of(std::string_view("MPF\0", 4));
    append(body, tiff);
    byte_string file = with_segments(photo, jpeg_segment(0xE2, body));
    for (const byte_string& other : others) append(file, other);
    return file;
}

}  // namespace ldi::testing
