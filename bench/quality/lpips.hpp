// LPIPS: perceptual difference of two pictures (Zhang, Isola, Efros, Shechtman and Wang, "The Unreasonable Effectiveness of
// Deep Features as a Perceptual Metric", 2018), version 0.1 on the features of SqueezeNet 1.1 (Iandola et al., 2016). The
// implementation consists of loops around the library's convolution kernel. lpips_weights.py writes the weights.
#pragma once

#include "metrics.hpp"

#include <ldi/base/buffer.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace ldi_quality {

namespace detail {

using features = ldi::image<float>;  // H x W x C

/// A convolution of features with ReLU.
struct lpips_layer {
    std::size_t kernel = 1, stride = 1, padding = 0;
    ldi::conv_f32_weights weights;

    features operator()(const features& in) const {
        const std::size_t channels = in.channels(), height = in.height() + 2 * padding, width = in.width() + 2 * padding;
        features padded = in;
        if (padding > 0) {
            padded = features(height, width, channels);
            for (std::size_t y = 0; y < in.height(); ++y)
                std::copy_n(in.row(y), in.width() * channels, padded.row(y + padding) + padding * channels);
        }
        features out((height - kernel) / stride + 1, (width - kernel) / stride + 1, weights->outputs, ldi::unset);
        for (std::size_t y = 0; y < out.height(); ++y) {
            std::array<const float*, 3> rows{};
            for (std::size_t k = 0; k < kernel; ++k) rows[k] = padded.row(y * stride + k);
            ldi::conv_f32(weights, rows.data(), stride * channels, out.width(), nullptr, out.row(y));
        }
        return out;
    }
};

/// A fire module of SqueezeNet: a convolution to fewer channels, then two parallel convolutions.
struct lpips_fire {
    lpips_layer squeeze, expand_1x1, expand_3x3;

    features operator()(const features& in) const {
        const features few = squeeze(in), left = expand_1x1(few), right = expand_3x3(few);
        const std::size_t half = left.channels();
        features out(in.height(), in.width(), half + right.channels(), ldi::unset);
        for (std::size_t y = 0; y < out.height(); ++y)
            for (std::size_t x = 0; x < out.width(); ++x) {
                std::copy_n(&left(y, x), half, &out(y, x));
                std::copy_n(&right(y, x), right.channels(), &out(y, x, half));
            }
        return out;
    }
};

/// Maximum over 3 x 3, stride 2; the last windows extend beyond the border if necessary.
inline features pooled(const features& in) {
    const auto halved = [](std::size_t length) { return length / 2; };
    features out(halved(in.height()), halved(in.width()), in.channels(), -std::numeric_limits<float>::infinity());
    for (std::size_t y = 0; y < out.height(); ++y)
        for (std::size_t x = 0; x < out.width(); ++x)
            for (std::size_t v = 2 * y; v < std::min(2 * y + 3, in.height()); ++v)
                for (std::size_t u = 2 * x; u < std::min(2 * x + 3, in.width()); ++u)
                    for (std::size_t c = 0; c < in.channels(); ++c) out(y, x, c) = std::max(out(y, x, c), in(v, u, c));
    return out;
}

}  // namespace detail

class lpips_network {
public:
    static constexpr std::size_t min_side = 32;  ///< minimum side of compared pictures

    /// Makes a network without weights, whose results are all `unmeasured`.
    lpips_network() = default;

    /// from  tensors of lpips_squeeze_oihw.npz
    explicit lpips_network(const ldi::named_tensors& from) {
        first_ = layer(from, "slice1.conv", 3, 64, 3, 2, 0);
        // Per level: channels before, inside and after, and whether it has one or two fire modules.
        struct size {
            std::size_t inputs, squeezed, outputs;
            bool twice;
        };
        const size sizes[] = {{64, 16, 128, true},   {128, 32, 256, true},  {256, 48, 384, false},
                              {384, 48, 384, false}, {384, 64, 512, false}, {512, 64, 512, false}};
        weigh(from, 1, 64);
        std::size_t level = 2;
        for (const size& s : sizes) {
            const std::string name = "slice" + std::to_string(level) + ".fire";
            fires_.push_back({fire(from, name + "1/", s.inputs, s.squeezed, s.outputs)});
            if (s.twice) fires_.back().push_back(fire(from, name + "2/", s.outputs, s.squeezed, s.outputs));
            weigh(from, level++, s.outputs);
        }
    }

    bool has_weights() const { return !fires_.empty(); }

