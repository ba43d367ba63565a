// Lists the optional parts that this build of the program lacks, because their libraries were missing.
#pragma once

#include <string>

namespace ldi::examples {

/// Returns a second line for --version, such as "\nbuilt without HEIC and AVIF (libheif)"; empty if nothing is left out.
inline std::string parts_left_out() {
    std::string parts;
    [[maybe_unused]] const auto add = [&](const char* part) { parts += (parts.empty() ? "" : ", ") + std::string(part); };
#if !defined(LDI_WITH_LIBHEIF)
    add("HEIC and AVIF (libheif)");
#endif
#if !defined(LDI_WITH_LIBWEBP)
    add("WebP (libwebp)");
#endif
#if !defined(LDI_WITH_LIBTIFF)
    add("TIFF (libtiff)");
#endif
#if !defined(LDI_WITH_LCMS2)
    add("color profiles (lcms2)");
#endif
#if !defined(LDI_WITH_PUGIXML)
    add("depth in XMP (pugixml)");
#endif
#if !defined(LDI_WITH_COMPRESSION)
    add("--compress (meshoptimizer, libwebp)");
#endif
#if defined(_WIN32)
    add("video files (ffmpeg)");
#endif
    return parts.empty() ? "" : "\nbuilt without " + parts;
}

}  // namespace ldi::examples
