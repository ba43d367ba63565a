// Photos: JPEG and PNG files, upright and as 8-bit RGB whatever they hold. The lens, where EXIF names it, comes along, since the
// field of view decides how far apart in space two pixels lie.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/detail/exif.hpp>
#include <ldi/formats/detail/picture_decoder.hpp>
#include <ldi/formats/file.hpp>
#include <ldi/formats/picture_limits.hpp>

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
    image<std::uint8_t> color;  ///< H x W x 3: red, green, blue, sRGB as stored (embedded color profiles are ignored)
    std::optional<float> focal_length_35mm;  ///< EXIF FocalLengthIn35mmFilm, in millimeters; see focal_length_from_35mm()
};

struct photo_options {
    picture_limits limits;
};

/// Decodes a JPEG or PNG file in memory.
///
/// The EXIF orientation is applied. Gray becomes RGB, Adobe CMYK and YCCK too (without a profile); of 16 bits the upper 8 are
/// kept; what is transparent is laid on white. An animated PNG gives its default picture, which is its first frame in most.
///
/// where  the name that errors give the data
/// Raises unsupported (another format, which the message names), invalid_data (empty, cut off or damaged), too_large.
photo decode_photo(std::span<const std::byte> bytes, const photo_options& options = {}, const std::string& where = "photo");

/// decode_photo() of a file; also raises file_access.
photo load_photo(const std::filesystem::path& path, const photo_options& options = {});

namespace detail {

/// The way through a stored picture that shows it upright: pixel (y, x) lies at index origin + y * down + x * right.
struct upright_order {
    std::size_t height, width;
    std::ptrdiff_t origin, down, right;
};

inline upright_order make_upright(unsigned orientation, std::size_t stored_height, std::size_t stored_width) {
    const std::ptrdiff_t h = static_cast<std::ptrdiff_t>(stored_height), w = static_cast<std::ptrdiff_t>(stored_width);
    switch (orientation) {
        case 2: return {stored_height, stored_width, w - 1, w, -1};        // mirrored
        case 3: return {stored_height, stored_width, h * w - 1, -w, -1};   // upside down
        case 4: return {stored_height, stored_width, (h - 1) * w, -w, 1};  // upside down and mirrored
        case 5: return {stored_width, stored_height, 0, 1, w};             // lying and mirrored
        case 6: return {stored_width, stored_height, (h - 1) * w, 1, -w};  // lying: turn right
        case 7: return {stored_width, stored_height, h * w - 1, -1, -w};   // lying and mirrored
        case 8: return {stored_width, stored_height, w - 1, -1, w};        // lying: turn left
        default: return {stored_height, stored_width, 0, w, 1};
    }
}

/// `value` seen through `alpha` on white.
inline std::uint8_t over_white(unsigned value, unsigned alpha) {
    return static_cast<std::uint8_t>((value * alpha + 255 * (255 - alpha) + 127) / 255);
}

}  // namespace detail

inline photo decode_photo(std::span<const std::byte> bytes, const photo_options& options, const std::string& where) {
    const detail::picture_header header = detail::read_picture_header(bytes, where);
    detail::check_limits(header, bytes.size(), options.limits, where);
    const detail::decoded_picture<std::uint8_t> stored = detail::decode_picture<std::uint8_t>(bytes, header, where);
    const detail::exif_facts facts = detail::read_exif(header.exif);
    const detail::upright_order order = detail::make_upright(facts.orientation, stored.height, stored.width);

    photo result;
    result.focal_length_35mm = facts.focal_length_35mm;
    try {
        result.color = image<std::uint8_t>(order.height, order.width, 3, unset);
    } catch (const std::bad_alloc&) {
        raise(error_code::too_large, where, "a picture that fits in memory",
              std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels");
    }
    const bool has_alpha = stored.channels == 2 || stored.channels == 4;
    const std::size_t green = stored.channels >= 3 ? 1 : 0, blue = stored.channels >= 3 ? 2 : 0;
    std::ptrdiff_t row = order.origin;
    for (std::size_t y = 0; y < order.height; ++y, row += order.down) {
        std::uint8_t* to = result.color.row(y);
        std::ptrdiff_t from = row;
        for (std::size_t x = 0; x < order.width; ++x, to += 3, from += order.right) {
            const std::uint8_t* const sample = stored.samples.get() + static_cast<std::size_t>(from) * stored.channels;
            to[0] = sample[0], to[1] = sample[green], to[2] = sample[blue];
            if (!has_alpha) continue;
            const unsigned alpha = sample[stored.channels - 1];
            for (std::size_t c = 0; c < 3; ++c) to[c] = detail::over_white(to[c], alpha);
        }
    }
    return result;
}

inline photo load_photo(const std::filesystem::path& path, const photo_options& options) {
    return decode_photo(read_file(path), options, path.string());
}

}  // namespace ldi
