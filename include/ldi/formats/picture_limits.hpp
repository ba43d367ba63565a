// The most that decoding a picture may take. A file that a stranger made can promise any size, repeat its passes thousands of
// times or inflate to a thousand times its length; what exceeds a limit is refused, most of it before anything is allocated.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION {

struct picture_limits {
    /// A larger picture is refused before it is decoded.
    std::size_t max_pixels = 200'000'000;
    /// Memory for decoding, in bytes, on top of max_memory_per_byte. Decoding takes about 6 bytes per pixel, 16 at worst.
    std::size_t max_memory = 600'000'000;
    /// Grants more memory to longer files, per byte: a camera's 200 megapixels are tens of megabytes long.
    std::size_t max_memory_per_byte = 40;
    /// A progressive JPEG file paints each channel in several scans, about ten in all. This is how many samples all scans
    /// together may pass through; a billion takes one to four seconds.
    std::uint64_t max_scanned_samples = 1'500'000'000;
};

}  // namespace ldi
