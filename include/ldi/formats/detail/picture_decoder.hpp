// Decodes a JPEG or PNG file whose header has been read, through stb_image.
#pragma once

#include <ldi/formats/detail/picture_format.hpp>
#include <ldi/formats/detail/stb_image.hpp>
#include <ldi/formats/picture_limits.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace ldi::inline LDI_CONFIGURATION::detail {

struct stb_free {
    void operator()(void* samples) const { stb::stbi_image_free(samples); }
};

/// height x width x channels samples, row-major, in the memory that stb allocated (a copy would cost as much as the picture).
template <class Sample>
struct decoded_picture {
    std::unique_ptr<Sample[], stb_free> samples;
    std::size_t height = 0, width = 0;
    std::size_t channels = 0;  ///< 1 gray, 2 gray and alpha, 3 red green blue, 4 and alpha
};

/// Refuses a picture whose header promises more than `max_pixels`.
inline void check_pixel_count(std::size_t width, std::size_t height, std::size_t max_pixels, const std::string& where) {
    if (width > max_pixels / height)
        raise(error_code::too_large, where, "at most " + std::to_string(max_pixels) + " pixels",
              std::to_string(width) + " x " + std::to_string(height));
}

/// Refuses a picture whose decoding would take more than the limits allow.
inline void check_limits(const picture_header& header, std::size_t file_size, const picture_limits& limits,
                         const std::string& where) {
    check_pixel_count(header.width, header.height, limits.max_pixels, where);
    const double pixels = nearest_double(header.width) * nearest_double(header.height);
    const double allowed =
        nearest_double(limits.max_memory) + nearest_double(limits.max_memory_per_byte) * nearest_double(file_size);
    if (pixels * nearest_double(header.memory_per_pixel) > allowed)
        raise(error_code::too_large, where,
              "a picture that decodes in " + std::to_string(static_cast<std::uint64_t>(allowed / 1e6)) + " MB",
              std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels in " + std::to_string(file_size) +
                  " bytes");
    if (nearest_double(header.scanned_channels) * pixels > nearest_double(limits.max_scanned_samples))
        raise(error_code::too_large, where, "scans through at most " + std::to_string(limits.max_scanned_samples) + " samples",
              std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels, " +
                  std::to_string(header.scanned_channels) + " times");
}

/// header  has passed check_limits()
/// Sample  std::uint8_t, or std::uint16_t for all 16 bits of a PNG file (8-bit files come out as v * 257)
/// Raises invalid_data, too_large (beyond 2 GB, or more than there is memory for).
template <class Sample>
decoded_picture<Sample> decode_picture(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    static_assert(std::is_same_v<Sample, std::uint8_t> || std::is_same_v<Sample, std::uint16_t>);
    if (bytes.size() > 0x7FFFFFFF)
        raise(error_code::too_large, where, "a file below 2 GB", std::to_string(bytes.size()) + " bytes");
    const unsigned char* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    int width = 0, height = 0, channels = 0;
    decoded_picture<Sample> picture;
    // Beyond the rows as the header promises them (an interlaced picture has a few more) there may be some bytes too many.
    const std::size_t promised = header.width * header.height * header.memory_per_pixel;
    const stb::growth_limit growth(2 * (std::max)(promised, bytes.size()) + 65536);
    stb::stbi__g_failure_reason = nullptr;  // else it may be that of a file before
    if constexpr (std::is_same_v<Sample, std::uint8_t>)
        picture.samples.reset(stb::stbi_load_from_memory(data, size, &width, &height, &channels, 0));
    else
        picture.samples.reset(stb::stbi_load_16_from_memory(data, size, &width, &height, &channels, 0));
    if (!picture.samples) {
        if (growth.was_exceeded()) damaged(header.format, where, "more data than its picture has");
        // It gives no reason where its memory ran out in some places.
        const char* const stated = stb::stbi_failure_reason();
        const std::string_view reason = stated == nullptr ? "outofmem" : stated;
        if (reason == "outofmem" || reason == "too large")
            raise(error_code::too_large, where, "a picture that fits in memory",
                  std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels");
        damaged(header.format, where, std::string(reason));
    }
    picture.width = static_cast<std::size_t>(width), picture.height = static_cast<std::size_t>(height);
    picture.channels = static_cast<std::size_t>(channels);
    if (picture.width != header.width || picture.height != header.height) damaged(header.format, where, "two sizes");
    return picture;
}

}  // namespace ldi::detail
