// Reads the first directory of a TIFF structure: TIFF 6.0, BigTIFF, and JPEG's Multi-Picture Format (CIPA DC-007). Copies no
// values, because the entries of a hostile file may all refer to the same bytes.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/formats/picture_header.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A directory of a TIFF structure. Numbers beyond the end of the bytes are read as 0.
class tiff_directory {
public:
    struct entry {
        std::size_t tag = 0, type = 0;
        std::uint64_t count = 0;
        std::size_t place = 0;  ///< offset of the first value
        double bytes = 0;       ///< size of all values
        bool is_inside = true;  ///< whether the values are stored in the directory itself
    };

    explicit tiff_directory(std::span<const std::byte> tiff) : bytes_(tiff) {
        is_little_endian_ = has_text(tiff, 0, "II");
        is_big_ = number(2, 2) == 43;
        place_ = is_big_ ? number(8, 8) : number(4, 4);
    }

    /// Returns the directory at another offset of the same structure.
    tiff_directory at(std::uint64_t place) const {
        tiff_directory other = *this;
        other.place_ = place;
        return other;
    }

    /// Calls visit(entry) for each entry that lies inside the bytes.
    template <class Visit>
    void for_each(Visit&& visit) const {
        const std::size_t head = is_big_ ? 8 : 2, size = is_big_ ? 20 : 12, length = is_big_ ? 8 : 4;
        if (place_ > bytes_.size()) return;
        const std::uint64_t count = number(static_cast<std::size_t>(place_), head);
        std::size_t place = static_cast<std::size_t>(place_) + head;
        for (std::uint64_t i = 0; i < count && place + size <= bytes_.size(); ++i, place += size) {
            entry e;
            e.tag = static_cast<std::size_t>(number(place, 2)), e.type = static_cast<std::size_t>(number(place + 2, 2));
            e.count = number(place + 4, length);
            e.bytes = nearest_double(e.count) * nearest_double(size_of_type(e.type));
            e.place = place + 4 + length;
            e.is_inside = e.bytes <= nearest_double(length);
            if (!e.is_inside) {
                const std::uint64_t stated = number(e.place, length);
                e.place = stated < bytes_.size() ? static_cast<std::size_t>(stated) : bytes_.size();
            }
            visit(e);
        }
    }

    /// Returns the first value of the first entry with this tag; empty if there is no such entry.
    std::optional<std::uint64_t> find(std::size_t tag) const {
        std::optional<std::uint64_t> found;
        for_each([&](const entry& e) {
            if (e.tag == tag && e.count > 0 && !found) found = value(e);
        });
        return found;
    }

    std::uint64_t value(const entry& e, std::size_t index = 0) const {
        const std::size_t size = size_of_type(e.type);
        return number(e.place + index * size, size);
    }

    std::uint64_t number(std::size_t at, std::size_t size) const {
        if (size > bytes_.size() || at > bytes_.size() - size) return 0;
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i) value = value << 8 | byte_at(bytes_, at + (is_little_endian_ ? size - 1 - i : i));
        return value;
    }

private:
    static std::size_t size_of_type(std::size_t type) {
        constexpr std::string_view sizes("\0\1\1\2\4\x8\1\1\2\4\x8\4\x8\4\0\0\x8\x8\x8", 19);
        return type < sizes.size() ? static_cast<std::size_t>(sizes[type]) : 0;
    }

    std::span<const std::byte> bytes_;
    bool is_little_endian_ = false, is_big_ = false;
    std::uint64_t place_ = 0;
};

}}}  // namespace ldi::detail
