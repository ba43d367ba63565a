// Reads JSON (RFC 8259) from headers of weight files. A json_value is a view of a checked part of the text, so reading copies
// only the requested parts. The text is untrusted.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/formats/detail/json_reader.hpp>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Checks that a text consists of one JSON object, and returns the object. Raises invalid_data. Messages about syntax errors
/// state the byte offset.
///
/// max_depth  maximum nesting of objects and arrays
/// where      name of the text in messages
inline json_value read_json_object(std::string_view text, int max_depth, const std::string& where) {
    return json_reader(text, max_depth, where).whole_object();
}

inline std::string unescaped(std::string_view written) {
    buffer<char> letters;
    append_unescaped(written, letters);
    return std::string(letters.data(), letters.size());
}

/// Calls visit(name, value) for every member of a checked object.
template <class Visit>
void for_each_member(const json_value& object, Visit&& visit) {
    const json_visitor call = [](void* to, std::string_view name, const json_value& value) {
        (*static_cast<std::remove_reference_t<Visit>*>(to))(unescaped(name), value);
    };
    json_reader(object.text).walk_object(0, call, &visit);
}

/// Calls visit(value) for every element of a checked array.
template <class Visit>
void for_each_element(const json_value& array, Visit&& visit) {
    const json_visitor call = [](void* to, std::string_view, const json_value& value) {
        (*static_cast<std::remove_reference_t<Visit>*>(to))(value);
    };
    json_reader(array.text).walk_array(0, call, &visit);
}

/// Finds a member by name. The result has kind `none` if there is no such member or `object` is not an object.
inline json_value json_member(const json_value& object, std::string_view name) {
    json_value result;
    if (object.kind != json_kind::object) return result;
    for_each_member(object, [&](const std::string& found, const json_value& value) {
        if (found == name) result = value;
    });
    return result;
}

/// Parses a whole number below 2^64 without sign, decimal point or exponent. Returns an empty result for any other value.
inline std::optional<std::uint64_t> whole_number(const json_value& value) {
    if (value.kind != json_kind::number) return std::nullopt;
    std::uint64_t result = 0;
    for (const char c : value.text) {
        if (c < '0' || c > '9') return std::nullopt;
        const std::uint64_t digit = static_cast<std::uint64_t>(c - '0');
        if (result > ((std::numeric_limits<std::uint64_t>::max)() - digit) / 10) return std::nullopt;
        result = result * 10 + digit;
    }
    return result;
}

}}}  // namespace ldi::detail
