// Limits on decoding. An untrusted file can state any size, list the same bytes thousands of times, repeat its scans or inflate
// to a thousand times its length. Exceeding a limit raises error_code::too_large before the memory is allocated.
//
// One budget covers one input file: all its pictures together (the photo, its depth map, the confidence map of the depth) and
// the metadata that describes them. Decoders charge the budget and never refund it, so the budget also bounds time.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct picture_limits {
    /// Maximum number of pixels; a larger picture is rejected before it is decoded.
    std::size_t max_pixels = 200'000'000;
    /// Maximum memory in bytes for decoding a file, in addition to max_memory_per_byte. Decoding needs 4 to 24 bytes per pixel,
    /// for example 6 for a baseline color JPEG, and 24 for AVIF with more than 8 bits per sample.
    std::size_t max_memory = 600'000'000;
    /// Additional memory in bytes per byte of the file. This raises the limit for large photos: the file of a 200-megapixel
    /// photo has tens of megabytes.
    std::size_t max_memory_per_byte = 40;
    /// Maximum number of samples that all scans together may process; a billion samples take one to eight seconds. A progressive
    /// JPEG file codes each channel in several scans, about ten in total. A HEIC or TIFF file may use one tile many times.
    std::uint64_t max_scanned_samples = 1'000'000'000;
};

/// Size of a picture and memory to decode it, read from the headers of its file before anything is decoded.
struct decoding_estimate {
    std::size_t height = 0, width = 0;  ///< size in pixels as stored; the upright photo may swap height and width
    std::size_t memory = 0;             ///< upper bound in bytes for decoding, including the result but not the file
};

}}  // namespace ldi
