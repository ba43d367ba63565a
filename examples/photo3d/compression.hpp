// Writes the compressed GLB of `photo3d --compress` and of the Python package's glb(compress=True).
#pragma once

#if defined(LDI_WITH_COMPRESSION)
#include "compressed_glb.hpp"
#include "webp_texture.hpp"
#endif

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ldi::examples {

struct compression_choice {
    bool is_wanted = false;
    std::string texture = "webp";  ///< webp, jpeg or both
};

/// Raises invalid_option if compression is requested but its libraries were missing at build time. Call it before the
/// conversion.
inline void check_compression([[maybe_unused]] const compression_choice& c) {
#if !defined(LDI_WITH_COMPRESSION)
    if (c.is_wanted)
        raise(error_code::invalid_option, "compress", "ldi built with meshoptimizer and libwebp",
              "ldi built without them (Debian: libmeshoptimizer-dev, libwebp-dev)");
#endif
}

/// Texture files of a 3D photo.
struct texture_files {
    std::vector<std::vector<std::byte>> jpeg;  ///< as in a plain GLB
    std::vector<std::vector<std::byte>> webp;  ///< for textures that the mesh uses, if requested
};

/// Adds the WebP file of a texture, if requested.
///
/// quality  quality of the JPEG, 1 to 100
inline void add_webp([[maybe_unused]] texture_files& files, [[maybe_unused]] const image<std::uint8_t>& picture,
                     [[maybe_unused]] int quality, [[maybe_unused]] const compression_choice& c) {
#if defined(LDI_WITH_COMPRESSION)
    // On libwebp's scale, a quality lower by 3 has about the same error: see README.md.
    if (c.is_wanted && c.texture != "jpeg")
        files.webp.push_back(encode_webp(picture, static_cast<float>(std::max(quality - 3, 1))));
#endif
}

/// A GLB file to write.
struct written_glb {
    std::vector<std::byte> file;
    std::size_t texture_bytes;  ///< bytes of its textures
};

inline std::size_t total_bytes(const std::vector<std::vector<std::byte>>& files) {
    std::size_t sum = 0;
    for (const std::vector<std::byte>& file : files) sum += file.size();
    return sum;
}

/// Returns the plain GLB, or a compressed one if requested. Raises the errors of check_compression() and compress_glb().
///
/// plain         result of encode_glb()
/// files         the textures, as JPEG and, if requested, as WebP
/// focal_length  focal length of the camera in pixels
inline written_glb compressed(std::span<const std::byte> plain, const texture_files& files, [[maybe_unused]] float focal_length,
                              const compression_choice& c) {
    check_compression(c);
    const std::size_t jpeg_bytes = total_bytes(files.jpeg);
    if (!c.is_wanted) return {{plain.begin(), plain.end()}, jpeg_bytes};
#if defined(LDI_WITH_COMPRESSION)
    // A tenth of a pixel. Renderings of the compressed file then have a PSNR of 50 dB relative to those of the plain file. The
    // error of the texture's JPEG or WebP encoding is larger.
    compression_options options;
    options.precision = 0.1F / focal_length;
    options.webp = files.webp, options.keeps_texture = c.texture == "both";
    return {compress_glb(plain, options), total_bytes(files.webp) + (c.texture == "webp" ? 0 : jpeg_bytes)};
#endif
}

}  // namespace ldi::examples