    /// Returns the difference around each pixel, H x W x 1. Its mean is the result of lpips.py.
    ///
    /// a, b  H x W x 3 of one size, neither side below min_side
    map differences(const picture& a, const picture& b) const {
        map result(a.height(), a.width());
        const std::vector<detail::features> levels_a = levels(a), levels_b = levels(b);
        for (std::size_t i = 0; i < levels_a.size(); ++i) {
            const ldi::image<float> level = difference(levels_a[i], levels_b[i], weights_[i]);
            const map here = resized(level, a.height(), a.width());
            for (std::size_t k = 0; k < result.size(); ++k) result.data()[k] += here.data()[k];
        }
        return result;
    }

    /// Returns the mean of differences() over the counted pixels; 0 if no pixel is counted, unmeasured without weights.
    double operator()(const picture& a, const picture& b, const mask& where) const {
        if (!has_weights()) return unmeasured;
        const map different = differences(a, b);
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < where.size(); ++i)
            if (where.data()[i] != 0) sum += different.data()[i], count += 1;
        return count > 0 ? sum / count : 0;
    }

private:
    static detail::lpips_layer layer(const ldi::named_tensors& from, const std::string& name, std::size_t inputs,
                                     std::size_t outputs, std::size_t kernel, std::size_t stride, std::size_t padding) {
        const ldi::buffer<float>& weight =
            ldi::tensor_values<float>(from, name + ".weight", ldi::buffer<std::size_t>{outputs, inputs, kernel, kernel});
        const ldi::buffer<float>& bias = ldi::tensor_values<float>(from, name + ".bias", ldi::buffer<std::size_t>{outputs});
        ldi::buffer<float> channels_last;
        for (std::size_t o = 0; o < outputs; ++o)
            for (std::size_t k = 0; k < kernel * kernel; ++k)
                for (std::size_t i = 0; i < inputs; ++i) channels_last.push_back(weight[(o * inputs + i) * kernel * kernel + k]);
        return {kernel, stride, padding,
                ldi::pack_conv_f32(ldi::best_isa(), {channels_last.data(), channels_last.size()}, {bias.data(), bias.size()},
                                   kernel, ldi::relu)};
    }

    static detail::lpips_fire fire(const ldi::named_tensors& from, const std::string& name, std::size_t inputs,
                                   std::size_t squeezed, std::size_t outputs) {
        return {layer(from, name + "conv", inputs, squeezed, 1, 1, 0),
                layer(from, name + "expand1x1", squeezed, outputs / 2, 1, 1, 0),
                layer(from, name + "expand3x3", squeezed, outputs / 2, 3, 1, 1)};
    }

    void weigh(const ldi::named_tensors& from, std::size_t level, std::size_t channels) {
        weights_.push_back(
            ldi::tensor_values<float>(from, "slice" + std::to_string(level) + ".lin", ldi::buffer<std::size_t>{channels}));
    }

    std::vector<detail::features> levels(const picture& p) const {
        constexpr std::array<float, 3> middle{-.030F, -.088F, -.188F}, spread{.458F, .448F, .450F};
        detail::features input(p.height(), p.width(), 3, ldi::unset);
        for (std::size_t i = 0; i < p.size(); ++i)
            input.data()[i] = (static_cast<float>(p.data()[i]) / 127.5F - 1 - middle[i % 3]) / spread[i % 3];
        std::vector<detail::features> result{first_(input)};
        for (std::size_t i = 0; i < fires_.size(); ++i) {
            detail::features x = i < 3 ? detail::pooled(result.back()) : result.back();
            for (const detail::lpips_fire& f : fires_[i]) x = f(x);
            result.push_back(std::move(x));
        }
        return result;
    }

    /// Weighted sum over the channels of the squared differences of normalized features.
    static ldi::image<float> difference(const detail::features& a, const detail::features& b, const ldi::buffer<float>& weights) {
        ldi::image<float> result(a.height(), a.width());
        const std::size_t channels = a.channels();
        const auto length = [&](const float* values) {
            float squared = 0;
            for (std::size_t c = 0; c < channels; ++c) squared += values[c] * values[c];
            return std::sqrt(squared) + 1e-10F;
        };
        for (std::size_t i = 0; i < result.size(); ++i) {
            const float *x = a.data() + i * channels, *y = b.data() + i * channels;
            const float x_length = length(x), y_length = length(y);
            for (std::size_t c = 0; c < channels; ++c) {
                const float d = x[c] / x_length - y[c] / y_length;
                result.data()[i] += weights[c] * d * d;
            }
        }
        return result;
    }

    detail::lpips_layer first_;
    std::vector<std::vector<detail::lpips_fire>> fires_;  ///< per level except the first
    std::vector<ldi::buffer<float>> weights_;             ///< weights of each level's channels
};

}  // namespace ldi_quality
