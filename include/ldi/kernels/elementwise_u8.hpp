// Row operations on 8-bit activations that need no weights: addition and nearest-neighbour enlargement.
#pragma once

#include <ldi/kernels/requantize.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi {

/// result[i] = a[i] + b[i], each in its own quantisation.
inline void add_u8(const quantized_addition& addition, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    for (std::size_t i = 0; i < count; ++i) result[i] = add_quantized(a[i], b[i], addition);
}

/// Repeats every pixel of a row `factor` times: width x channels to (width * factor) x channels.
inline void repeat_pixels_u8(const std::uint8_t* row, std::size_t width, std::size_t channels, std::size_t factor,
                             std::uint8_t* result) {
    for (std::size_t x = 0; x < width; ++x, row += channels)
        for (std::size_t i = 0; i < factor; ++i, result += channels) std::memcpy(result, row, channels);
}

}  // namespace ldi
