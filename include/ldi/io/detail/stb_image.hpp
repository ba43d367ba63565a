// stb_image's decoders of JPEG, PNG, GIF and BMP, private to ldi. A separate namespace and internal linkage prevent clashes
// with the copy in libtinygltf and with a copy that the program includes before or after this header.
#pragma once
#pragma GCC system_header

#include <ldi/base/config.hpp>

#include <assert.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SSE2__) || defined(_M_X64) || defined(_M_IX86)
#include <emmintrin.h>
#endif
#if defined(_MSC_VER)
#include <intrin.h>
#endif

#pragma push_macro("STBI_INCLUDE_STB_IMAGE_H")
#pragma push_macro("STBIDEF")
#pragma push_macro("STB_IMAGE_IMPLEMENTATION")
#pragma push_macro("STB_IMAGE_STATIC")
#pragma push_macro("STBI_ONLY_JPEG")
#pragma push_macro("STBI_ONLY_PNG")
#pragma push_macro("STBI_ONLY_GIF")
#pragma push_macro("STBI_ONLY_BMP")
#pragma push_macro("STBI_NO_STDIO")
#pragma push_macro("STBI_NO_LINEAR")
#pragma push_macro("STBI_NO_BMP")
#pragma push_macro("STBI_NO_PSD")
#pragma push_macro("STBI_NO_TGA")
#pragma push_macro("STBI_NO_GIF")
#pragma push_macro("STBI_NO_HDR")
#pragma push_macro("STBI_NO_PIC")
#pragma push_macro("STBI_NO_PNM")
#pragma push_macro("STBI_MALLOC")
#pragma push_macro("STBI_REALLOC")
#pragma push_macro("STBI_FREE")
#pragma push_macro("STBI_REALLOC_SIZED")
#pragma push_macro("stbi__err")
#undef STBI_INCLUDE_STB_IMAGE_H
#undef STBIDEF
#undef STB_IMAGE_IMPLEMENTATION
#undef STB_IMAGE_STATIC
#undef STBI_ONLY_JPEG
#undef STBI_ONLY_PNG
#undef STBI_ONLY_GIF
#undef STBI_ONLY_BMP
#undef STBI_NO_STDIO
#undef STBI_NO_LINEAR
#undef STBI_MALLOC
#undef STBI_REALLOC
#undef STBI_FREE
#undef STBI_REALLOC_SIZED
#undef stbi__err

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STBI_ONLY_GIF
#define STBI_ONLY_BMP
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
// Allocates zeroed memory. The undecoded parts of a damaged file are then deterministic and never contain another file's data.
#define STBI_MALLOC(size) calloc(1, size)
#define STBI_REALLOC(pointer, size) grow(pointer, size)
#define STBI_FREE(pointer) free(pointer)

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace stb {

// stb_image inflates all data of a PNG file, even beyond the size in the file's header. It enlarges its buffers with grow().
inline thread_local size_t largest_growth = SIZE_MAX;
inline thread_local bool is_growth_exceeded = false;

inline void* grow(void* pointer, size_t size) {
    is_growth_exceeded = is_growth_exceeded || size > largest_growth;
    return size > largest_growth ? nullptr : realloc(pointer, size);
}

/// While an object of this class exists, the decoder cannot enlarge a buffer of this thread beyond `bytes`.
class growth_limit {
public:
    explicit growth_limit(size_t bytes) { largest_growth = bytes, is_growth_exceeded = false; }
    growth_limit(const growth_limit&) = delete;
    growth_limit& operator=(const growth_limit&) = delete;
    ~growth_limit() { largest_growth = SIZE_MAX; }
    bool was_exceeded() const { return is_growth_exceeded; }
};

#include <stb/stb_image.h>
}}}}  // namespace ldi::detail::stb

#undef STBI_NO_BMP
#undef STBI_NO_PSD
#undef STBI_NO_TGA
#undef STBI_NO_GIF
#undef STBI_NO_HDR
#undef STBI_NO_PIC
#undef STBI_NO_PNM
#pragma pop_macro("stbi__err")
#pragma pop_macro("STBI_REALLOC_SIZED")
#pragma pop_macro("STBI_FREE")
#pragma pop_macro("STBI_REALLOC")
#pragma pop_macro("STBI_MALLOC")
#pragma pop_macro("STBI_NO_PNM")
#pragma pop_macro("STBI_NO_PIC")
#pragma pop_macro("STBI_NO_HDR")
#pragma pop_macro("STBI_NO_GIF")
#pragma pop_macro("STBI_NO_TGA")
#pragma pop_macro("STBI_NO_PSD")
#pragma pop_macro("STBI_NO_BMP")
#pragma pop_macro("STBI_NO_LINEAR")
#pragma pop_macro("STBI_NO_STDIO")
#pragma pop_macro("STBI_ONLY_BMP")
#pragma pop_macro("STBI_ONLY_GIF")
#pragma pop_macro("STBI_ONLY_PNG")
#pragma pop_macro("STBI_ONLY_JPEG")
#pragma pop_macro("STB_IMAGE_STATIC")
#pragma pop_macro("STB_IMAGE_IMPLEMENTATION")
#pragma pop_macro("STBIDEF")
#pragma pop_macro("STBI_INCLUDE_STB_IMAGE_H")
