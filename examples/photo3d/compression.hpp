// `photo3d --compress`: what is asked for, and the file that it makes of the plain one.
#pragma once

#if defined(LDI_WITH_COMPRESSION)
#include "compressed_glb.hpp"
#include "webp_texture.hpp"
#endif

#include <ldi/base/error.hpp>
#include <ldi/photo3d.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace ldi::examples {

struct compression_choice {
    bool is_wanted = false;
    std::string texture = "webp";
};

inline void describe_compression(CLI::App& app, compression_choice& c) {
    CLI::Option* compress = app.add_flag(
        "--compress", c.is_wanted,
        "GLB and page of fewer bytes, for viewers that know EXT_meshopt_compression: three.js, Babylon.js and others of the web");
    app.add_option(
           "--compressed-texture", c.texture,
           "of a compressed GLB: webp, a quarter smaller at the same quality, for viewers that know EXT_texture_webp; jpeg; "
           "or both, for all of them")
        ->check(CLI::IsMember({"webp", "jpeg", "both"}))
        ->needs(compress)
        ->capture_default_str();
}

/// To be called before the work. Raises invalid_option where the program was built without what it takes.
inline void check_compression([[maybe_unused]] const compression_choice& c) {
#if !defined(LDI_WITH_COMPRESSION)
    if (c.is_wanted)
        raise(error_code::invalid_option, "--compress",
              "a photo3d that was built with meshoptimizer and libwebp (Debian: libmeshoptimizer-dev, libwebp-dev)",
              "one that was built without");
#endif
}

/// The GLB that is written.
struct written_glb {
    std::vector<std::byte> file;
    std::size_t texture_bytes;  ///< of these
};

/// The plain GLB, or a compressed one.
///
/// texture  the plain one's
/// quality  of the plain one's JPEG texture, 1 to 100
inline written_glb compressed([[maybe_unused]] const photo3d& result, std::span<const std::byte> plain,
                              std::span<const std::byte> texture, [[maybe_unused]] int quality, const compression_choice& c) {
    check_compression(c);
    if (!c.is_wanted) return {{plain.begin(), plain.end()}, texture.size()};
#if defined(LDI_WITH_COMPRESSION)
    // A tenth of a pixel: pictures are like the plain file's at 50 dB, where the texture's JPEG or WebP alone costs more.
    compression_options options;
    options.precision = 0.1F / result.layers.camera.focal_length;
    std::vector<std::byte> webp;
    if (c.texture != "jpeg") {
        // On libwebp's scale about the same error: see README.md.
        webp = encode_webp(result.atlas.color, static_cast<float>(std::max(quality - 3, 1)));
        options.webp = webp, options.keeps_texture = c.texture == "both";
    }
    return {compress_glb(plain, options), webp.size() + (c.texture == "webp" ? 0 : texture.size())};
#endif
}

}  // namespace ldi::examples
