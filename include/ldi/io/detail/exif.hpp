// Reads the camera's orientation and focal length from EXIF data (CIPA DC-008), a TIFF structure.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/io/detail/tiff_directory.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct exif_facts {
    unsigned orientation = 1;                ///< 1 to 8, as in EXIF
    std::optional<float> focal_length_35mm;  ///< in millimeters
};

/// Returns the first value of a tag of type SHORT or LONG; empty if there is no such tag.
inline std::optional<unsigned> exif_number(const tiff_directory& directory, std::size_t tag) {
    constexpr std::size_t short_type = 3, long_type = 4;
    std::optional<unsigned> found;
    directory.for_each([&](const tiff_directory::entry& e) {
        if (e.tag == tag && e.count > 0 && (e.type == short_type || e.type == long_type) && !found)
            found = static_cast<unsigned>(directory.value(e));
    });
    return found;
}

/// Reads EXIF data. Returns the defaults for empty or damaged data, because the photo is usable without EXIF.
///
/// tiff  the TIFF structure that contains the EXIF data
inline exif_facts read_exif(std::span<const std::byte> tiff) {
    constexpr std::size_t max_size = std::size_t{1} << 20, orientation_tag = 0x0112, exif_tag = 0x8769, focal_length_tag = 0xA405;
    exif_facts facts;
    const tiff_directory directory(tiff);
    const bool has_order = has_text(tiff, 0, "II") || has_text(tiff, 0, "MM");
    if (tiff.size() > max_size || !has_order || directory.number(2, 2) != 42) return facts;
    const std::optional<unsigned> orientation = exif_number(directory, orientation_tag);
    if (orientation && *orientation >= 1 && *orientation <= 8) facts.orientation = *orientation;
    const std::optional<unsigned> place = exif_number(directory, exif_tag);
    if (!place) return facts;
    const std::optional<unsigned> focal_length = exif_number(directory.at(*place), focal_length_tag);
    if (focal_length && *focal_length > 0) facts.focal_length_35mm = nearest_float(*focal_length);  // 0 means unknown
    return facts;
}

}}}  // namespace ldi::detail
