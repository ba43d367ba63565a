// Reads the boxes of a HEIC or AVIF file (ISO 14496-12, ISO 23008-12) that list the file's items, the positions of each item's
// bytes, and the other items from which each item is derived. libheif 1.15 follows references between items without limits, so
// detail/heif_items.hpp first rejects cyclic and deeply nested references.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A picture or a block of metadata.
struct heif_item {
    std::string_view type;                       ///< "hvc1", "av01", "grid", "Exif", ...
    buffer<std::span<const std::byte>> extents;  ///< pieces of the file that contain the item's bytes
    buffer<std::size_t> properties;              ///< indices into heif_boxes::properties
    buffer<std::uint32_t> sources;               ///< items from which this picture is derived
    buffer<std::uint32_t> auxiliaries;           ///< auxiliary pictures of this picture: alpha, depth and others
    bool has_open_end = false;                   ///< an extent states no length and extends to the end of the file
};

struct heif_property {
    std::string_view type;
    std::span<const std::byte> body;
};

/// Reads consecutive big-endian numbers. Raises invalid_data if too few bytes are left.
class heif_numbers {
public:
    heif_numbers(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {}

    std::uint64_t next(std::size_t size) {
        if (size > bytes_.size() - at_) damaged(picture_format::heif, where_, "a box that is cut off");
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i) value = value << 8 | byte_at(bytes_, at_++);
        return value;
    }
    std::uint32_t next_32(std::size_t size) { return static_cast<std::uint32_t>(next(size)); }
    std::string_view text(std::size_t size) {
        if (size > bytes_.size() - at_) damaged(picture_format::heif, where_, "a box that is cut off");
        const std::string_view found(reinterpret_cast<const char*>(bytes_.data()) + at_, size);
        at_ += size;
        return found;
    }
    std::span<const std::byte> rest() const { return bytes_.subspan(at_); }

private:
    std::span<const std::byte> bytes_;
    const std::string& where_;
    std::size_t at_ = 0;
};

/// Reads all boxes of a file. Raises invalid_data, unsupported, too_large.
class heif_boxes {
public:
    std::map<std::uint32_t, heif_item> items;
    buffer<heif_property> properties;
    std::uint32_t primary = 0;

