// Peak signal-to-noise ratio of pictures.
#pragma once

#include <ldi/core/image.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi::testing {

/// Returns the PSNR in dB of two pictures of the same shape; infinity if they are equal.
///
/// margin  pixels at each border that do not count
inline double psnr(const image<std::uint8_t>& a, const image<std::uint8_t>& b, std::size_t margin = 0) {
    const std::size_t channels = a.channels();
    double error = 0;
    std::size_t count = 0;
    for (std::size_t y = margin; y + margin < a.height(); ++y)
        for (std::size_t i = channels * margin; i + channels * margin < channels * a.width(); ++i, ++count) {
            const double difference = static_cast<double>(a.row(y)[i]) - static_cast<double>(b.row(y)[i]);
            error += difference * difference;
        }
    return 10 * std::log10(255.0 * 255.0 * static_cast<double>(count) / error);
}

}  // namespace ldi::testing
