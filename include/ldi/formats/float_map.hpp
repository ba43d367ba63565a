// Reads files of plain floats from memory: PFM (Debevec; one float per pixel, bottom row first) and NPY (NumPy's format,
// versions 1 to 3, float32 and float64).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {
namespace detail {

inline bool is_pfm(std::span<const std::byte> bytes) { return has_text(bytes, 0, "Pf"); }
inline bool is_npy(std::span<const std::byte> bytes) { return has_text(bytes, 0, "\x93NUMPY"); }

/// Reads a float of 4 or 8 bytes as float32.
template <class Stored>
float stored_float(const std::byte* from, bool swap_bytes) {
    std::byte bytes[sizeof(Stored)];
    std::copy(from, from + sizeof(Stored), bytes);
    if (swap_bytes) std::reverse(bytes, bytes + sizeof(Stored));
    Stored value;
    std::memcpy(&value, bytes, sizeof(Stored));
    return static_cast<float>(value);
}

/// Parses a text that is one whole number of at most 2^31 - 1. Returns an empty result for any other text.
inline std::optional<std::size_t> whole_number(std::string_view text) {
    std::uint32_t value = 0;
    const std::from_chars_result read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (read.ec != std::errc() || read.ptr != text.data() + text.size() || value > 0x7FFFFFFF) return std::nullopt;
    return value;
}

/// Header of a PFM or NPY file.
struct float_map_header : picture_header {
    std::size_t begin = 0, item = sizeof(float);  ///< offset of the values and size of a value, in bytes
    bool is_swapped = false, columns_first = false;
};

/// Raises invalid_data unless the file contains all values.
inline void check_float_map(const float_map_header& header, std::span<const std::byte> bytes, const std::string& where) {
    const std::size_t left = bytes.size() - header.begin;
    if (header.width > left / header.item / header.height)
        damaged(header.format, where,
                std::to_string(left) + " bytes for " + std::to_string(header.width) + " x " + std::to_string(header.height) +
                    " floats");
}

/// Reads the header of a PFM file. Raises invalid_data.
inline float_map_header read_pfm_header(std::span<const std::byte> bytes, const std::string& where) {
    const auto broken = [&](const std::string& found) { damaged(picture_format::pfm, where, found); };
    // The header consists of "Pf", width, height and scale, separated by white space. Exactly one white space character follows
    // the scale.
    std::string_view fields[3];
    std::size_t at = 2;
    for (std::string_view& field : fields) {
        const auto is_space = [&](std::size_t i) {
            return has_text(bytes, i, " ") || has_text(bytes, i, "\n") || has_text(bytes, i, "\r");
        };
        while (at < bytes.size() && is_space(at)) ++at;
        const std::size_t first = at;
        while (at < bytes.size() && !is_space(at) && at - first < 32) ++at;
        if (at >= bytes.size() || !is_space(at)) broken("a header that is cut off or too long");
        field = std::string_view(reinterpret_cast<const char*>(bytes.data()) + first, at - first);
    }
    const std::optional<std::size_t> width = whole_number(fields[0]), height = whole_number(fields[1]);
    if (!width || !height || *width == 0 || *height == 0) broken("no size in the header");
    // The sign of the scale states the byte order. Its magnitude is a unit of brightness, which this reader ignores.
    const std::string_view scale = fields[2];
    if (scale.find_first_not_of("+-.0123456789eE") != scale.npos || scale.find_first_of("123456789") == scale.npos)
        broken("a scale of '" + printable(scale) + "'");
    float_map_header header;
    header.format = picture_format::pfm;
    header.width = *width, header.height = *height, header.begin = at + 1;
    // Lines may end in CR and LF. After CR alone, the first byte of the data can have the value of LF.
    const double data_bytes = 4.0 * nearest_double(*width) * nearest_double(*height);
    if (has_text(bytes, at, "\r\n") && nearest_double(bytes.size() - at - 2) >= data_bytes) ++header.begin;
    header.is_swapped = (scale.front() == '-') != (std::endian::native == std::endian::little);
    return header;
}

}  // namespace detail

/// Decodes a PFM file to H x W x 1 without changing the values. `where` names the file in messages. Raises invalid_data.
inline image<float> decode_pfm(std::span<const std::byte> bytes, const std::string& where) {
    const detail::float_map_header header = detail::read_pfm_header(bytes, where);
    detail::check_float_map(header, bytes, where);
    image<float> result(header.height, header.width, 1, unset);
    const std::byte* from = bytes.data() + header.begin;
    for (std::size_t y = header.height; y-- > 0;)
        for (std::size_t x = 0; x < header.width; ++x, from += sizeof(float))
            result.row(y)[x] = detail::stored_float<float>(from, header.is_swapped);
    return result;
}

