// Encodes the texture as WebP, a quarter to a third smaller than JPEG: `photo3d --compress` (EXT_texture_webp).
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>

#include <webp/encode.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace ldi::examples {

/// Encodes an H x W x 3 image as lossy WebP. Raises too_large beyond 16,383 pixels per side.
///
/// quality  1 to 100, on WebP's own scale
inline std::vector<std::byte> encode_webp(const image<std::uint8_t>& picture, float quality) {
    LDI_ASSERT(picture.channels() == 3 && picture.size() > 0);
    if (picture.width() > WEBP_MAX_DIMENSION || picture.height() > WEBP_MAX_DIMENSION)
        raise(error_code::too_large, "encode_webp", "sides of at most 16383 pixels",
              std::to_string(picture.width()) + " x " + std::to_string(picture.height()));
    WebPConfig config;
    WebPPicture source;
    if (WebPConfigPreset(&config, WEBP_PRESET_PHOTO, quality) == 0 || WebPPictureInit(&source) == 0)
        raise(error_code::unavailable, "libwebp", "the version of the headers", "another version");
    config.method = 6;         // smallest file
    config.use_sharp_yuv = 1;  // keeps color edges although chroma has half the resolution
    source.use_argb = 1;
    source.width = static_cast<int>(picture.width()), source.height = static_cast<int>(picture.height());
    WebPMemoryWriter file;
    WebPMemoryWriterInit(&file);
    source.writer = WebPMemoryWrite;
    source.custom_ptr = &file;
    const bool is_good =
        WebPPictureImportRGB(&source, picture.data(), 3 * source.width) != 0 && WebPEncode(&config, &source) != 0;
    const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(file.mem, WebPFree);
    WebPPictureFree(&source);
    if (!is_good &&
        (source.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY || source.error_code == VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY))
        raise(error_code::out_of_memory, "libwebp", "enough memory", "too little");
    if (!is_good)
        raise(error_code::too_large, "libwebp", "a texture that it can encode",
              std::to_string(picture.width()) + " x " + std::to_string(picture.height()) + " texels");
    const std::byte* const first = reinterpret_cast<const std::byte*>(file.mem);
    return {first, first + file.size};
}

}  // namespace ldi::examples
