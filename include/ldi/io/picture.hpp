// Writes pictures: JPEG for textures, PNG for data that must be stored without loss.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/picture_header.hpp>
#include <ldi/io/detail/readers.hpp>
#include <ldi/io/file.hpp>

#if defined(LDI_WITH_LIBJPEG)
#include <ldi/io/detail/jpeg_encoder.hpp>
#else
#include <ldi/io/detail/stb_image_write.hpp>
#endif

#include <png.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

inline namespace LDI_READERS {

/// Encodes an H x W x 1 or H x W x 3 picture as JPEG. Each side must have at most 65,500 pixels, and the samples must occupy less
/// than 2 GB. At quality 90 and below, chroma is subsampled (4:2:0). Uses libjpeg, or stb_image_write if ldi::io was configured
/// without libjpeg; the file sizes of the two encoders differ by half a percent.
///
/// quality  1 to 100
///
/// Raises invalid_option for any other quality, too_large for any other size, mismatch for a picture with another number of
/// channels or without pixels, and out_of_memory.
std::vector<std::byte> encode_jpeg(image_view<const std::uint8_t> picture, int quality = 85);

/// Encodes an image with encode_jpeg() and writes it to a file; also raises file_access.
inline void save_jpeg(const std::filesystem::path& path, image_view<const std::uint8_t> picture, int quality = 85) {
    write_file(path, encode_jpeg(picture, quality));
}

}  // inline namespace

/// Encodes an H x W x 1 or H x W x 3 image with at least one pixel as PNG. Raises mismatch for any other shape, too_large,
/// out_of_memory.
std::vector<std::byte> encode_png(image_view<const std::uint8_t> picture);

/// Encodes an H x W x 1 image with at least one pixel as 16-bit gray PNG, the format of depth maps. Raises mismatch for any other
/// shape, too_large, out_of_memory.
std::vector<std::byte> encode_png(image_view<const std::uint16_t> picture);

/// Encodes an image with encode_png() and writes it to a file; also raises file_access.
template <class Scalar>
void save_png(const std::filesystem::path& path, const image<Scalar>& picture) {
    write_file(path, encode_png(picture));
}

namespace detail {

/// Raises mismatch unless the picture has pixels, and one channel or, if allows_color, three.
template <class Scalar>
void check_picture(image_view<const Scalar> picture, bool allows_color, const char* where) {
    const bool has_channels = picture.channels() == 1 || (allows_color && picture.channels() == 3);
    if (picture.height() == 0 || picture.width() == 0 || !has_channels)
        raise(error_code::mismatch, where, allows_color ? "H x W x 1 or H x W x 3, with pixels" : "H x W x 1, with pixels",
              shape_text(picture));
}

/// Removes the chunks between a PNG file's header and its data. For 16-bit gray, libpng states linear light there, and other
/// programs would convert the values of a depth map.
inline void drop_color_space(std::vector<std::byte>& png) {
    constexpr std::size_t begin = 8 + 12 + 13;  // after the signature and the header's chunk
    std::size_t end = begin;
    while (!has_text(png, end + 4, "IDAT")) end += 12 + big_endian_32(png, end);
    png.erase(png.begin() + begin, png.begin() + static_cast<std::ptrdiff_t>(end));
}

template <class Scalar>
std::vector<std::byte> encode_png_as(image_view<const Scalar> picture, png_uint_32 format) {
    const auto too_large = [&](const char* reason) {
        raise(error_code::too_large, "encode_png", "a picture that fits in a PNG file",
              std::to_string(picture.width()) + " x " + std::to_string(picture.height()) + " pixels: " + reason);
    };
    if (picture.row_stride() > 0x7FFFFFFF / 2 || picture.width() > 0x7FFFFFFF / 6 || picture.height() > 0x7FFFFFFF)
        too_large("a side is too long");
    png_image description = {};
    description.version = PNG_IMAGE_VERSION;
    description.width = static_cast<png_uint_32>(picture.width());
    description.height = static_cast<png_uint_32>(picture.height());
    description.format = format;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(description);  // an upper bound, so that one compression pass is enough
    std::vector<std::byte> bytes(size);
    if (png_image_write_to_memory(&description, bytes.data(), &size, 0, picture.data(),
                                  static_cast<png_int_32>(picture.row_stride()), nullptr) == 0) {
        for (const char* const said : {"nsufficient memory", "ut of memory"})
            if (std::strstr(description.message, said) != nullptr) out_of_memory();
        too_large(description.message);
    }
    bytes.resize(size);
    bytes.shrink_to_fit();
    return bytes;
}

}  // namespace detail

inline namespace LDI_READERS {

inline std::vector<std::byte> encode_jpeg(image_view<const std::uint8_t> picture, int quality) {
    detail::check_picture(picture, true, "encode_jpeg");
    constexpr std::size_t max_side = 65500;  // limit of libjpeg
    if (quality < 1 || quality > 100) raise(error_code::invalid_option, "JPEG quality", "1 to 100", std::to_string(quality));
    if (picture.height() > max_side || picture.width() > max_side ||
        picture.height() * picture.width() * picture.channels() >
            std::size_t{(std::numeric_limits<int>::max)()})  // stb_image_write counts samples in int
        raise(error_code::too_large, "encode_jpeg", "sides of at most 65500 pixels, and less than 2 GB in memory",
              std::to_string(picture.width()) + " x " + std::to_string(picture.height()));
#if defined(LDI_WITH_LIBJPEG)
    return detail::jpeg_encoder().encode(picture, quality);
#else
    const image<std::uint8_t> without_gaps(picture);
    std::vector<std::byte> bytes;
    const auto append = [](void* to, void* data, int size) {
        // insert() would make g++ 12 print a false overflow warning in the user's build.
        std::vector<std::byte>& all = *static_cast<std::vector<std::byte>*>(to);
        const std::size_t used = all.size(), added = static_cast<std::size_t>(size);
        all.resize(used + added);
        if (added > 0) std::memcpy(all.data() + used, data, added);
    };
    detail::stb::stbi_write_jpg_to_func(append, &bytes, static_cast<int>(picture.width()), static_cast<int>(picture.height()),
                                        static_cast<int>(picture.channels()), without_gaps.data(), quality);
    return bytes;
#endif
}

}  // inline namespace

inline std::vector<std::byte> encode_png(image_view<const std::uint8_t> picture) {
    detail::check_picture(picture, true, "encode_png");
    return detail::encode_png_as(picture, picture.channels() == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY);
}

inline std::vector<std::byte> encode_png(image_view<const std::uint16_t> picture) {
    detail::check_picture(picture, false, "encode_png");
    std::vector<std::byte> bytes = detail::encode_png_as(picture, PNG_FORMAT_LINEAR_Y);
    detail::drop_color_space(bytes);
    return bytes;
}

}}  // namespace ldi
