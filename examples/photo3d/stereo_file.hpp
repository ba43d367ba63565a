// Files of two pictures, one for each eye: JPS (a side-by-side JPEG with a marker segment) and MPO (two consecutive JPEGs; CIPA
// DC-007, "Multi-Picture Format"). Programs that don't support these formats read such files as plain JPEG.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/render/stereo.hpp>
#include <ldi/version.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Appends bytes, integers in little-endian order.
class little_endian_bytes {
public:
    void put_16(std::uint32_t value) { put(value, 2); }
    void put_32(std::uint32_t value) { put(value, 4); }
    void put_text(std::string_view text) {
        for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    }
    /// Appends an entry of a TIFF directory: a tag, the type of its values, their number, and the value or its offset.
    void put_entry(std::uint32_t tag, std::uint32_t type, std::uint32_t count, std::uint32_t value) {
        put_16(tag), put_16(type), put_32(count), put_32(value);
    }

    std::vector<std::byte> bytes;

private:
    void put(std::uint32_t value, int count) {
        for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::byte>(value >> (8 * i) & 255));
    }
};

/// Inserts a segment into a JPEG file, after the JFIF segment.
///
/// marker  marker of the segment: 0xE1 for APP1
inline std::vector<std::byte> with_segment(std::span<const std::byte> jpeg, unsigned marker, std::span<const std::byte> content) {
    LDI_ASSERT(jpeg.size() > 20 && jpeg[3] == std::byte{0xE0} && content.size() < 65534);
    const std::size_t after = 4 + std::to_integer<std::size_t>(jpeg[4]) * 256 + std::to_integer<std::size_t>(jpeg[5]),
                      length = content.size() + 2;
    std::vector<std::byte> result(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(after));
    for (const std::size_t value : {std::size_t{0xFF}, std::size_t{marker}, length / 256, length % 256})
        result.push_back(static_cast<std::byte>(value));
    result.insert(result.end(), content.begin(), content.end());
    result.insert(result.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(after), jpeg.end());
    return result;
}

/// Encodes a JPS file. By convention, the right eye's picture is on the left, for programs that support JPS and for viewing with
/// crossed eyes. The marker is an APP3 segment with four bytes, lowest first: media (1: stereo), layout (2: side by side), flags
/// (bit 2: left eye's picture first), and separation. Raises the errors of encode_jpeg().
///
/// left, right  H x W x 3, of the same size
/// quality      JPEG quality, 1 to 100
inline std::vector<std::byte> encode_jps(const image<std::uint8_t>& left, const image<std::uint8_t>& right, int quality) {
    little_endian_bytes note;
    note.put_text("_JPSJPS_");
    note.put_text(std::string_view("\0\4", 2));  // length of the following fields, highest byte first
    note.put_text(std::string_view("\0\0\2\1", 4));
    note.put_16(0);  // length of a comment
    return with_segment(encode_jpeg(side_by_side(right, left), quality), 0xE3, note.bytes);
}

/// Returns EXIF data that names this program, because MPO files must contain EXIF pictures.
inline std::vector<std::byte> exif_of_program() {
    const std::string program = "ldi " + std::to_string(LDI_VERSION_MAJOR) + "." + std::to_string(LDI_VERSION_MINOR) + "." +
                                std::to_string(LDI_VERSION_PATCH) + std::string(1, '\0');
    little_endian_bytes exif;
    exif.put_text(std::string_view("Exif\0\0II*\0", 10));
    exif.put_32(8), exif.put_16(2);
    exif.put_entry(0x0112, 3, 1, 1);  // orientation: upright
    exif.put_entry(0x0131, 2, static_cast<std::uint32_t>(program.size()), 8 + 2 + 2 * 12 + 4);
    exif.put_32(0);
    exif.put_text(program);
    return exif.bytes;
}

/// Appends the directory of one picture: its number, counted from the left; the number of the base picture, 1; a convergence
/// angle of 0, for parallel axes; and the eye distance.
///
/// offset  position of the directory
/// meters  eye distance; 0: unknown
inline void put_attributes(little_endian_bytes& to, std::uint32_t offset, std::uint32_t number, float meters) {
    const std::uint32_t numbers = offset + 2 + 4 * 12 + 4;
    to.put_16(4);
    to.put_entry(0xB101, 4, 1, number);
    to.put_entry(0xB204, 4, 1, 1);
    to.put_entry(0xB205, 10, 1, numbers);
    to.put_entry(0xB206, 5, 1, numbers + 8);
    to.put_32(0);
    constexpr std::uint32_t unknown = 0xFFFFFFFF;
    const bool is_known = meters > 0 && meters < 4000;  // so that the number of micrometers has 32 bits
    to.put_32(0), to.put_32(1);
    to.put_32(is_known ? static_cast<std::uint32_t>(1e6F * meters) : unknown), to.put_32(is_known ? 1'000'000 : unknown);
}

/// Encodes an MPO file, the left eye's picture first. Raises the errors of encode_jpeg().
///
/// left, right  H x W x 3
/// quality      JPEG quality, 1 to 100
/// meters       eye distance; 0: unknown
inline std::vector<std::byte> encode_mpo(const image<std::uint8_t>& left, const image<std::uint8_t>& right, int quality,
                                         float meters) {
    const auto encoded = [&](const image<std::uint8_t>& seen) {
        return with_segment(encode_jpeg(seen, quality), 0xE1, exif_of_program());
    };
    const std::vector<std::byte> first = encoded(left);
    little_endian_bytes second_segment;
    second_segment.put_text(std::string_view("MPF\0II*\0", 8));
    second_segment.put_32(8);
    put_attributes(second_segment, 8, 2, meters);
    const std::vector<std::byte> second = with_segment(encoded(right), 0xE2, second_segment.bytes);

    // The index, whose length does not depend on its values.
    constexpr std::uint32_t list = 8 + 2 + 3 * 12 + 4, attributes = list + 2 * 16;
    const auto index = [&](std::size_t first_bytes, std::size_t second_begin) {
        little_endian_bytes segment;
        segment.put_text(std::string_view("MPF\0II*\0", 8));
        segment.put_32(8), segment.put_16(3);
        segment.put_16(0xB000), segment.put_16(7), segment.put_32(4), segment.put_text("0100");
        segment.put_entry(0xB001, 4, 1, 2);
        segment.put_entry(0xB002, 7, 32, list);
        segment.put_32(attributes);
        constexpr std::uint32_t disparity = 0x020002, is_shown_alone = 0x20000000;
        segment.put_32(disparity | is_shown_alone), segment.put_32(static_cast<std::uint32_t>(first_bytes));
        segment.put_32(0), segment.put_32(0);
        segment.put_32(disparity), segment.put_32(static_cast<std::uint32_t>(second.size()));
        segment.put_32(static_cast<std::uint32_t>(second_begin)), segment.put_32(0);
        put_attributes(segment, attributes, 1, meters);
        return with_segment(first, 0xE2, segment.bytes);
    };
    const std::size_t first_bytes = index(0, 0).size();
    // Offsets count from the segment's "II", which follows SOI, JFIF, the marker, the length and "MPF".
    const std::size_t header = 4 + std::to_integer<std::size_t>(first[4]) * 256 + std::to_integer<std::size_t>(first[5]) + 8;
    std::vector<std::byte> file = index(first_bytes, first_bytes - header);
    file.insert(file.end(), second.begin(), second.end());
    return file;
}

}  // namespace ldi::examples
