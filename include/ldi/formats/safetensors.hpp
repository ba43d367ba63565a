// Reads safetensors files (https://huggingface.co/docs/safetensors) from memory: an eight-byte header length, a JSON header with
// the type, shape and byte range of every tensor, then the little-endian values. Files are untrusted. io/weight_files.hpp loads
// them from disk.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/named_tensors.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/formats/detail/json.hpp>
#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Decodes all tensors. Half-precision numbers become float. Allocates nothing before the header is checked against the file's
/// size.
///
/// bytes  the whole file: tensors of types F32, F16, BF16, I32, I8 and U8, whose values follow the header without gaps or
///        overlaps
/// where  name of the file in messages
///
/// Raises invalid_data for a damaged file, too_large for a header above 4 MiB or a shape that does not fit in memory, and
/// unsupported for any other type. A message about a tensor states the tensor's name.
named_tensors decode_safetensors(std::span<const std::byte> bytes, const std::string& where = "safetensors file");

namespace detail {

/// Raises mismatch unless the metadata contains the value `expected` for `key`.
///
/// what  kind of file, for the error message; for example "a depth network"
inline void check_metadata(const named_tensors& file, const std::string& what, const std::string& key,
                           const std::string& expected) {
    const auto found = file.metadata.find(key);
    if (found == file.metadata.end() || found->second != expected)
        raise(error_code::mismatch, file.where, what + " (" + key + " " + expected + " in its metadata)",
              found == file.metadata.end() ? "no such entry" : printable(found->second));
}

}  // namespace detail

namespace detail::safetensors {

inline constexpr std::size_t max_header_bytes = std::size_t{4} << 20;
inline constexpr std::size_t max_dimensions = 8;
inline constexpr int max_nesting = 3;  ///< three levels: the header, a tensor, and its shape

/// Converts IEEE half precision: a sign bit, 5 exponent bits and 10 fraction bits.
inline float half_to_float(std::uint32_t half) {
    const std::uint32_t sign = (half & 0x8000) << 16, exponent = (half >> 10) & 31, fraction = half & 1023;
    if (exponent == 31) return float_of(sign | 0x7F800000 | (fraction << 13));
    if (exponent != 0) return float_of(sign | ((exponent + 112) << 23) | (fraction << 13));
    const float value = nearest_float(fraction) * 0x1p-24F;  // subnormal
    return sign != 0 ? -value : value;
}

template <class Scalar, class Decode>
buffer<Scalar> decoded(std::span<const std::byte> bytes, std::size_t scalar_bytes, Decode&& decode) {
    buffer<Scalar> values(bytes.size() / scalar_bytes);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = decode(bytes.subspan(i * scalar_bytes, scalar_bytes));
    return values;
}

/// Returns the size of one value in bytes; 0 for an unsupported type.
inline std::size_t scalar_size(std::string_view type) {
    if (type == "F32" || type == "I32") return 4;
    if (type == "F16" || type == "BF16") return 2;
    return type == "I8" || type == "U8" ? 1 : 0;
}

inline decltype(tensor::values) decode_values(std::span<const std::byte> bytes, std::string_view type) {
    using scalar = std::span<const std::byte>;
    if (type == "F32") return decoded<float>(bytes, 4, [](scalar b) { return float_of(little_endian_32(b, 0)); });
    if (type == "F16") return decoded<float>(bytes, 2, [](scalar b) { return half_to_float(little_endian_16(b, 0)); });
    if (type == "BF16") return decoded<float>(bytes, 2, [](scalar b) { return float_of(little_endian_16(b, 0) << 16); });
    if (type == "I32")
        return decoded<std::int32_t>(bytes, 4, [](scalar b) { return static_cast<std::int32_t>(little_endian_32(b, 0)); });
    if (type == "I8") return decoded<std::int8_t>(bytes, 1, [](scalar b) { return static_cast<std::int8_t>(byte_at(b, 0)); });
    return decoded<std::uint8_t>(bytes, 1, [](scalar b) { return static_cast<std::uint8_t>(byte_at(b, 0)); });
}

/// A tensor's entry in the header: its type, its shape, and the range of its bytes.
struct entry {
    std::string name, type;
    buffer<std::size_t> shape;
    std::size_t begin = 0, end = 0;
};

/// Reads one entry of the header and checks its parts against each other and against the size of the data.
inline entry checked_entry(const std::string& name, const json_value& line, std::size_t data_bytes, const std::string& where) {
    const auto here = [&] { return where + ", tensor " + printable(name); };
    const auto part = [&](const char* key, bool is_right_kind) {
        if (!is_right_kind) raise(error_code::invalid_data, here(), "a valid " + std::string(key), "none, or an invalid value");
    };
    const auto sizes = [&](const char* key, const json_value& values, std::size_t max_count) {
        part(key, values.kind == json_kind::array);
        buffer<std::size_t> result;
        for_each_element(values, [&](const json_value& value) {
            const std::optional<std::uint64_t> size = whole_number(value);
            part(key, result.size() < max_count && size && *size <= (std::numeric_limits<std::size_t>::max)());
            result.push_back(static_cast<std::size_t>(*size));
        });
        return result;
    };
    part("dtype", line.kind == json_kind::object);
    json_value type, shape, place;  // found in one pass, because a header may have a hundred thousand entries
    int members = 0;
    for_each_member(line, [&](const std::string& key, const json_value& value) {
        ++members;
        if (key == "dtype") type = value;
        if (key == "shape") shape = value;
        if (key == "data_offsets") place = value;
    });
    entry result;
    result.name = name;
    part("dtype", type.kind == json_kind::string);
    result.type = unescaped(type.text);
    result.shape = sizes("shape", shape, max_dimensions);
    const buffer<std::size_t> offsets = sizes("data_offsets", place, 2);
    part("data_offsets", offsets.size() == 2 && members == 3);
    result.begin = offsets[0], result.end = offsets[1];

    const std::size_t scalar_bytes = scalar_size(result.type);
    if (scalar_bytes == 0) raise(error_code::unsupported, here(), "a type F32, F16, BF16, I32, I8 or U8", printable(result.type));
    if (result.begin > result.end || result.end > data_bytes)
        raise(error_code::invalid_data, here(), "values inside the " + std::to_string(data_bytes) + " bytes of data",
              "bytes " + std::to_string(result.begin) + " to " + std::to_string(result.end));
    std::size_t needed = scalar_bytes;
    for (std::size_t length : result.shape) {
        if (length != 0 && needed > (std::numeric_limits<std::size_t>::max)() / length)
            raise(error_code::too_large, here(), "a shape that fits in memory", shape_text(result.shape));
        needed *= length;
    }
    if (needed != result.end - result.begin)
        raise(error_code::invalid_data, here(),
              std::to_string(needed) + " bytes for " + shape_text(result.shape) + " of " + result.type,
              std::to_string(result.end - result.begin));
    return result;
}

inline decltype(named_tensors::metadata) checked_metadata(const json_value& line, const std::string& where) {
    if (line.kind != json_kind::object)
        raise(error_code::invalid_data, where, "a JSON object as metadata", std::string(kind_text(line.kind)));
    decltype(named_tensors::metadata) result;
    for_each_member(line, [&](const std::string& key, const json_value& value) {
        if (value.kind != json_kind::string)
            raise(error_code::invalid_data, where, "metadata with string values",
                  std::string(kind_text(value.kind)) + " for " + printable(key));
        result.emplace(key, unescaped(value.text));
    });
    return result;
}

}  // namespace detail::safetensors

