// Quality of a picture relative to the truth: PSNR and SSIM, over a whole picture or a part of it; and shared helpers.
#pragma once

#include <ldi/adapt/xtensor.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/core/image.hpp>

#include <xtensor/xmath.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ldi_quality {

using picture = ldi::image<std::uint8_t>;

/// H x W x 1, nonzero for counted pixels.
using mask = ldi::image<std::uint8_t>;

/// H x W x 1
using map = ldi::image<double>;

inline constexpr double unmeasured = std::numeric_limits<double>::quiet_NaN();

inline double psnr_of(double mean_squared_error) {
    return std::min(60.0, 10 * std::log10(255.0 * 255.0 / std::max(mean_squared_error, 1e-9)));
}

/// Share of counted pixels.
inline double share(const mask& where) { return xt::mean(xt::cast<double>(xt::not_equal(ldi::as_tensor(where), 0)))(); }

/// Mean of H x W x 3 values over the counted pixels; `nothing` if there is none.
template <class Values>
double mean_where(const Values& values, const mask& where, double nothing) {
    const auto counts = xt::cast<double>(xt::not_equal(ldi::as_tensor(where), 0));  // H x W x 1, for all channels
    const double pixels = xt::sum(counts)();
    return pixels > 0 ? xt::sum(values * counts)() / (3 * pixels) : nothing;
}

inline double psnr(const picture& a, const picture& b, const mask& where) {
    const auto difference = xt::cast<double>(ldi::as_tensor(a)) - xt::cast<double>(ldi::as_tensor(b));
    return psnr_of(mean_where(xt::square(difference), where, 0));
}

using tensor = xt::xtensor<float, 3>;

/// Blurs H x W x 3 values with a Gaussian of sigma 1.5 over 11 x 11 pixels, repeating the border. Uses loops, because xtensor's
/// shifted views take ten times as long.
inline tensor blurred(const tensor& values) {
    std::array<float, 11> weights{};
    float sum = 0;
    for (int i = -5; i <= 5; ++i) sum += weights[static_cast<std::size_t>(i + 5)] = std::exp(-static_cast<float>(i * i) / 4.5F);
    const std::size_t rows = values.shape(0), columns = values.shape(1);
    const auto pass = [&](const tensor& from, bool across) {
        tensor to = xt::empty_like(from);
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x)
                for (std::size_t c = 0; c < 3; ++c) {
                    float total = 0;
                    for (std::size_t k = 0; k < 11; ++k) {
                        const auto shifted = [k](std::size_t at, std::size_t count) {
                            return std::clamp<std::size_t>(at + k, 5, count + 4) - 5;
                        };
                        total += weights[k] * from(across ? y : shifted(y, rows), across ? shifted(x, columns) : x, c);
                    }
                    to(y, x, c) = total / sum;
                }
        return to;
    };
    return pass(pass(values, true), false);
}

/// Structural similarity (Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
/// Similarity", 2004): mean of the map over channels and counted pixels.
inline double ssim(const picture& a, const picture& b, const mask& where) {
    const tensor x = xt::cast<float>(ldi::as_tensor(a)), y = xt::cast<float>(ldi::as_tensor(b));
    const tensor x_mean = blurred(x), y_mean = blurred(y);
    const auto variance = blurred(x * x) - x_mean * x_mean + blurred(y * y) - y_mean * y_mean;
    const auto covariance = blurred(x * y) - x_mean * y_mean;
    constexpr float c1 = 0.01F * 0.01F * 255 * 255, c2 = 0.03F * 0.03F * 255 * 255;
    const tensor similarity =
        (2 * x_mean * y_mean + c1) * (2 * covariance + c2) / ((x_mean * x_mean + y_mean * y_mean + c1) * (variance + c2));
    return mean_where(xt::cast<double>(similarity), where, 1);
}

inline double mean(const ldi::buffer<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// Median; the mean of the two middle values for an even number.
inline double median(ldi::buffer<double> values) {
    const std::ptrdiff_t half = static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), values.begin() + half, values.end());
    const double upper = values[static_cast<std::size_t>(half)];
    if (values.size() % 2 == 1) return upper;
    return (upper + *std::max_element(values.begin(), values.begin() + half)) / 2;
}

/// Resizes by bilinear interpolation between pixel centers, repeating the border.
inline map resized(const ldi::image<float>& from, std::size_t rows, std::size_t columns) {
    struct tap {
        std::size_t first, second;
        double weight;  // weight of `second`
    };
    const auto taps = [](std::size_t source, std::size_t target) {
        std::vector<tap> result;
        const double last = static_cast<double>(source - 1);
        for (std::size_t i = 0; i < target; ++i) {
            const double at = (static_cast<double>(i) + 0.5) * static_cast<double>(source) / static_cast<double>(target) - 0.5;
            const double inside = std::clamp(at, 0.0, last), first = std::floor(inside);
            result.push_back(
                {static_cast<std::size_t>(first), static_cast<std::size_t>(std::min(first + 1, last)), inside - first});
        }
        return result;
    };
    map result = ldi::image<double>(rows, columns);
    const std::vector<tap> across = taps(from.width(), columns), down = taps(from.height(), rows);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const tap u = across[x], v = down[y];
            const auto row = [&](std::size_t at) {
                return static_cast<double>(from(at, u.first, 0)) * (1 - u.weight) +
                       static_cast<double>(from(at, u.second, 0)) * u.weight;
            };
            result(y, x, 0) = row(v.first) * (1 - v.weight) + row(v.second) * v.weight;
        }
    return result;
}

}  // namespace ldi_quality
