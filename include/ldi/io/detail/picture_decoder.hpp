// Decodes JPEG, PNG, GIF and BMP files with stb_image, after their headers have been read.
#pragma once

#include <ldi/formats/jpeg_png_header.hpp>
#include <ldi/io/detail/decoding_budget.hpp>
#include <ldi/io/detail/png_blocks.hpp>
#include <ldi/io/detail/stb_image.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct stb_free {
    void operator()(void* samples) const { stb::stbi_image_free(samples); }
};

/// A decoded picture: height x width x channels samples, row-major. Owns the buffer that stb_image allocated, because a copy
/// would double the memory.
template <class Sample>
struct decoded_picture {
    std::unique_ptr<Sample[], stb_free> samples;
    std::size_t height = 0, width = 0;
    std::size_t channels = 0;  ///< 1 gray, 2 gray and alpha, 3 red green blue, 4 red green blue and alpha
};

/// Decodes a picture. Raises invalid_data, too_large (beyond 2 GB, or too many blocks in a PNG file), out_of_memory.
///
/// header  header of the file; a decoding_budget must have granted the picture's memory
/// Sample  std::uint8_t, or std::uint16_t for all 16 bits of a PNG file (8-bit values become v * 257)
template <class Sample>
decoded_picture<Sample> decode_picture(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    static_assert(std::is_same_v<Sample, std::uint8_t> || std::is_same_v<Sample, std::uint16_t>);
    if (bytes.size() > 0x7FFFFFFF)
        raise(error_code::too_large, where, "a file below 2 GB", std::to_string(bytes.size()) + " bytes");
    if (header.format == picture_format::png) limit_png_blocks(bytes, where);
    const unsigned char* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    int width = 0, height = 0, channels = 0;
    decoded_picture<Sample> picture;
    const stb::growth_limit growth(header.max_growth);
    stb::stbi__g_failure_reason = nullptr;  // otherwise the reason of a previous failure may remain
    if constexpr (std::is_same_v<Sample, std::uint8_t>)
        picture.samples.reset(stb::stbi_load_from_memory(data, size, &width, &height, &channels, 0));
    else
        picture.samples.reset(stb::stbi_load_16_from_memory(data, size, &width, &height, &channels, 0));
    if (!picture.samples) {
        if (growth.was_exceeded()) damaged(header.format, where, "more data than its picture has");
        // If memory runs out, stb_image sometimes states no reason and sometimes "unknown image type".
        const char* const stated = stb::stbi_failure_reason();
        const std::string_view reason = stated == nullptr ? "outofmem" : stated;
        if (reason == "outofmem" || reason == "unknown image type" || reason == "too large")
            raise(reason == "too large" ? error_code::too_large : error_code::out_of_memory, where,
                  "memory for " + std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels",
                  "too little memory");
        if (reason == "too many codes")  // rare, but allowed by the format
            raise(error_code::unsupported, where, "a GIF file that clears its code table when the table is full",
                  "a GIF file that does not");
        // stb_image sets "bad png sig" for every file that is not PNG.
        damaged(header.format, where, reason == "bad png sig" ? "data that cannot be decoded" : std::string(reason));
    }
    picture.width = static_cast<std::size_t>(width), picture.height = static_cast<std::size_t>(height);
    picture.channels = static_cast<std::size_t>(channels);
    if (picture.width != header.width || picture.height != header.height)
        damaged(header.format, where, "a picture whose size differs from its header");
    return picture;
}

}}}  // namespace ldi::detail
