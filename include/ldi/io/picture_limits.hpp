// Limits on decoding. A file that a stranger made can promise any size, list the same bytes thousands of times, repeat its scans
// or inflate to a thousand times its length; what exceeds a limit raises error_code::too_large, before its memory is allocated.
//
// One budget covers one input file: all pictures in it together, the photo, its depth map, the confidence of that map, and the
// metadata that describe them. What a decoder takes from the budget it does not give back, so that the budget also bounds time.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct picture_limits {
    /// A larger picture is refused before it is decoded.
    std::size_t max_pixels = 200'000'000;
    /// The budget of a file: memory for decoding, in bytes, on top of max_memory_per_byte. Decoding takes about 6 bytes per
    /// pixel, 18 at worst.
    std::size_t max_memory = 600'000'000;
    /// Grants more memory to longer files, per byte: a camera's 200 megapixels are tens of megabytes long.
    std::size_t max_memory_per_byte = 40;
    /// A progressive JPEG file paints each channel in several scans, about ten in all; a HEIC file may place a tile many times.
    /// This is the number of samples that all of them together may pass through; a billion takes one to four seconds.
    std::uint64_t max_scanned_samples = 1'500'000'000;
};

/// Facts about a file, read from its headers before anything is decoded.
struct decoding_estimate {
    std::size_t height = 0, width = 0;  ///< in pixels, as stored: a photo may be turned by 90 degrees
    std::size_t memory = 0;             ///< upper bound, in bytes, of what decoding takes, its result included, the file not
};

}}  // namespace ldi