    heif_boxes(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {
        std::span<const std::byte> meta;
        for_each_box(
            bytes,
            [&](std::string_view type, std::span<const std::byte> body) {
                if (type == "meta") keep_only(meta, body, "meta");
            },
            true);
        read_meta(meta);
    }

private:
    // No file from a camera reaches these limits. libheif's run time grows with the square of the number of items, and with the
    // number of references.
    static constexpr std::size_t max_boxes = 100'000, max_items = 4096, max_entries = 65'536, max_properties = 64;

    [[noreturn]] void broken(const std::string& found) const { damaged(picture_format::heif, where_, found); }

    /// Rejects a second box of a kind that must be unique, because readers disagree on which of the boxes to use.
    void keep_only(std::span<const std::byte>& kept, std::span<const std::byte> found, const char* type) const {
        if (!kept.empty()) broken("a second box '" + std::string(type) + "'");
        kept = found;
    }

    void count(std::size_t& counted, std::size_t more, std::size_t max, const char* what) const {
        counted += more;
        if (counted > max) raise(error_code::too_large, where_, "at most " + std::to_string(max) + " " + what, "more");
    }

    /// Calls visit(type, body) for each box.
    ///
    /// is_whole_file  whether `all` is the whole file; if so, ignores the first damaged box and everything after it, as libheif
    ///                does
    template <class Visit>
    void for_each_box(std::span<const std::byte> all, Visit&& visit, bool is_whole_file = false) {
        while (all.size() >= 8) {
            count(boxes_, 1, max_boxes, "boxes");
            heif_numbers head(all, where_);
            std::uint64_t size = head.next(4);
            const std::string_view type = head.text(4);
            std::size_t start = 8;
            if (size == 1 && all.size() >= 16) size = head.next(8), start = 16;
            if (size == 0) size = all.size();
            const bool is_damaged = size < start || size > all.size();
            if (is_damaged && is_whole_file) return;
            if (is_damaged) broken("a box of " + std::to_string(size) + " bytes");
            visit(type, all.subspan(start, static_cast<std::size_t>(size) - start));
            all = all.subspan(static_cast<std::size_t>(size));
        }
    }

    void read_meta(std::span<const std::byte> meta) {
        if (meta.size() < 4) broken("no metadata");
        std::span<const std::byte> pitm, iinf, iloc, iprp, iref;
        const std::pair<const char*, std::span<const std::byte>*> parts[] = {{"pitm", &pitm}, {"iinf", &iinf}, {"iloc", &iloc},
                                                                             {"iprp", &iprp}, {"iref", &iref}, {"idat", &idat_}};
        for_each_box(meta.subspan(4), [&](std::string_view type, std::span<const std::byte> body) {
            for (const auto& [name, part] : parts)
                if (type == name) keep_only(*part, body, name);
        });
        heif_numbers numbers(pitm, where_);
        primary = numbers.next_32(version(numbers) == 0 ? 2 : 4);
        read_items(iinf);
        read_locations(iloc);
        read_properties(iprp);
        if (!iref.empty()) read_references(iref);
    }

    /// Reads the version and flags at the start of a full box.
    static unsigned version(heif_numbers& numbers, unsigned* flags = nullptr) {
        const unsigned result = static_cast<unsigned>(numbers.next(1)), found = static_cast<unsigned>(numbers.next(3));
        if (flags != nullptr) *flags = found;
        return result;
    }

    void read_items(std::span<const std::byte> iinf) {
        heif_numbers list(iinf, where_);
        list.next(version(list) == 0 ? 2 : 4);  // skips the number of boxes, which is redundant
        for_each_box(list.rest(), [&](std::string_view type, std::span<const std::byte> body) {
            if (type != "infe") return;
            heif_numbers entry(body, where_);
            const unsigned of = version(entry);
            if (of < 2) return;  // these versions do not describe pictures
            const std::uint32_t id = entry.next_32(of == 2 ? 2 : 4);
            entry.next(2);
            count(item_count_, 1, max_items, "items");
            if (!items.emplace(id, heif_item{entry.text(4), {}, {}, {}, {}}).second) broken("an item listed twice");
        });
    }

    void read_locations(std::span<const std::byte> iloc) {
        heif_numbers list(iloc, where_);
        const unsigned of = version(list);
        const std::uint64_t sizes = list.next(2);
        const std::size_t offset_size = sizes >> 12 & 15, length_size = sizes >> 8 & 15, base_size = sizes >> 4 & 15;
        for (const std::size_t size : {offset_size, length_size, base_size})
            if (size != 0 && size != 4 && size != 8) broken("a number of " + std::to_string(size) + " bytes");
        // Only items stored inside other items need extent indices. In version 1, libheif 1.15 would read an index as an offset.
        if (of > 0 && (sizes & 15) != 0)
            raise(error_code::unsupported, where_, "items stored directly in the file", "extents with an index");
        std::size_t extents = 0, located = 0;
        for (std::uint64_t left = list.next(of < 2 ? 2 : 4); left > 0; --left) {
            count(located, 1, max_entries, "locations");
            const auto found = items.find(list.next_32(of < 2 ? 2 : 4));
            const std::uint64_t method = of == 0 ? 0 : list.next(2) & 15;
            list.next(2);
            const std::uint64_t base = list.next(base_size);
            heif_item* const item = found == items.end() ? nullptr : &found->second;
            if (item != nullptr && !item->extents.empty()) broken("an item with two locations");
            for (std::uint64_t more = list.next(2); more > 0; --more) {
                count(extents, 1, max_entries, "extents");
                const std::uint64_t offset = list.next(offset_size), length = list.next(length_size);
                if (item == nullptr) continue;
                item->extents.push_back(extent(method, base, offset, length));
                item->has_open_end = item->has_open_end || length == 0;
            }
        }
    }

    /// Returns the bytes of an extent, cut off at the end of the file. An extent of length 0 extends to the end.
    std::span<const std::byte> extent(std::uint64_t method, std::uint64_t base, std::uint64_t offset,
                                      std::uint64_t length) const {
        if (method > 1)
            raise(error_code::unsupported, where_, "items stored directly in the file", "an item stored inside another item");
        const std::span<const std::byte> all = method == 0 ? bytes_ : idat_;
        if (base > all.size() || offset > all.size() - base) return {};
        const std::span<const std::byte> rest = all.subspan(static_cast<std::size_t>(base + offset));
        return rest.first(static_cast<std::size_t>(length == 0 ? rest.size() : (std::min)(length, std::uint64_t{rest.size()})));
    }

    void read_properties(std::span<const std::byte> iprp) {
        std::span<const std::byte> ipco;
        std::size_t associations = 0;
        for_each_box(iprp, [&](std::string_view type, std::span<const std::byte> body) {
            if (type == "ipco") keep_only(ipco, body, "ipco");
        });
        for_each_box(ipco, [&](std::string_view type, std::span<const std::byte> body) { properties.push_back({type, body}); });
        for_each_box(iprp, [&](std::string_view type, std::span<const std::byte> body) {
            if (type != "ipma") return;
            heif_numbers list(body, where_);
            unsigned flags = 0;
            const std::size_t id_size = version(list, &flags) == 0 ? 2 : 4;
            const bool is_long = (flags & 1) != 0;
            for (std::uint64_t left = list.next(4); left > 0; --left) {
                count(associations, 1, max_entries, "associations of properties");
                const auto found = items.find(list.next_32(id_size));
                std::size_t of_item = found == items.end() ? 0 : found->second.properties.size();
                for (std::uint64_t more = list.next(1); more > 0; --more) {
                    const std::size_t index = is_long ? list.next_32(2) & 0x7FFF : list.next_32(1) & 0x7F;
                    if (index == 0 || index > properties.size() || found == items.end()) continue;
                    count(of_item, 1, max_properties, "properties of an item");
                    found->second.properties.push_back(index - 1);
                }
            }
        });
    }

    /// Rejects a box with unused bytes after its reference. libheif reads references one after another and ignores the sizes of
    /// their boxes, so it would read these bytes as further references.
    void read_references(std::span<const std::byte> iref) {
        heif_numbers list(iref, where_);
        const std::size_t id_size = version(list) == 0 ? 2 : 4;
        std::size_t references = 0;
        for_each_box(list.rest(), [&](std::string_view type, std::span<const std::byte> body) {
            if (type == "uuid") broken("a reference with a longer header");
            heif_numbers entry(body, where_);
            const std::uint32_t from = entry.next_32(id_size);
            for (std::uint64_t left = entry.next(2); left > 0; --left) {
                count(references, 1, max_entries * 2, "references");
                const std::uint32_t to = entry.next_32(id_size);
                const auto has = [&](std::uint32_t id) { return items.find(id) != items.end(); };
                if (type == "dimg" && has(from)) items.find(from)->second.sources.push_back(to);
                if (type == "auxl" && has(to) && has(from)) items.find(to)->second.auxiliaries.push_back(from);
            }
            if (!entry.rest().empty()) broken("a reference with unused bytes");
        });
    }

    std::span<const std::byte> bytes_, idat_;
    const std::string& where_;
    std::size_t boxes_ = 0, item_count_ = 0;
};

}}}  // namespace ldi::detail
