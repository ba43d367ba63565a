// Reads photos from JPEG, PNG, GIF, BMP, HEIC, AVIF, WebP and TIFF files. The result is always upright and in 8-bit sRGB. Also
// reads the focal length from EXIF, because 3D photos need the camera's field of view.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/picture_formats.hpp>
#include <ldi/io/detail/color_profile.hpp>
#include <ldi/io/detail/decoding_budget.hpp>
#include <ldi/io/detail/exif.hpp>
#include <ldi/io/detail/gif_bmp_header.hpp>
#include <ldi/io/detail/orientation.hpp>
#include <ldi/io/detail/picture_decoder.hpp>
#include <ldi/io/detail/readers.hpp>
#include <ldi/io/detail/stored_photo.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/picture_limits.hpp>

#if defined(LDI_WITH_LIBHEIF)
#include <ldi/io/detail/heif_file.hpp>
#endif
#if defined(LDI_WITH_LIBJPEG)
#include <ldi/io/detail/jpeg_decoder.hpp>
#endif
#if defined(LDI_WITH_LIBWEBP)
#include <ldi/io/detail/webp_photo.hpp>
#endif
#if defined(LDI_WITH_LIBTIFF)
#include <ldi/io/detail/tiff_photo.hpp>
#endif

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A photo in upright orientation, with EXIF orientation applied.
struct photo {
    image<std::uint8_t> color;               ///< H x W x 3: red, green, blue, sRGB
    std::optional<float> focal_length_35mm;  ///< EXIF FocalLengthIn35mmFilm, in millimeters; see focal_length_from_35mm()
};

struct photo_options {
    picture_limits limits = {};
    picture_formats formats = {};  ///< formats that may be read, for the photo and for the depth inside it
    /// Number of pixels that the caller needs along the photo's longer side; 0 means all. The sides of a larger photo are divided
    /// by 2, 4 or 8, rounded up, as long as the longer side keeps this many pixels and the shorter side at least 100. Later
    /// stages then take less time and memory; estimate_photo() still returns the size and memory of the whole photo. PNG files
    /// are never reduced, because one half may be depth; neither are GIF files and others with a channel for opacity.
    std::size_t long_side = 0;
};

inline namespace LDI_READERS {

/// Decodes a JPEG, PNG, GIF or BMP file in memory; also HEIC, AVIF, WebP and TIFF if ldi::io was configured with their
/// libraries.
///
/// Applies the EXIF orientation. If ldi::io was configured with Little CMS, converts colors to sRGB from the file's ICC profile,
/// or from its color primaries if they are Display P3 or BT.2020, and maps the light of PQ and HLG photos (HEIC, AVIF) to the
/// range of ordinary screens. Converts gray to RGB. Converts Adobe CMYK and YCCK to RGB, but ignores their profiles. Keeps the
/// upper 8 of 16 bits. Composites transparent pixels on white. Reads the first frame of an animated GIF and the default picture
/// of an animated PNG, usually its first frame; refuses animated WebP. Ignores gain maps (Ultra HDR, HEIC): the result is the
/// photo as a screen without HDR shows it. While it decodes HEIC or AVIF, glibc fills with zeros what any thread allocates,
/// because damaged pictures would otherwise show old memory contents.
///
/// where  name of the photo in messages
///
/// Raises unsupported for a format that is disabled or that ldi does not read, and names the format. Raises invalid_data for an
/// empty, truncated or damaged file. Raises too_large and out_of_memory.
photo decode_photo(std::span<const std::byte> bytes, const photo_options& options = {}, const std::string& where = "photo");

/// Returns the size of a photo, and the memory that decode_photo() needs. Raises the errors of decode_photo() that the header
/// can cause.
decoding_estimate estimate_photo(std::span<const std::byte> bytes, const photo_options& options = {},
                                 const std::string& where = "photo");

/// Loads a photo from a file as decode_photo() does; also raises file_access.
photo load_photo(const std::filesystem::path& path, const photo_options& options = {});

}  // inline namespace

