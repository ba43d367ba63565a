// Photos: JPEG, PNG, HEIC, AVIF, WebP and TIFF files, upright and as 8-bit sRGB whatever they hold. The lens, where EXIF names
// it, comes along, since the field of view decides how far apart in space two pixels lie.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/detail/color_profile.hpp>
#include <ldi/formats/detail/exif.hpp>
#include <ldi/formats/detail/orientation.hpp>
#include <ldi/formats/detail/picture_decoder.hpp>
#include <ldi/formats/detail/readers.hpp>
#include <ldi/formats/detail/stored_photo.hpp>
#include <ldi/formats/file.hpp>
#include <ldi/formats/picture_limits.hpp>

#if defined(LDI_WITH_LIBHEIF)
#include <ldi/formats/detail/heif_file.hpp>
#endif
#if defined(LDI_WITH_LIBWEBP)
#include <ldi/formats/detail/webp_photo.hpp>
#endif
#if defined(LDI_WITH_LIBTIFF)
#include <ldi/formats/detail/tiff_photo.hpp>
#endif

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <new>
#include <optional>
#include <span>
#include <string>

namespace ldi::inline LDI_CONFIGURATION {

/// A photo as a person sees it.
struct photo {
    image<std::uint8_t> color;               ///< H x W x 3: red, green, blue, sRGB
    std::optional<float> focal_length_35mm;  ///< EXIF FocalLengthIn35mmFilm, in millimeters; see focal_length_from_35mm()
};

struct photo_options {
    picture_limits limits;
};

inline namespace LDI_READERS {

/// Decodes a JPEG or PNG file in memory; also HEIC, AVIF, WebP and TIFF, where ldi::io was configured with their libraries.
///
/// The EXIF orientation is applied. Colors become sRGB, by the file's profile (ICC; Display P3 and BT.2020 by their number),
/// where ldi::io has Little CMS. Gray becomes RGB, Adobe CMYK and YCCK too (without a profile); of 16 bits the upper 8 are kept;
/// what is transparent is laid on white. An animated PNG gives its default picture, which is its first frame in most. Gain maps
/// (Ultra HDR, HEIC) are left alone: the photo is as an ordinary screen shows it.
///
/// where  the name that errors give the data
/// Raises unsupported (another format, which the message names), invalid_data (empty, cut off or damaged), too_large.
photo decode_photo(std::span<const std::byte> bytes, const photo_options& options = {}, const std::string& where = "photo");

/// decode_photo() of a file; also raises file_access.
photo load_photo(const std::filesystem::path& path, const photo_options& options = {});

}  // inline namespace

namespace detail {

/// `value` seen through `alpha` on white.
inline std::uint8_t over_white(unsigned value, unsigned alpha) {
    return static_cast<std::uint8_t>((value * alpha + 255 * (255 - alpha) + 127) / 255);
}

/// H x W x 3, upright, the profile not yet applied. Raises too_large.
inline image<std::uint8_t> upright_color(const stored_photo& photo, const std::string& where) {
    const decoded_picture<std::uint8_t>& stored = photo.picture;
    const upright_order order = make_upright(photo.orientation, stored.height, stored.width);
    image<std::uint8_t> color;
#if LDI_HAS_EXCEPTIONS
    try {
        color = image<std::uint8_t>(order.height, order.width, 3, unset);
    } catch (const std::bad_alloc&) {
        raise(error_code::too_large, where, "a picture that fits in memory",
              std::to_string(stored.width) + " x " + std::to_string(stored.height) + " pixels");
    }
#else  // a lack of memory goes to the error handler as it is
    color = image<std::uint8_t>(order.height, order.width, 3, unset);
#endif
    const bool has_alpha = stored.channels == 2 || stored.channels == 4;
    const std::size_t green = stored.channels >= 3 ? 1 : 0, blue = stored.channels >= 3 ? 2 : 0;
    std::ptrdiff_t row = order.origin;
    for (std::size_t y = 0; y < order.height; ++y, row += order.down) {
        std::uint8_t* to = color.row(y);
        std::ptrdiff_t from = row;
        for (std::size_t x = 0; x < order.width; ++x, to += 3, from += order.right) {
            const std::uint8_t* const sample = stored.samples.get() + static_cast<std::size_t>(from) * stored.channels;
            to[0] = sample[0], to[1] = sample[green], to[2] = sample[blue];
            if (!has_alpha) continue;
            const unsigned alpha = sample[stored.channels - 1];
            for (std::size_t c = 0; c < 3; ++c) to[c] = over_white(to[c], alpha);
        }
    }
    return color;
}

inline stored_photo decode_jpeg_or_png(std::span<const std::byte> bytes, const picture_limits& limits, const std::string& where) {
    const picture_header header = read_picture_header(bytes, where);
    check_limits(header, bytes.size(), limits, where);
    stored_photo photo;
    photo.picture = decode_picture<std::uint8_t>(bytes, header, where);
    const exif_facts facts = read_exif(header.exif);
    photo.orientation = facts.orientation, photo.focal_length_35mm = facts.focal_length_35mm;
    photo.profile.icc =
        header.format == picture_format::png ? png_profile(header.profile_chunk) : jpeg_profile(header.extensions);
    return photo;
}

}  // namespace detail

namespace detail::inline LDI_READERS {

/// By what the first bytes say. Raises as decode_photo() does.
inline stored_photo decode_stored(std::span<const std::byte> bytes, const picture_limits& limits, const std::string& where) {
    if (is_jpeg(bytes) || is_png(bytes)) return decode_jpeg_or_png(bytes, limits, where);
    const char* expected =
        "a JPEG"
#if defined(LDI_WITH_LIBHEIF)
        ", HEIC, AVIF"
#endif
#if defined(LDI_WITH_LIBWEBP)
        ", WebP"
#endif
#if defined(LDI_WITH_LIBTIFF)
        ", TIFF"
#endif
        " or PNG file";
#if defined(LDI_WITH_LIBHEIF)
    if (is_heif(bytes)) return decode_heif(bytes, limits, where);
#endif
#if defined(LDI_WITH_LIBWEBP)
    if (is_webp(bytes)) return decode_webp(bytes, limits, where);
#endif
#if defined(LDI_WITH_LIBTIFF)
    if (is_tiff(bytes)) return decode_tiff(bytes, limits, where);
#endif
    std::string found = describe_format(bytes);
    if (is_heif(bytes) || is_webp(bytes) || is_tiff(bytes))
        found += ", which this build does not read: its library was not there when ldi was configured";
    raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, expected, found);
}

}  // namespace detail

inline namespace LDI_READERS {

inline photo decode_photo(std::span<const std::byte> bytes, const photo_options& options, const std::string& where) {
    const detail::stored_photo stored = detail::decode_stored(bytes, options.limits, where);
    photo result;
    result.focal_length_35mm = stored.focal_length_35mm;
    result.color = detail::upright_color(stored, where);
    detail::convert_to_srgb(result.color, stored.profile);
    return result;
}

inline photo load_photo(const std::filesystem::path& path, const photo_options& options) {
    return decode_photo(read_file(path), options, path.string());
}

}  // inline namespace

}  // namespace ldi
