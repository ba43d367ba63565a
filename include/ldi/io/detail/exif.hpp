// Reads the camera's orientation and focal length from EXIF data with libexif.
#pragma once

#include <ldi/base/config.hpp>

#include <ldi/base/numbers.hpp>

#include <libexif/exif-data.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct exif_facts {
    unsigned orientation = 1;                ///< 1 to 8, as in EXIF
    std::optional<float> focal_length_35mm;  ///< in millimeters
};

/// Returns the first value of a tag of type SHORT or LONG; empty for other types.
inline std::optional<unsigned> exif_number(ExifData* data, ExifIfd directory, ExifTag tag) {
    const ExifEntry* const entry = exif_content_get_entry(data->ifd[directory], tag);
    if (entry == nullptr || entry->data == nullptr || entry->components < 1) return std::nullopt;
    const ExifByteOrder order = exif_data_get_byte_order(data);
    if (entry->format == EXIF_FORMAT_SHORT && entry->size >= 2) return exif_get_short(entry->data, order);
    if (entry->format == EXIF_FORMAT_LONG && entry->size >= 4) return exif_get_long(entry->data, order);
    return std::nullopt;
}

/// Reads EXIF data. Returns the defaults for empty or damaged data, because the photo is usable without EXIF.
///
/// tiff  the TIFF structure that contains the EXIF data
inline exif_facts read_exif(std::span<const std::byte> tiff) {
    exif_facts facts;
    constexpr std::size_t limit = std::size_t{1} << 20;
    if (tiff.empty() || tiff.size() > limit) return facts;
    struct release {
        void operator()(ExifData* data) const { exif_data_unref(data); }
    };
    const std::unique_ptr<ExifData, release> data(exif_data_new());
    if (!data) return facts;
    exif_data_unset_option(data.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);

    std::vector<unsigned char> bytes = {'E', 'x', 'i', 'f', 0, 0};
    const unsigned char* const first = reinterpret_cast<const unsigned char*>(tiff.data());
    bytes.insert(bytes.end(), first, first + tiff.size());
    exif_data_load_data(data.get(), bytes.data(), static_cast<unsigned>(bytes.size()));

    const std::optional<unsigned> orientation = exif_number(data.get(), EXIF_IFD_0, EXIF_TAG_ORIENTATION);
    if (orientation && *orientation >= 1 && *orientation <= 8) facts.orientation = *orientation;
    const std::optional<unsigned> focal_length = exif_number(data.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
    if (focal_length && *focal_length > 0) facts.focal_length_35mm = nearest_float(*focal_length);  // 0 means unknown
    return facts;
}

}}}  // namespace ldi::detail