namespace detail {

/// Returns the text after a key and its colon in an NPY header, which is a Python dictionary. Returns an empty text if the key is
/// missing.
///
/// key  including its quotes
inline std::string_view npy_field(std::string_view dictionary, std::string_view key) {
    const std::size_t found = dictionary.find(key);
    if (found == dictionary.npos) return {};
    const std::size_t value = dictionary.find_first_not_of(" :", found + key.size());
    return value == dictionary.npos ? std::string_view() : dictionary.substr(value);
}

/// Parses a Python tuple such as "(384, 288)". Returns an empty result if the text is not a tuple or has more than 8 numbers.
inline std::optional<buffer<std::size_t>> npy_shape(std::string_view text) {
    if (text.empty() || text.front() != '(') return std::nullopt;
    const std::size_t end = text.find(')');
    if (end == text.npos) return std::nullopt;
    text = text.substr(1, end - 1);
    buffer<std::size_t> shape;
    while (!text.empty()) {
        const std::size_t comma = (std::min)(text.find(','), text.size());
        std::string_view number = text.substr(0, comma);
        text.remove_prefix((std::min)(comma + 1, text.size()));
        number.remove_prefix((std::min)(number.find_first_not_of(' '), number.size()));
        number = number.substr(0, number.find(' '));
        if (number.empty() && text.empty()) break;
        const std::optional<std::size_t> length = whole_number(number);
        if (!length || shape.size() == 8) return std::nullopt;
        shape.push_back(*length);
    }
    return shape;
}

/// Removes axes of length 1 until two axes remain, first from the end, then from the front.
inline void drop_unit_axes(buffer<std::size_t>& shape) {
    while (shape.size() > 2 && shape.back() == 1) shape.pop_back();
    while (shape.size() > 2 && shape.front() == 1) shape.erase(shape.begin());
}

/// Reads the header of an NPY file. Raises invalid_data, unsupported.
inline float_map_header read_npy_header(std::span<const std::byte> bytes, const std::string& where) {
    const auto broken = [&](const std::string& found) { damaged(picture_format::npy, where, found); };
    if (bytes.size() < 12) broken("a header that is cut off");
    const unsigned version = byte_at(bytes, 6);
    if (version < 1 || version > 3) raise(error_code::unsupported, where, "NPY version 1, 2 or 3", std::to_string(version));
    const std::size_t begin = version == 1 ? 10 : 12;
    std::size_t length = byte_at(bytes, 8) | byte_at(bytes, 9) << 8;
    if (version > 1) length |= std::size_t{byte_at(bytes, 10)} << 16 | std::size_t{byte_at(bytes, 11)} << 24;
    if (length > bytes.size() - begin) broken("a header that is cut off");
    const std::string_view dictionary(reinterpret_cast<const char*>(bytes.data()) + begin, length);

    const std::string_view type = npy_field(dictionary, "'descr'").substr(0, 5);
    const bool is_float32 = type == "'<f4'" || type == "'>f4'", is_float64 = type == "'<f8'" || type == "'>f8'";
    if (!is_float32 && !is_float64) raise(error_code::unsupported, where, "float32 or float64 values", "type " + printable(type));
    float_map_header header;
    header.is_swapped = (type[1] == '<') != (std::endian::native == std::endian::little);
    const std::string_view order = npy_field(dictionary, "'fortran_order'");
    header.columns_first = order.substr(0, 4) == "True";
    if (!header.columns_first && order.substr(0, 5) != "False") broken("no fortran_order in the header");
    std::optional<buffer<std::size_t>> shape = npy_shape(npy_field(dictionary, "'shape'"));
    if (!shape) broken("no shape in the header");
    drop_unit_axes(*shape);
    if (shape->size() != 2 || (*shape)[0] == 0 || (*shape)[1] == 0)
        raise(error_code::unsupported, where, "a nonempty map with two axes, height and width",
              std::to_string(shape->size()) + " axes, or an axis of length 0");
    header.format = picture_format::npy;
    header.height = (*shape)[0], header.width = (*shape)[1];
    header.begin = begin + length, header.item = is_float32 ? 4 : 8;
    return header;
}

}  // namespace detail

/// Decodes an NPY file to H x W x 1. Converts float64 to float32, and does not scale the values. `where` names the file in
/// messages. Raises invalid_data, unsupported.
inline image<float> decode_npy(std::span<const std::byte> bytes, const std::string& where) {
    const detail::float_map_header header = detail::read_npy_header(bytes, where);
    detail::check_float_map(header, bytes, where);
    image<float> result(header.height, header.width, 1, unset);
    const std::byte* const values = bytes.data() + header.begin;
    for (std::size_t y = 0; y < header.height; ++y)
        for (std::size_t x = 0; x < header.width; ++x) {
            const std::size_t i = header.columns_first ? x * header.height + y : y * header.width + x;
            const std::byte* const from = values + i * header.item;
            result.row(y)[x] = header.item == 4 ? detail::stored_float<float>(from, header.is_swapped)
                                                : detail::stored_float<double>(from, header.is_swapped);
        }
    return result;
}

}}  // namespace ldi