namespace detail {

/// Composites `value` with opacity `alpha` on white.
inline std::uint8_t over_white(unsigned value, unsigned alpha) {
    return static_cast<std::uint8_t>((value * alpha + 255 * (255 - alpha) + 127) / 255);
}

/// Composites H x W x 4 pixels, red, green, blue and opacity, on white.
inline image<std::uint8_t> over_white(image_view<const std::uint8_t> pixels) {
    LDI_ASSERT(pixels.channels() == 4);
    image<std::uint8_t> color(pixels.height(), pixels.width(), 3, unset);
    for (std::size_t y = 0; y < pixels.height(); ++y) {
        const std::uint8_t* from = pixels.row(y);
        std::uint8_t* to = color.row(y);
        for (std::size_t x = 0; x < pixels.width(); ++x, from += 4, to += 3)
            for (std::size_t c = 0; c < 3; ++c) to[c] = over_white(from[c], from[3]);
    }
    return color;
}

/// Returns H x W x 3, upright, before color conversion.
inline image<std::uint8_t> upright_color(const stored_photo& photo) {
    const decoded_picture<std::uint8_t>& stored = photo.picture;
    const upright_order order = make_upright(photo.orientation, stored.height, stored.width);
    image<std::uint8_t> color(order.height, order.width, 3, unset);
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

/// Reads the header of a file that stb_image decodes. Raises invalid_data, unsupported.
inline picture_header read_plain_header(std::span<const std::byte> bytes, const std::string& where) {
    if (is_gif(bytes)) return read_gif_header(bytes, where);
    return is_bmp(bytes) ? read_bmp_header(bytes, where) : read_picture_header(bytes, where);
}

inline bool is_plain(std::span<const std::byte> bytes) {
    return is_jpeg(bytes) || is_png(bytes) || is_gif(bytes) || is_bmp(bytes);
}

}  // namespace detail

namespace detail::inline LDI_READERS {

/// Raises the error for a file that is not a photo, or that has a format which this build does not read.
[[noreturn]] inline void refuse_format(std::span<const std::byte> bytes, const std::string& where) {
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
        ", GIF, BMP or PNG file";
    std::string found = describe_format(bytes);
    if (is_heif(bytes) || is_webp(bytes) || is_tiff(bytes))
        found += ", which this build cannot read because the library for this format was missing when ldi was configured";
    raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, expected, found);
}

/// Reads the header of the photo and charges the cost of decoding the photo, except for its color profile. Raises the errors of
/// decode_photo().
inline picture_header take_photo_header(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    picture_header header;
    if (is_plain(bytes)) {
        header = read_plain_header(bytes, where);
        budget.charge(header, where);
        return header;
    }
#if defined(LDI_WITH_LIBHEIF)
    if (is_heif(bytes)) {
        budget.check_format(picture_format::heif, where);
        return heif_items(bytes, budget, where).take_primary(budget);
    }
#endif
#if defined(LDI_WITH_LIBWEBP)
    if (is_webp(bytes)) {
        budget.check_format(picture_format::webp, where);
        header = read_webp_header(bytes, where);
        budget.charge(header, where);
        return header;
    }
#endif
#if defined(LDI_WITH_LIBTIFF)
    if (is_tiff(bytes)) return opened_tiff(bytes, budget, where).header;
#endif
    refuse_format(bytes, where);
}

/// Decodes a JPEG, PNG, GIF or BMP file.
///
/// header     header of the file; a decoding_budget must have granted the picture's memory
/// long_side  see photo_options; only JPEG files are reduced, and only by libjpeg
inline stored_photo decode_plain(std::span<const std::byte> bytes, const picture_header& header,
                                 [[maybe_unused]] std::size_t long_side, const std::string& where) {
    stored_photo photo;
    std::vector<std::byte> changed;
    if (header.format == picture_format::gif) changed = plain_gif(bytes);
    if (header.format == picture_format::bmp && bmp_gap(bytes) > 0) changed = plain_bmp(bytes);
#if defined(LDI_WITH_LIBJPEG)
    const bool is_possible = is_jpeg(bytes) && bytes.size() <= 0x7FFFFFFF;
    const std::size_t divisor = is_possible ? divisor_for(long_side, header.height, header.width) : 1;
    if (divisor > 1) photo.picture = jpeg_decoder().decode(bytes, header.height, header.width, divisor);
    photo.is_reduced = photo.picture.samples != nullptr;
#endif
    if (!photo.picture.samples) photo.picture = decode_picture<std::uint8_t>(changed.empty() ? bytes : changed, header, where);
    const exif_facts facts = read_exif(header.exif);
    photo.orientation = facts.orientation, photo.focal_length_35mm = facts.focal_length_35mm;
    photo.profile.icc =
        header.format == picture_format::png ? png_profile(header.profile_chunk) : jpeg_profile(header.extensions);
    return photo;
}

/// Decodes a photo. The file's first bytes determine the format. Raises the errors of decode_photo().
inline stored_photo decode_stored(std::span<const std::byte> bytes, decoding_budget& budget,
                                  [[maybe_unused]] std::size_t long_side, const std::string& where) {
#if defined(LDI_WITH_LIBHEIF)
    if (is_heif(bytes)) return decode_heif(bytes, budget, where);
#endif
#if defined(LDI_WITH_LIBWEBP)
    if (is_webp(bytes)) return decode_webp(bytes, budget, where);
#endif
#if defined(LDI_WITH_LIBTIFF)
    if (is_tiff(bytes)) return decode_tiff(bytes, budget, where);
#endif
    if (!is_plain(bytes)) refuse_format(bytes, where);
    return decode_plain(bytes, take_photo_header(bytes, budget, where), long_side, where);
}

/// long_side  see photo_options
inline photo decode_photo_within(std::span<const std::byte> bytes, decoding_budget& budget, std::size_t long_side,
                                 const std::string& where) {
    stored_photo stored = decode_stored(bytes, budget, long_side, where);
    const bool is_opaque = stored.picture.channels == 1 || stored.picture.channels == 3;
    if (is_opaque && !stored.is_reduced && !is_png(bytes))
        average_blocks(stored.picture, divisor_for(long_side, stored.picture.height, stored.picture.width));
    photo result;
    result.focal_length_35mm = stored.focal_length_35mm;
    result.color = upright_color(stored);
    if (!stored.profile.icc.empty()) budget.charge(nearest_double(max_profile_memory), where, "a color profile");
    convert_to_srgb(result.color, stored.profile);
    return result;
}

}  // namespace detail

inline namespace LDI_READERS {

inline photo decode_photo(std::span<const std::byte> bytes, const photo_options& options, const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    return detail::decode_photo_within(bytes, budget, options.long_side, where);
}

inline decoding_estimate estimate_photo(std::span<const std::byte> bytes, const photo_options& options,
                                        const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    const picture_header header = detail::take_photo_header(bytes, budget, where);
    return {header.height, header.width, budget.charged() + detail::max_profile_memory};
}

inline photo load_photo(const std::filesystem::path& path, const photo_options& options) {
    return decode_photo(read_file(path), options, path.string());
}

}  // inline namespace

}}  // namespace ldi
