// Nearest-neighbor upsampling of one row of 8-bit activations.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Repeats every pixel of a row `factor` times: width x channels to (width * factor) x channels.
inline void repeat_pixels_u8(const std::uint8_t* row, std::size_t width, std::size_t channels, std::size_t factor,
                             std::uint8_t* result) {
    for (std::size_t x = 0; x < width; ++x, row += channels)
        for (std::size_t i = 0; i < factor; ++i, result += channels) std::memcpy(result, row, channels);
}

}}  // namespace ldi
