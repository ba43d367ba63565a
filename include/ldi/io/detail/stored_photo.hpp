// Result of the photo decoders: the stored samples, and the data with which decode_photo() converts them to an upright sRGB
// photo.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/io/detail/picture_decoder.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#if defined(__GLIBC__)
#include <sys/mman.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Maximum size of an ICC profile in bytes; longer profiles are ignored. Camera and screen profiles take a few kilobytes.
/// Scanner profiles take about half a megabyte.
inline constexpr std::size_t max_profile_bytes = std::size_t{2} << 20;

/// Codes of H.273 for the transfer curves of a high dynamic range: PQ (SMPTE ST 2084) and HLG (ITU-R BT.2100).
inline constexpr unsigned pq_transfer = 16, hlg_transfer = 18;

/// Color space of samples: sRGB if `icc` is empty and both numbers are 0.
struct color_profile {
    std::vector<std::byte> icc;
    unsigned primaries = 0;  ///< H.273 ColourPrimaries: 1 sRGB's, 9 BT.2020, 12 Display P3; 0 if unknown
    unsigned transfer = 0;   ///< H.273 TransferCharacteristics; codes other than pq_transfer and hlg_transfer count as sRGB's

    bool is_high_dynamic_range() const { return transfer == pq_transfer || transfer == hlg_transfer; }
};

struct stored_photo {
    decoded_picture<std::uint8_t> picture;
    bool is_reduced = false;                 ///< whether the decoder has divided the sides (photo_options::long_side)
    unsigned orientation = 1;                ///< 1 to 8, as in EXIF; 1 is upright
    std::optional<float> focal_length_35mm;  ///< in millimeters
    color_profile profile;
};

/// Allocates memory for a picture. Raises out_of_memory.
inline decoded_picture<std::uint8_t> allocate_picture(std::size_t height, std::size_t width, std::size_t channels,
                                                      const std::string& where) {
    decoded_picture<std::uint8_t> picture;
    picture.samples.reset(static_cast<std::uint8_t*>(std::malloc(height * width * channels)));
    if (!picture.samples)
        raise(error_code::out_of_memory, where,
              "memory for " + std::to_string(width) + " x " + std::to_string(height) + " pixels", "too little memory");
    picture.height = height, picture.width = width, picture.channels = channels;
    return picture;
}

/// Returns the largest of 1, 2, 4 and 8 by which both sides of a picture can be divided, rounded up, so that the longer side
/// keeps at least `long_side` pixels and the proportions change by less than 1 %. Returns 1 if long_side is 0.
inline std::size_t divisor_for(std::size_t long_side, std::size_t height, std::size_t width) {
    const std::size_t longer = (std::max)(height, width), shorter = (std::min)(height, width);
    const auto is_possible = [&](std::size_t by) { return (longer - 1) / by + 1 >= long_side && shorter >= 100 * by; };
    std::size_t divisor = 1;
    while (long_side > 0 && divisor < 8 && is_possible(2 * divisor)) divisor *= 2;
    return divisor;
}

/// Divides both sides of a picture, rounded up: replaces each block of divisor x divisor pixels by its mean, in place. Blocks at
/// the right and lower border may be smaller.
inline void average_blocks(decoded_picture<std::uint8_t>& picture, std::size_t divisor) {
    if (divisor <= 1) return;
    const std::size_t height = (picture.height - 1) / divisor + 1, width = (picture.width - 1) / divisor + 1;
    const std::size_t channels = picture.channels;
    std::uint8_t* to = picture.samples.get();
    buffer<std::uint16_t> sums(width * channels);  // of at most 64 values each
    for (std::size_t y = 0; y < height; ++y) {
        std::fill(sums.begin(), sums.end(), std::uint16_t{0});
        const std::size_t first = y * divisor, rows = (std::min)(divisor, picture.height - first);
        for (std::size_t row = first; row < first + rows; ++row) {
            const std::uint8_t* from = picture.samples.get() + row * picture.width * channels;
            for (std::size_t x = 0; x < width; ++x)
                for (std::size_t i = x * divisor; i < (std::min)((x + 1) * divisor, picture.width); ++i, from += channels)
                    for (std::size_t c = 0; c < channels; ++c)
                        sums[x * channels + c] = static_cast<std::uint16_t>(sums[x * channels + c] + from[c]);
        }
        for (std::size_t x = 0; x < width; ++x) {
            const auto count = static_cast<std::uint32_t>(rows * (std::min)(divisor, picture.width - x * divisor));
            for (std::size_t c = 0; c < channels; ++c)
                *to++ = static_cast<std::uint8_t>((sums[x * channels + c] + count / 2) / count);
        }
    }
    picture.height = height, picture.width = width;
}

/// Composites RGBA samples on white, and packs them as RGB, in place. Their colors are premultiplied by alpha.
inline void lay_on_white(decoded_picture<std::uint8_t>& picture) {
    const std::uint8_t* from = picture.samples.get();
    std::uint8_t* to = picture.samples.get();
    for (std::size_t left = picture.height * picture.width; left > 0; --left, from += 4) {
        const int white = 255 - from[3];
        for (std::size_t c = 0; c < 3; ++c) *to++ = static_cast<std::uint8_t>((std::min)(from[c] + white, 255));
    }
    picture.channels = 3;
}

/// Raises out_of_memory unless `bytes` bytes can be allocated now. Call it before library functions that report a lack of memory
/// as a damaged file, or that wait forever for threads that failed to start.
inline void require_memory(std::size_t bytes, const std::string& where) {
#if defined(__GLIBC__)  // malloc() would fill the memory while another thread has zeroed_allocations
    void* const pages = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (pages != MAP_FAILED) {
        ::munmap(pages, bytes);
        return;
    }
#endif
    void* volatile const probe = std::malloc(bytes);  // volatile: otherwise compilers remove the allocation
    const bool is_there = probe != nullptr;
    std::free(probe);
    if (!is_there)
        raise(error_code::out_of_memory, where, std::to_string(bytes / 1'000'000) + " MB of memory for decoding",
              "too little memory");
}

}}}  // namespace ldi::detail
