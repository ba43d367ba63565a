// How far a picture is from the truth: PSNR and SSIM, over a whole picture or a part of it.
#pragma once

#include <ldi/core/image.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ldi_quality {

using picture = ldi::image<std::uint8_t>;

/// One a pixel, not 0 where it counts.
using mask = ldi::image<std::uint8_t>;

struct quality {
    double psnr = 0;  ///< in dB; 60 at most, which is what a picture that is right has
    double ssim = 0;  ///< mean over the pixels that count
};

inline double psnr_of(double mean_squared_error) {
    return std::min(60.0, 10 * std::log10(255.0 * 255.0 / std::max(mean_squared_error, 1e-9)));
}

/// The share of pixels that count.
inline double share(const mask& where) {
    std::size_t count = 0;
    for (const std::uint8_t value : where) count += value != 0 ? 1 : 0;
    return static_cast<double>(count) / static_cast<double>(where.size());
}

inline double psnr(const picture& a, const picture& b, const mask& where) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < where.size(); ++i) {
        if (where.data()[i] == 0) continue;
        for (std::size_t c = 0; c < 3; ++c) {
            const double d = static_cast<double>(a.data()[3 * i + c]) - static_cast<double>(b.data()[3 * i + c]);
            sum += d * d;
        }
        ++count;
    }
    return count > 0 ? psnr_of(sum / (3.0 * static_cast<double>(count))) : 60;
}

/// H x W x 3 values, blurred with a Gaussian of sigma 1.5 over 11 x 11 pixels, the border repeated.
inline ldi::buffer<float> blurred(const ldi::buffer<float>& values, std::size_t rows, std::size_t columns) {
    std::array<float, 11> weights{};
    float sum = 0;
    for (int i = -5; i <= 5; ++i) sum += weights[static_cast<std::size_t>(i + 5)] = std::exp(-static_cast<float>(i * i) / 4.5F);
    const auto pass = [&](const ldi::buffer<float>& from, bool across) {
        ldi::buffer<float> to(from.size());
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x)
                for (std::size_t c = 0; c < 3; ++c) {
                    float total = 0;
                    for (std::size_t k = 0; k < 11; ++k) {
                        const auto shifted = [k](std::size_t at, std::size_t count) {
                            return std::clamp<std::size_t>(at + k, 5, count + 4) - 5;
                        };
                        const std::size_t v = across ? y : shifted(y, rows), u = across ? shifted(x, columns) : x;
                        total += weights[k] * from[3 * (v * columns + u) + c];
                    }
                    to[3 * (y * columns + x) + c] = total / sum;
                }
        return to;
    };
    return pass(pass(values, true), false);
}

/// Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004: the map,
/// averaged over the channels, and over the pixels that count.
inline double ssim(const picture& a, const picture& b, const mask& where) {
    const std::size_t rows = a.height(), columns = a.width(), count = a.size();
    ldi::buffer<float> x(count), y(count), xx(count), yy(count), xy(count);
    for (std::size_t i = 0; i < count; ++i) {
        x[i] = static_cast<float>(a.data()[i]), y[i] = static_cast<float>(b.data()[i]);
        xx[i] = x[i] * x[i], yy[i] = y[i] * y[i], xy[i] = x[i] * y[i];
    }
    for (ldi::buffer<float>* values : {&x, &y, &xx, &yy, &xy}) *values = blurred(*values, rows, columns);
    const float c1 = 0.01F * 0.01F * 255 * 255, c2 = 0.03F * 0.03F * 255 * 255;
    double sum = 0;
    std::size_t pixels = 0;
    for (std::size_t p = 0; p < where.size(); ++p) {
        if (where.data()[p] == 0) continue;
        for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) {
            const float variance = xx[i] - x[i] * x[i] + yy[i] - y[i] * y[i], covariance = xy[i] - x[i] * y[i];
            sum += static_cast<double>((2 * x[i] * y[i] + c1) * (2 * covariance + c2) /
                                       ((x[i] * x[i] + y[i] * y[i] + c1) * (variance + c2)));
        }
        ++pixels;
    }
    return pixels > 0 ? sum / (3.0 * static_cast<double>(pixels)) : 1;
}

inline quality measure(const picture& result, const picture& truth, const mask& where) {
    return {psnr(result, truth, where), ssim(result, truth, where)};
}

inline double mean(const ldi::buffer<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace ldi_quality
