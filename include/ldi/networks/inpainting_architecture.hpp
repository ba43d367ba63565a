// Architectures of inpainting networks that networks/farbrausch.hpp runs: Farbrausch, and the full-size PartialConv that the
// paper compares it with.
//
// Both are U-Nets of partial convolutions. Encoder stage i (stride 2, ReLU) reads level i of a layered image and computes
// `channels[i]` channels on the next, coarser level. Each decoder stage is a 3 x 3 convolution with a leaky ReLU. It reads the
// upsampled result of the coarser level and the input of this level's encoder stage. Its output has as many channels as the
// input of that encoder stage. The last decoder stage differs: it computes red, green and blue, and has no activation.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/window.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Treatment of pixels without a color.
enum class missing_colors {
    filled,  ///< a smooth fill replaces them, a fourth input channel marks them, and the network's output is added to the fill
    masked,  ///< partial convolutions skip them; a layer has a result wherever its window contains a value
};

/// Properties of a network that are stored with its weights. The defaults are Farbrausch as examples/training/farbrausch trains
/// it: 0.38 M weights, 2.67 G multiplications at 512 x 512.
struct inpainting_architecture {
    buffer<std::size_t> channels{20, 40, 56, 72, 80};  ///< outputs of each encoder stage
    buffer<std::int32_t> kernels{7, 5, 5, 3, 3};       ///< kernel size of each encoder stage; the decoder's kernel size is 3
    int growth = 4;                                    ///< passes that spread fills on the coarsest level
    float leak = 0.2F;                                 ///< negative slope of the decoder's activation
    missing_colors missing = missing_colors::filled;

    /// Number of input channels of encoder stage i.
    std::size_t inputs(std::size_t i) const {
        if (i > 0) return channels[i - 1];
        return missing == missing_colors::filled ? 4 : 3;
    }
};

/// PartialConv (Liu et al., Image Inpainting for Irregular Holes Using Partial Convolutions, ECCV 2018): 32.85 M weights, 37.97 G
/// multiplications at 512 x 512, both as in the paper's table.
inline inpainting_architecture partial_convolution_architecture() {
    return {.channels = {64, 128, 256, 512, 512, 512, 512, 512},
            .kernels = {7, 5, 5, 3, 3, 3, 3, 3},
            .growth = 0,
            .leak = 0.2F,
            .missing = missing_colors::masked};
}

/// Number format of a network's computation. The results of both formats look the same (bench/README.md).
enum class arithmetic {
    float32,
    int8,  ///< 8-bit values and 7-bit weights: faster, but the weight file must contain value ranges
};

/// Returns the format's name in command-line options.
constexpr std::string_view to_string(arithmetic kind) {
    switch (kind) {
        case arithmetic::float32: return "float32";
        case arithmetic::int8: return "int8";
    }
    return "unknown";
}

namespace detail {

/// Raises unsupported if a property of the architecture is outside the limits below.
///
/// file  name for error messages; may be empty
inline void check_architecture(const inpainting_architecture& a, const std::string& file) {
    constexpr std::size_t max_levels = 8, max_filters = 1024;
    constexpr int max_growth = 64;
    const auto expect = [&](bool holds, const char* what, const char* expected, const std::string& found) {
        if (!holds)
            raise(error_code::unsupported, place_in(file, std::string("architecture of the inpainting network, ") + what),
                  expected, found);
    };
    expect(!a.channels.empty() && a.channels.size() <= max_levels, "channels", "1 to 8 stages",
           std::to_string(a.channels.size()));
    expect(a.kernels.size() == a.channels.size(), "kernels", "one kernel size for each stage", std::to_string(a.kernels.size()));
    for (const std::size_t count : a.channels)
        expect(count >= 1 && count <= max_filters, "channels", "1 to 1024 each", std::to_string(count));
    for (const std::int32_t size : a.kernels)
        expect(size >= 3 && size <= max_kernel_size && size % 2 == 1, "kernels", "odd numbers from 3 to 15",
               std::to_string(size));
    expect(a.growth >= 0 && a.growth <= max_growth, "growth", "0 to 64", std::to_string(a.growth));
    expect(a.leak >= 0.0F && a.leak <= 1.0F, "leak", "0 to 1", to_text(a.leak));
}

}  // namespace detail
}}  // namespace ldi