inline named_tensors decode_safetensors(std::span<const std::byte> bytes, const std::string& where) {
    using namespace detail::safetensors;
    if (bytes.size() < 8)
        raise(error_code::invalid_data, where, "at least 8 bytes, which state the header's length",
              std::to_string(bytes.size()) + " bytes");
    const std::uint64_t header_bytes = detail::little_endian_32(bytes, 0) | std::uint64_t{detail::little_endian_32(bytes, 4)}
                                                                                << 32;
    if (header_bytes > bytes.size() - 8 && !detail::has_text(bytes, 8, "{"))
        raise(error_code::invalid_data, where, "a safetensors file", describe_format(bytes));
    if (header_bytes > bytes.size() - 8)
        raise(error_code::invalid_data, where, "a header of " + std::to_string(header_bytes) + " bytes",
              std::to_string(bytes.size() - 8) + " bytes in total");
    if (header_bytes > max_header_bytes)
        raise(error_code::too_large, where, "a header of at most " + std::to_string(max_header_bytes) + " bytes",
              std::to_string(header_bytes));
    const std::size_t text_bytes = static_cast<std::size_t>(header_bytes);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + 8, text_bytes);
    const std::span<const std::byte> data = bytes.subspan(8 + text_bytes);

    named_tensors result;
    result.where = where;
    buffer<entry> entries;
    const detail::json_value header = detail::read_json_object(text, max_nesting, where);
    detail::for_each_member(header, [&](const std::string& name, const detail::json_value& line) {
        if (name == "__metadata__")
            result.metadata = checked_metadata(line, where);
        else
            entries.push_back(checked_entry(name, line, data.size(), where));
    });

    // Checks that the tensors fill the data without gaps or overlaps. The decoded tensors then need at most twice the size of
    // the file, because half-precision numbers become float.
    std::sort(entries.begin(), entries.end(),
              [](const entry& a, const entry& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
    std::size_t filled = 0;
    for (const entry& e : entries) {
        if (e.begin != filled)
            raise(error_code::invalid_data, where + ", tensor " + detail::printable(e.name),
                  "values from byte " + std::to_string(filled) + ", the end of the previous tensor",
                  "byte " + std::to_string(e.begin));
        filled = e.end;
    }
    if (filled != data.size())
        raise(error_code::invalid_data, where, "tensors that fill " + std::to_string(data.size()) + " bytes of data",
              std::to_string(filled) + " bytes in tensors");
    for (entry& e : entries) {
        decltype(tensor::values) values = decode_values(data.subspan(e.begin, e.end - e.begin), e.type);
        result.tensors.emplace(std::move(e.name), tensor{std::move(e.shape), std::move(values)});
    }
    return result;
}

}}  // namespace ldi
