// Reads XMP packets (ISO 16684-1) with pugixml as a flat list of properties. A property is an attribute, or an element without
// child elements, whose name has a namespace prefix. The list contains the namespace, name and text of each property.
#pragma once

#include <ldi/io/detail/decoding_budget.hpp>

#include <pugixml.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct xmp_property {
    std::string_view space;  ///< URI of the namespace, without the slash that some writers append
    std::string_view name, text;
    std::size_t owner;  ///< index of the structure that contains the property
};

/// Returns the decimal number at the start of a text; empty if there is no number, or if the number is not finite.
inline std::optional<double> leading_number(std::string_view text) {
    double value = 0;
#if defined(__cpp_lib_to_chars)
    const std::from_chars_result read = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool is_read = read.ec == std::errc();
#else  // Emscripten's std::from_chars reads only integers; std::strtod also accepts "+1", " 1" and "0x1"
    const std::string digits(text.substr(0, (std::min)(text.find_first_not_of("0123456789.eE+-"), std::size_t{64})));
    char* end = nullptr;
    value = std::strtod(digits.c_str(), &end);
    const bool is_read = end != digits.c_str() && digits[0] != '+';
#endif
    return is_read && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// Properties of one or more packets. A damaged packet contributes only the properties before the damage.
class xmp_properties {
public:
    /// Adds the properties of a packet. Ignores packets after the first 16, because real photos have fewer. Raises too_large,
    /// out_of_memory.
    void add(std::span<const std::byte> packet, decoding_budget& budget, const std::string& where) {
        if (documents_.size() == max_packets) return;
        take(packet, budget, where);
        documents_.push_back(std::make_unique<pugi::xml_document>());
        pugi::xml_document& document = *documents_.back();
        const pugi::xml_parse_result parsed =
            document.load_buffer(packet.data(), packet.size(), pugi::parse_minimal | pugi::parse_escapes | pugi::parse_cdata);
        if (parsed.status == pugi::status_out_of_memory)
            raise(error_code::out_of_memory, where, "memory for " + std::to_string(packet.size()) + " bytes of XMP",
                  "too little memory");
        structure_walker walker(*this);
        document.traverse(walker);
    }

    const std::vector<xmp_property>& all() const { return list_; }

    /// Returns the text of the first property with this namespace and name. If `owner` is given, searches only that structure.
    std::optional<std::string_view> text(std::string_view space, std::string_view name,
                                         std::optional<std::size_t> owner = {}) const {
        for (const xmp_property& p : list_)
            if (p.space == space && p.name == name && (!owner || p.owner == *owner)) return p.text;
        return std::nullopt;
    }

    /// Returns the value of a property; empty if it is not a finite number.
    std::optional<double> number(std::string_view space, std::string_view name, std::optional<std::size_t> owner = {}) const {
        const std::optional<std::string_view> written = text(space, name, owner);
        if (!written) return std::nullopt;
        return leading_number(*written);
    }

private:
    /// Charges the memory for parsing. pugixml allocates a page of 32 KiB for each packet, twice the packet's size if it converts
    /// the packet to UTF-8, and at most 64 bytes per element, text and attribute. Each "<" starts at most one element and one
    /// text, and each "=" belongs to at most one attribute.
    static void take(std::span<const std::byte> packet, decoding_budget& budget, const std::string& where) {
        const auto is_mark = [](std::byte b) { return b == std::byte{'<'} || b == std::byte{'='}; };
        const std::ptrdiff_t marks = std::count_if(packet.begin(), packet.end(), is_mark);
        budget.charge(33'000 + 2 * nearest_double(packet.size()) + 128 * nearest_double(marks), where,
                      "XMP of " + std::to_string(packet.size()) + " bytes");
    }

    /// Visits all elements without recursion, so that nesting cannot exhaust the stack.
    struct structure_walker : pugi::xml_tree_walker {
        explicit structure_walker(xmp_properties& properties) : to(properties) {}

        bool for_each(pugi::xml_node& node) override {
            if (node.type() != pugi::node_element) return true;
            ++to.elements_;
            numbers.resize(static_cast<std::size_t>(depth()) + 1);
            numbers.back() = to.elements_;
            declare_namespaces(node);
            for (const pugi::xml_attribute attribute : node.attributes())
                append(attribute.name(), attribute.value(), to.elements_);
            const bool is_leaf = !node.first_child() || (!node.first_child().next_sibling() && !node.first_child().first_child());
            if (is_leaf && numbers.size() > 1) append(node.name(), node.child_value(), numbers[numbers.size() - 2]);
            return to.looked_at_ <= max_properties;
        }

        void declare_namespaces(pugi::xml_node node) {
            constexpr std::string_view keyword = "xmlns:";
            while (!declared.empty() && declared.back().depth >= depth()) declared.pop_back();
            for (const pugi::xml_attribute attribute : node.attributes()) {
                const std::string_view name = attribute.name();
                if (name.starts_with(keyword) && name.size() <= keyword.size() + max_prefix && declared.size() < max_namespaces)
                    declared.push_back({depth(), name.substr(keyword.size()), beginning(attribute.value())});
            }
        }

        void append(std::string_view qualified, std::string_view text, std::size_t owner) {
            const std::size_t colon = qualified.find(':');
            if (++to.looked_at_ > max_properties || colon == qualified.npos) return;
            const std::string_view prefix = qualified.substr(0, colon);
            const auto found = std::find_if(declared.rbegin(), declared.rend(),
                                            [&](const namespace_declaration& d) { return d.prefix == prefix; });
            if (found != declared.rend()) to.list_.push_back({found->space, qualified.substr(colon + 1), text, owner});
        }

        struct namespace_declaration {
            int depth;  ///< of the element that contains the declaration
            std::string_view prefix, space;
        };

        xmp_properties& to;
        std::vector<std::size_t> numbers;  ///< indices of the enclosing elements, outermost first, and of the visited element
        std::vector<namespace_declaration> declared;  ///< namespaces of the visited element, in the order of declaration
    };

    /// Returns the first max_space characters of a URI, without the slash at the end. Known namespaces have shorter URIs, but a
    /// URI in a hostile packet may be a megabyte long.
    static std::string_view beginning(const char* address) {
        std::size_t size = 0;
        while (size < max_space && address[size] != 0) ++size;
        return {address, size > 0 && address[size - 1] == '/' ? size - 1 : size};
    }

    // Limits far above the numbers in any real packet. They bound the time to find the namespace of each property. The
    // candidates are the namespaces that the property's element and its enclosing elements declare.
    static constexpr std::size_t max_packets = 16, max_properties = 10'000, max_namespaces = 256, max_prefix = 64,
                                 max_space = 256;

    std::vector<std::unique_ptr<pugi::xml_document>> documents_;
    std::vector<xmp_property> list_;
    std::size_t elements_ = 0, looked_at_ = 0;
};

/// Adds the XMP of a JPEG file: the main packet, and Extended XMP, which distributes data beyond 64 kB over several segments.
///
/// Raises too_large.
inline void add_jpeg_xmp(xmp_properties& to, std::span<const std::span<const std::byte>> segments, std::size_t file_size,
                         decoding_budget& budget, const std::string& where) {
    constexpr std::string_view packet_name("http://ns.adobe.com/xap/1.0/\0", 29);
    constexpr std::string_view part_name("http://ns.adobe.com/xmp/extension/\0", 35);
    for (const std::span<const std::byte> segment : segments)
        if (has_text(segment, 0, packet_name)) to.add(segment.subspan(packet_name.size()), budget, where);
    const std::optional<std::string_view> identifier = to.text("http://ns.adobe.com/xmp/note", "HasExtendedXMP");
    if (!identifier || identifier->size() != 32) return;
    std::vector<std::byte> whole;
    for (const std::span<const std::byte> segment : segments) {
        // Fields: name, identifier, total length, offset of the part.
        if (!has_text(segment, 0, part_name) || !has_text(segment, 35, *identifier) || segment.size() < 75) continue;
        const std::size_t length = big_endian_32(segment, 67), place = big_endian_32(segment, 71);
        const std::span<const std::byte> part = segment.subspan(75);
        if (length > file_size || place > length || part.size() > length - place) continue;
        if (length > whole.size()) {
            budget.charge(nearest_double(length), where, "XMP of " + std::to_string(length) + " bytes");
            whole.resize(length);
        }
        std::copy(part.begin(), part.end(), whole.begin() + static_cast<std::ptrdiff_t>(place));
    }
    if (!whole.empty()) to.add(whole, budget, where);
}

/// Decodes base64. Skips white space and padding, and stops at any other character.
inline std::vector<std::byte> decode_base64(std::string_view text) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned char value_of[256];
    std::memset(value_of, 255, sizeof value_of);
    for (std::size_t i = 0; i < digits.size(); ++i)
        value_of[static_cast<unsigned char>(digits[i])] = static_cast<unsigned char>(i);
    std::vector<std::byte> bytes;
    bytes.reserve(text.size() / 4 * 3 + 3);
    unsigned pending = 0, count = 0;
    for (const char c : text) {
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
        const unsigned value = value_of[static_cast<unsigned char>(c)];
        if (value == 255) break;
        pending = (pending << 6 | value) & 0xFFFFFF, count += 6;
        if (count >= 8) count -= 8, bytes.push_back(static_cast<std::byte>(pending >> count & 255));
    }
    return bytes;
}

}}}  // namespace ldi::detail
