// Names the optional libraries of ldi::io. CMake defines a macro for each library that it finds: LDI_WITH_LIBHEIF (HEIC, AVIF),
// LDI_WITH_LIBWEBP, LDI_WITH_LIBTIFF, LDI_WITH_LCMS2 (color profiles), LDI_WITH_PUGIXML (XMP, which describes the depth in
// photos from phones), LDI_WITH_LIBJPEG (writes JPEG faster, and reads large JPEG files faster).
//
// Functions whose code depends on these libraries are in the inline namespace LDI_READERS. The name of this namespace lists the
// libraries, so that the linker never merges different versions of a function.
#pragma once

#include <ldi/base/config.hpp>

#if defined(LDI_WITH_LIBHEIF)
#define LDI_HEIF_PART _heif
#else
#define LDI_HEIF_PART
#endif
#if defined(LDI_WITH_LIBWEBP)
#define LDI_WEBP_PART _webp
#else
#define LDI_WEBP_PART
#endif
#if defined(LDI_WITH_LIBTIFF)
#define LDI_TIFF_PART _tiff
#else
#define LDI_TIFF_PART
#endif
#if defined(LDI_WITH_LCMS2)
#define LDI_PROFILE_PART _profiles
#else
#define LDI_PROFILE_PART
#endif
#if defined(LDI_WITH_PUGIXML)
#define LDI_XMP_PART _xmp
#else
#define LDI_XMP_PART
#endif
#if defined(LDI_WITH_LIBJPEG)
#define LDI_JPEG_PART _jpeg
#else
#define LDI_JPEG_PART
#endif

#define LDI_JOIN_READERS(a, b, c, d, e, f) readers##a##b##c##d##e##f
#define LDI_JOIN_READER_VALUES(a, b, c, d, e, f) LDI_JOIN_READERS(a, b, c, d, e, f)
#define LDI_READERS \
    LDI_JOIN_READER_VALUES(LDI_HEIF_PART, LDI_WEBP_PART, LDI_TIFF_PART, LDI_PROFILE_PART, LDI_XMP_PART, LDI_JPEG_PART)
